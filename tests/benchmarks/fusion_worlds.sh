#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Robots in generated worlds: each maps its own recording, then the maps are fused and measured.
#   fusion_worlds.sh office FRAMES ROBOTS SEED...   every robot's path in one frame against the truth
#   fusion_worlds.sh corridor FRAMES SEED...        two robots in places that look alike: must not be merged
# PLUMBLINE names the program, WORK the folder for worlds and maps, MAP_OPTIONS more options of plumbline map.
set -euo pipefail
plumbline="${PLUMBLINE:-build/release/bin/plumbline}"
work="${WORK:-$(mktemp -d)}"
[ $# -ge 3 ] || { sed -n '3,6s/^# //p' "$0" >&2; exit 2; }
scene=$1 frames=$2
shift 2
robots=2
if [ "$scene" = office ]; then robots=$1; shift; fi
lean=(-q --force --set output.views= --set output.pcd=off)

for seed in "$@"; do
  world="$work/${scene}_${frames}_${robots}_$seed"
  texture=weak
  [ "$scene" = corridor ] && texture=full
  [ -d "$world" ] || "$plumbline" synth "$scene" -o "$world" --frames "$frames" --robots "$robots" \
    --texture "$texture" --seed "$seed" --reference-spacing 0.05 -q
  maps=()
  for ((r = 0; r < robots; r++)); do
    # shellcheck disable=SC2086 # several options
    "$plumbline" map "$world/robot$r" -o "$world/maps/robot$r" "${lean[@]}" ${MAP_OPTIONS:-} || [ $? -eq 4 ]
    maps+=("$world/maps/robot$r")
  done
  code=0
  "$plumbline" fuse "${maps[@]}" -o "$world/fused" "${lean[@]}" 2>"$world/fused.txt" || code=$?
  echo "$scene seed $seed: fuse ends with $code; $(tail -n 1 "$world/fused.txt")"
  if [ "$scene" = corridor ]; then
    [ $code -eq 4 ] || { echo "FALSE MERGE" >&2; exit 1; }
    continue
  fi
  for ((r = 0; r < robots; r++)); do
    for map in "$world/maps/robot$r" "$world/fused/robots/robot$r"; do
      [ -d "$map" ] || continue
      printf '%s ' "$map"
      "$plumbline" evaluate trajectory "$map/trajectory.txt" "$world/robot$r" | grep -i -m 1 ate || true
    done
  done
done
