#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# What track.camera.refine is worth where the camera's file is wrong: generated worlds, mapped with the true file and
# with a wrong one, refinement off and auto. Prints a Markdown table: ATE rmse in m (share of frames tracked).
#   camera_worlds.sh PROGRAM [SEED...]
# FRAMES changes the length (default 300), KINDS what is wrong, MAP_OPTIONS adds options of plumbline map, WORK keeps
# the worlds.
set -euo pipefail
[ $# -ge 1 ] || { sed -n '3,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
program=$1
shift
seeds=("$@")
[ $# -gt 0 ] || seeds=(1 2 3 4 5 6 7 8 9 10)
work="${WORK:-$(mktemp -d)}"
mkdir -p "$work"
lean=(-q --force --set output.views= --set output.pcd=off --set output.ply=off --set fuse.voxel=20mm)

ate() { # RECORDING CAMERA auto|off: maps and evaluates
  local out=$work/out
  # shellcheck disable=SC2086 # several options
  "$program" map "$1" -o "$out" --camera "$2" --set "track.camera.refine=$3" "${lean[@]}" ${MAP_OPTIONS:-} 2>"$work/log" || true
  "$program" evaluate trajectory "$out" "$1" --json >"$work/ate.json" 2>/dev/null || echo '{}' >"$work/ate.json"
  python3 - "$out/summary.json" "$work/ate.json" <<'PYTHON'
import json, sys
def load(file):
    try: return json.load(open(file))
    except (OSError, ValueError): return {}
summary, truth = load(sys.argv[1]), load(sys.argv[2])
nan = float('nan')
used = [n['name'] for c in summary.get('camera', []) for n in c['numbers'] if n['used']]
print(f"{truth.get('ate_m', {}).get('rmse', nan):.4f} ({summary.get('frames', {}).get('tracked_percent', nan):.0f})", *used)
PYTHON
}

echo "| world | wrong in the file | true file, off | true file, auto | wrong file, off | wrong file, auto | found |"
echo "|---|---|---|---|---|---|---|"
for seed in "${seeds[@]}"; do
  sign=$((seed % 2 * 2 - 1))
  scene=$([ $((seed % 3)) -eq 0 ] && echo office || echo room)
  for kind in ${KINDS:-focal k1 slope readout delay}; do
    readout=0 delay=0
    [ "$kind" = readout ] && readout=$(python3 -c "print(0.005 * (($seed - 1) % 5 + 1))")
    [ "$kind" = delay ] && delay=$(python3 -c "print(0.01 * $sign * (($seed - 1) // 2 % 2 + 1))")
    world=$work/$scene.$seed.$readout.$delay
    [ -d "$world" ] || "$program" synth "$scene" -o "$world" --frames "${FRAMES:-300}" --seed "$seed" --readout "$readout" \
      --depth-delay "$delay" --reference-spacing 0.5 -q
    true=$world/robot0/camera.yaml wrong=$work/wrong.yaml
    case $kind in
      focal) what="fx, fy $((2 * sign)) %" ; awk -v s="$sign" '/^f[xy]:/ {$2 *= 1 + s * 0.02} {print}' "$true" >"$wrong" ;;
      k1) what="k1 $sign * 0.05" ; sed "s/^distortion:.*/distortion: [$(python3 -c "print(0.05 * $sign)"), 0, 0, 0, 0]/" "$true" >"$wrong" ;;
      slope) what="depth_slope x $sign * 0.02" ; { cat "$true" ; echo "depth_slope: [$(python3 -c "print(0.02 * $sign)"), 0]" ; } >"$wrong" ;;
      readout) what="readout, $readout s" ; sed '/^readout/d' "$true" >"$wrong" ;;
      delay) what="depth_delay, $delay s" ; sed '/^depth_delay/d' "$true" >"$wrong" ;;
    esac
    right=$(ate "$world/robot0" "$true" off)
    kept=$(ate "$world/robot0" "$true" auto)
    off=$(ate "$world/robot0" "$wrong" off)
    auto=$(ate "$world/robot0" "$wrong" auto)
    words=($auto)
    echo "| $scene, seed $seed | $what | $right | $kept | $off | ${words[0]} ${words[1]} | ${words[*]:2} |"
  done
done
