#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What becomes of a robot that loses itself: generated rooms and offices whose path comes back, with a hand before the
# lens, a spin, dropped frames or the lamp off. Prints a Markdown table: the share of the frames in which anything can
# be seen that have a pose in the one map, ATE (rmse, most) in mm beside that of the undisturbed recording, and the
# components.
#   lost_worlds.sh PROGRAM [SEED...]
# COMES_BACK=0: offices of which only the beginning is filmed. FRAMES changes the length (default 600), KINDS the
# events, MAP_OPTIONS adds options of plumbline map, WORK keeps the worlds.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '3,9s/^# \{0,1\}//p' "$0" >&2; exit 2; }
program=$1
shift
seeds=("$@")
[ $# -gt 0 ] || seeds=(1 2 3 4 5 6 7 8 9 10)
work="${WORK:-$(mktemp -d)}"
mkdir -p "$work"
lean=(-q --force --set output.views= --set output.pcd=off --set fuse.voxel=20mm)

# One room of the office again and again: its whole path takes 138 s.
home=$work/office_home.yaml
awk '/^robots:/ {robots = 1} !robots || !/^      - / || ++places <= 5 {print} robots && places > 5 {exit}' \
  "$(dirname "$0")/../../pipelines/scenes/office.yaml" >"$home"

world() { # NAME SCENE SEED EVENTS
  [ -d "$work/$1" ] || "$program" synth "$2" -o "$work/$1" --frames "${FRAMES:-600}" --seed "$3" ${4:+--events "$4"} \
    --reference-spacing 0.5 -q
}
result() { # NAME HIDDEN: frames of the recording in which nothing can be seen
  # shellcheck disable=SC2086 # several options
  "$program" map "$work/$1/robot0" -o "$work/out" "${lean[@]}" ${MAP_OPTIONS:-} 2>"$work/log" || true
  "$program" evaluate trajectory "$work/out" "$work/$1/robot0" --json >"$work/ate.json" 2>/dev/null || echo '{}' >"$work/ate.json"
  python3 - "$work/out/summary.json" "$work/ate.json" "$2" <<'PYTHON'
import json, sys
def load(file):
    try: return json.load(open(file))
    except (OSError, ValueError): return {}
summary, truth, hidden = load(sys.argv[1]), load(sys.argv[2]), int(sys.argv[3])
frames, parts = summary.get('frames', {}), summary.get('components', {'list': []})
apart = sum(c['frames'] for c in parts['list'] if not c['joined'])
seen = frames.get('read', 0) - hidden
share = 100.0 * (frames.get('tracked', 0) - apart) / max(1, seen)
ate = truth.get('ate_m', {})
joined = sum(c['joined'] for c in parts['list'])
print(f"{share:.1f} | {1e3 * ate.get('rmse', float('nan')):.1f}, {1e3 * ate.get('max', float('nan')):.0f} | "
      f"{joined} joined, {len(parts['list']) - joined} apart, {parts.get('dropped', 0)} dropped")
PYTHON
}

echo "| world | event | pose in the one map (%) | ATE, most (mm) | components | undisturbed |"
echo "|---|---|---|---|---|---|"
for seed in "${seeds[@]}"; do
  what=room scene=room
  [ $((seed % 3)) -eq 0 ] && what=office scene=$home
  [ "${COMES_BACK:-1}" = 0 ] && scene=$what
  world "$seed" "$scene" "$seed" ""
  quiet=$(result "$seed" 0)
  for kind in ${KINDS:-cover spin drop lampoff}; do
    case $kind in
      cover) events="cover@5+3" hidden=90 ;;
      spin) events="spin@6+1*1.5" hidden=0 ;;
      drop) events="drop@6+2" hidden=0 ;;
      lampoff) events="lampoff@5+3" hidden=90 ;;
    esac
    world "$seed.$kind" "$scene" "$seed" "$events"
    echo "| $what, seed $seed | $kind | $(result "$seed.$kind" $hidden) | ${quiet%|*}|"
  done
done
