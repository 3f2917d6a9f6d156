#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Two programs in turn on the same inputs: is the new one as accurate, as fast and as lean as the old one?
#   compare_programs.sh OLD NEW [RECORDING|synth:SCENE?...]...
# Without inputs: the real recordings of PLUMBLINE_DATA (else ../shared/data) and ten generated worlds, 200 frames each.
# Medians of STARTS starts (5), STEP_S apart (0.1 s), a thread each; WORK keeps the worlds, MAP_OPTIONS are options of
# plumbline map. Walls: thickness (rms) as `plumbline evaluate cloud` finds them.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '3,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
old=$1 new=$2
shift 2
here=$(cd "$(dirname "$0")" && pwd)
data="${PLUMBLINE_DATA:-$here/../../../shared/data}"
starts="${STARTS:-5}" step="${STEP_S:-0.1}" work="${WORK:-$(mktemp -d)}"
mkdir -p "$work"
inputs=("$@")
if [ ${#inputs[@]} -eq 0 ]; then
  [ -d "$data" ] && for folder in "$data"/*/; do inputs+=("${folder%/}"); done
  for scene in room office corridor structure plane; do
    for seed in 1 2; do inputs+=("synth:$scene?frames=200&texture=weak&seed=$seed"); done
  done
fi

film() { # URL: on disk, so that no time is spent on filming
  local body=${1#synth:} options=() folder
  folder="$work/$(tr -c 'A-Za-z0-9\n' '_' <<<"$body")"
  if [ ! -d "$folder" ]; then
    IFS='&' read -ra pairs <<<"${body#*\?}"
    for pair in "${pairs[@]}"; do options+=("--${pair%%=*}" "${pair#*=}"); done
    "$new" synth "${body%%\?*}" -o "$folder.new" "${options[@]}" --reference-spacing 0.5 -q && mv "$folder.new" "$folder"
  fi
  echo "$folder/robot0"
}

one() { # PROGRAM RECORDING START: "tracked ATE fps MB walls exit"
  local out="$work/out" code=0
  # shellcheck disable=SC2086 # several options
  "$1" map "$2" -o "$out" --from "$3" -q --force --threads 1 --set output.views= --set output.pcd=off \
    ${MAP_OPTIONS:-} 2>/dev/null || code=$?
  "$new" evaluate trajectory "$out" "$2" --json >"$work/path.json" 2>/dev/null || echo '{}' >"$work/path.json"
  "$new" evaluate cloud "$out" --json >"$work/cloud.json" 2>/dev/null || echo '{}' >"$work/cloud.json"
  python3 - "$out/summary.json" "$work/path.json" "$work/cloud.json" "$code" <<'PYTHON'
import json, sys
def load(file):
    try: return json.load(open(file))
    except (OSError, ValueError): return {}
summary, path, cloud = (load(f) for f in sys.argv[1:4])
nan = float('nan')
print(summary.get('frames', {}).get('tracked_percent', nan), path.get('ate_m', {}).get('rmse', nan),
      summary.get('timing', {}).get('fps', nan), summary.get('memory', {}).get('peak_rss_mb', nan),
      cloud.get('wall_thickness_mm', {}).get('rms', nan), sys.argv[4])
PYTHON
}

echo "| input | tracked, least (%) | ATE old (m) | new | ratio | fps new / old | MB old | new | walls old (mm) | new |"
echo "|---|---|---|---|---|---|---|---|---|---|"
for input in "${inputs[@]}"; do
  recording=$input
  [[ "$input" == synth:* ]] && recording=$(film "$input")
  rm -f "$work/old.rows" "$work/new.rows"
  for ((i = 0; i < starts; ++i)); do
    from=$(python3 -c "print(f'{$i * $step:.4f}')")
    one "$old" "$recording" "$from" >>"$work/old.rows"
    one "$new" "$recording" "$from" >>"$work/new.rows"
  done
  python3 - "$(basename "$input")" "$work/old.rows" "$work/new.rows" <<'PYTHON'
import math, statistics, sys
name, *files = sys.argv[1:]
rows = [[[float(v) for v in line.split()] for line in open(f)] for f in files]
def median(values):
    values = [v for v in values if not math.isnan(v)]
    return statistics.median(values) if values else float('nan')
old, new = ([median(r[i] for r in side) for i in range(5)] for side in rows)
tracked = min(r[0] for side in rows for r in side)
fps = median(n[2] / o[2] for o, n in zip(*rows))
print(f'| {name} | {tracked:.1f} | {old[1]:.4f} | {new[1]:.4f} | {new[1] / old[1]:.3f} | {fps:.3f} | {old[3]:.0f} | '
      f'{new[3]:.0f} | {old[4]:.1f} | {new[4]:.1f} |')
PYTHON
done
