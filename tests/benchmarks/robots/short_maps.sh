#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Pairs of short maps of an office, merged or not: short_maps.sh PLUMBLINE SHORT_MAPS WORK [FIRST_SEED=21] [PAIRS=30]
# Each pair: 1.3 s of a path, and a second film of it (nine tenths as fast, so that no two frames are alike) that has
# 30 to 100 per cent of that stretch in common. Three seeds take turns, and the stretches lie all along the path. Then the
# same number of pairs that lie elsewhere on the path. What is in WORK already is not mapped again.
set -euo pipefail
[ $# -ge 3 ] || { sed -n '3,7s/^# \{0,1\}//p' "$0" >&2; exit 2; }
program=$1 judge=$2 work=$3 first=${4:-21} pairs=${5:-30}
mkdir -p "$work"

film() { # NAME SEED SPEED FROM_S TO_S
  [ -f "$work/$1/map.db" ] || "$program" map "synth:office?frames=$(python3 -c "print(round(1500/$3))")&seed=$2&speed=$3&width=320&height=240" \
    -p robot -q --force --from "$4" --to "$5" -o "$work/$1" || [ $? -eq 4 ]
}
truth() { # SEED SPEED
  local folder="$work/truth_$1_$2"
  [ -d "$folder" ] || "$program" synth office -o "$folder" --frames "$(python3 -c "print(round(1500/$2))")" --seed "$1" \
    --speed "$2" --width 64 --height 48 --reference-spacing 1 -q
  find "$folder" -name groundtruth.txt
}

arguments=() others=()
for ((i = 0; i < pairs; ++i)); do
  seed=$((first + i % 3))
  read -r from_a to_a from_b to_b < <(python3 -c "
t, share = 2 + 45 / $pairs * $i, (0.3, 0.5, 0.65, 0.8, 1.0)[$i % 5]
print(t, t + 1.3, (t + 1.3 * (1 - share)) / 0.9, (t + 1.3 * (2 - share)) / 0.9)")
  film "a$i" "$seed" 1 "$from_a" "$to_a"
  film "b$i" "$seed" 0.9 "$from_b" "$to_b"
  arguments+=("$work/a$i" "$(truth "$seed" 1)" "$work/b$i" "$(truth "$seed" 0.9)")
  other=$(((i + 9) % pairs)) # of the same seed, seconds away
  others+=("$work/a$i" "$(truth "$seed" 1)" "$work/b$other" "$(truth $((first + other % 3)) 0.9)")
done
"$judge" "${arguments[@]}" >"$work/same.txt"
"$judge" "${others[@]}" >"$work/other.txt"
for name in same other; do
  echo "$name place: $(grep -c ^merged "$work/$name.txt" || true) of $pairs merged," \
    "worst error $(awk '/^merged/ {for (i = 1; i < NF; ++i) if ($i == "error" && $(i + 1) > m) m = $(i + 1)} END {print m + 0}' "$work/$name.txt") m"
done
