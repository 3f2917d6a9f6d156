#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Places that look alike with a loss in between: corridors in which a hand covers the lens, a room and the same room with
# other textures, a room and its mirror image. Nothing must be joined that is not one place. Prints a Markdown table:
# what was joined, frames with a pose, and for corridors the error of the one map.
#   like_places.sh PROGRAM [SEED...]
# KINDS chooses of corridor, like and mirror; WORK keeps the worlds. Wants python3-opencv.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '3,7s/^# \{0,1\}//p' "$0" >&2; exit 2; }
program=$1
here=$(dirname "$0")
shift
seeds=("$@")
[ $# -gt 0 ] || seeds=(1 2 3 4 5 6 7 8 9 10)
work="${WORK:-$(mktemp -d)}"
mkdir -p "$work"
lean=(-q --force --set output.views= --set output.pcd=off --set fuse.voxel=20mm)

world() { # NAME SCENE SEED FRAMES EVENTS
  [ -d "$work/$1" ] || "$program" synth "$2" -o "$work/$1" --frames "$4" --seed "$3" ${5:+--events "$5"} --reference-spacing 0.5 -q
}
judge() { # RECORDING
  "$program" map "$1" -o "$work/out" "${lean[@]}" 2>"$work/log" || true
  "$program" evaluate trajectory "$work/out" "$1" --json >"$work/ate.json" 2>/dev/null || echo '{}' >"$work/ate.json"
  python3 - "$work/out" "$work/ate.json" <<'PYTHON'
import json, sys
summary, truth = (json.load(open(f)) for f in (sys.argv[1] + "/summary.json", sys.argv[2]))
parts = summary["components"]["list"]
worst = truth.get("ate_m", {}).get("max")
print(f"{sum(c['joined'] for c in parts)} joined, {sum(not c['joined'] for c in parts)} apart | "
      f"{summary['frames']['tracked']} of {summary['frames']['read']} | "
      f"{'' if worst is None else f'{1e3 * worst:.0f}'} | {len(summary['loops']['disputes'])} | "
      f"{'yes' if summary['trustworthy'] else 'no'}")
PYTHON
}

echo "| world | components | frames with a pose | largest error (mm) | disputes | trusted |"
echo "|---|---|---|---|---|---|"
for seed in "${seeds[@]}"; do
  for kind in ${KINDS:-corridor like mirror}; do
    recording=$work/$kind.$seed
    case $kind in
      corridor) world "$kind.$seed" corridor "$seed" 900 "cover@12+3" && recording=$recording/robot0 ;;
      *)
        other=$([ "$kind" = like ] && echo "$((seed + 100))" || echo "$seed")
        world "room.$seed" room "$seed" 300 ""
        world "room.$other" room "$other" 300 ""
        [ -d "$recording" ] || /usr/bin/python3 "$here/chain_recordings.py" "$recording" "$work/room.$seed/robot0" \
          "$work/room.$other/robot0$([ "$kind" = mirror ] && echo :mirror)"
        ;;
    esac
    echo "| $kind, seed $seed | $(judge "$recording") |"
    rm -rf "$work/out"
  done
done
