#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# How far a result depends on the moment at which a recording begins. Each recording is mapped from 30 starts,
# 1/30 s apart, and one line of a table is printed for it.
#   starts.sh PROGRAM RECORDING|synth:SCENE?...  [more recordings]
# ATE and the largest error of a step between neighbouring frames where there is truth; the largest disagreement of
# a step with the tracker's own (summary.json, path.largest_step_m) where the program tells it.
# STARTS and STEP_S change the starts, MAP_OPTIONS adds options of plumbline map, WORK keeps the results.
set -euo pipefail
[ $# -ge 2 ] || { sed -n '3,9s/^# \{0,1\}//p' "$0" >&2; exit 2; }
program=$1
shift
starts="${STARTS:-30}" step="${STEP_S:-0.0333333}"
work="${WORK:-$(mktemp -d)}"
mkdir -p "$work"
lean=(-q --force --threads 1 --set output.views= --set output.pcd=off)

one() { # RECORDING FOLDER START: maps and evaluates; a line "tracked ATE step disagreement exit"
  local recording=$1 out=$2 code=0
  # shellcheck disable=SC2086 # several options
  "$program" map "$recording" -o "$out" --from "$3" "${lean[@]}" ${MAP_OPTIONS:-} 2>"$out.txt" || code=$?
  truth=$recording
  [[ "$recording" == synth:* ]] && truth=$work/$(name_of "$recording")
  "$program" evaluate trajectory "$out" "$truth" --json >"$out.json" 2>/dev/null || echo '{}' >"$out.json"
  python3 - "$out" "$code" <<'PYTHON'
import json, sys
out, code = sys.argv[1], sys.argv[2]
def load(file):
    try: return json.load(open(file))
    except (OSError, ValueError): return {}
summary, truth = load(out + '/summary.json'), load(out + '.json')
nan = float('nan')
print(summary.get('frames', {}).get('tracked_percent', nan), truth.get('ate_m', {}).get('rmse', nan),
      truth.get('rpe', {}).get('per_frame', {}).get('translation_m', {}).get('max', nan),
      summary.get('path', {}).get('largest_step_m', nan), code)
PYTHON
  rm -rf "$out" "$out.partial"
}
name_of() { basename "${1#synth:}" | tr -c 'A-Za-z0-9\n' '_'; }

echo "| recording | tracked, least (%) | ATE median (m) | 95 % | most | step error, most (m) | off the live path, most (m) | not trusted |"
echo "|---|---|---|---|---|---|---|---|"
for recording in "$@"; do
  name=$(name_of "$recording")
  if [[ "$recording" == synth:* && ! -d "$work/$name" ]]; then # once on disk, for its truth and its speed
    options=()
    body=${recording#synth:}
    IFS='&' read -ra pairs <<<"${body#*\?}"
    for pair in "${pairs[@]}"; do options+=("--${pair%%=*}" "${pair#*=}"); done
    "$program" synth "${body%%\?*}" -o "$work/$name" "${options[@]}" --reference-spacing 0.5 -q
    # As the files of common cameras: they do not tell their shutter.
    [[ "$body" == *readout=* ]] && sed -i '/^readout/d' "$work/$name/robot0/camera.yaml"
    [ -d "$work/$name/robot0" ] && mv "$work/$name/robot0" "$work/$name.robot" && rm -rf "$work/$name" &&
      mv "$work/$name.robot" "$work/$name"
  fi
  input=$recording
  [[ "$recording" == synth:* ]] && input=$work/$name
  : >"$work/$name.rows"
  for ((i = 0; i < starts; i += 2)); do # two at a time, a thread each
    for j in $i $((i + 1)); do
      [ "$j" -lt "$starts" ] || continue
      one "$input" "$work/$name.$j" "$(python3 -c "print(f'{$j * $step:.4f}')")" >"$work/$name.row.$j" &
    done
    wait
    cat "$work/$name.row".* >>"$work/$name.rows" && rm "$work/$name.row".*
  done
  python3 - "$name" "$work/$name.rows" <<'PYTHON'
import math, sys
rows = [[float(v) for v in line.split()] for line in open(sys.argv[2])]
def column(i): return sorted(r[i] for r in rows if not math.isnan(r[i]))
def at(values, share): return '%.4f' % values[min(len(values) - 1, round(share * (len(values) - 1)))] if values else '-'
tracked, ate, step, live = (column(i) for i in range(4))
untrusted = sum(r[4] == 4 for r in rows)
failed = sum(r[4] not in (0, 4) for r in rows)
print(f"| {sys.argv[1]} | {tracked[0]:.1f} | {at(ate, .5)} | {at(ate, .95)} | {at(ate, 1)} | {at(step, 1)} | "
      f"{at(live, 1)} | {untrusted} of {len(rows)}{f', {failed} failed' if failed else ''} |")
PYTHON
done
