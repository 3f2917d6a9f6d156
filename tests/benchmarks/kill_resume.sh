#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Kills runs of plumbline map at moments spread over the whole run, goes on with --resume, and prints what is left
# and what comes out beside an uninterrupted run. Moments are shares of the CPU time that a whole run takes, so that
# they do not depend on how busy the machine is.
#
#   kill_resume.sh PLUMBLINE RECORDING TRUTH.txt REFERENCE.ply FOLDER [KILLS=20] [option of map...]
#
# Exit code 1 when anything that was committed is lost, a store does not open, or a run does not go on.
set -u
program=$1 recording=$2 truth=$3 reference=$4 folder=$5
kills=${6:-20}
[ $# -ge 6 ] && shift 6 || shift 5
mkdir -p "$folder"
hertz=$(getconf CLK_TCK)
failed=0

# CPU time of a process so far, in clock ticks; nothing when it is gone.
ticks() { sed 's/.*) //' "/proc/$1/stat" 2>/dev/null | awk '{print $12 + $13}'; }
number() { python3 -c "import json,sys; d=json.load(open('$1')); print($2)"; }
# A result that is not trustworthy (exit code 4) is one: frames in which nothing can be seen have no pose.
map() { "$program" map "$recording" -q --force "$@" || [ $? -eq 4 ]; }

# ATE in metres and F-score at 2 cm of a result folder.
judge() {
  "$program" evaluate trajectory "$1" "$truth" --json >"$folder/ate.json" || failed=1
  "$program" evaluate cloud "$1" "$reference" --align se3 --trajectory "$1/trajectory.txt" --truth "$truth" \
    --json >"$folder/cloud.json" || failed=1
  ate=$(number "$folder/ate.json" "'%.4f' % d['ate_m']['rmse']")
  fscore=$(number "$folder/cloud.json" "$fscore_key")
}
fscore_key="'%.4f' % d['at']['20mm']['f']"

echo "| moment | frames, keyframes stored | ATE (m) | F-score at 2 cm | points |"
echo "|---|---|---|---|---|"
rm -rf "$folder/whole" "$folder/whole.partial"
before=$(cut -d' ' -f16,17 /proc/$$/stat | awk '{print $1 + $2}')
map -o "$folder/whole" "$@" || exit 1
total=$(cut -d' ' -f16,17 /proc/$$/stat | awk -v b="$before" '{print $1 + $2 - b}')
judge "$folder/whole"
whole=$ate:$fscore
echo "| not killed, $(awk "BEGIN {print $total / $hertz}") s of CPU | | $ate | $fscore | $(number "$folder/whole/summary.json" "d['cloud']['points']") |"

i=0
while [ $i -lt "$kills" ]; do
  share=$(awk -v i=$i -v n="$kills" 'BEGIN {printf "%.3f", (i + 0.5) / n}')
  out=$folder/out
  rm -rf "$out" "$out.partial"
  "$program" map "$recording" -q -o "$out" "$@" &  # no function: that would be a shell with a child of its own
  pid=$!
  while now=$(ticks $pid) && [ -n "$now" ] && awk "BEGIN {exit !($now < $share * $total)}"; do sleep 0.02; done
  kill -9 $pid 2>/dev/null
  wait $pid 2>/dev/null
  left="not killed in time"
  if [ ! -d "$out" ]; then
    left="nothing"
    if "$program" info "$out" >"$folder/info.txt" 2>"$folder/info.err"; then
      left="$(sed -n 's/^store.frames: //p' "$folder/info.txt"), $(sed -n 's/^store.keyframes: //p' "$folder/info.txt")"
      # The store of a killed run is a map as any other.
      "$program" export "$out" --what keyframes -o "$folder/keyframes.txt" || failed=1
    elif ! grep -q "ended before it began\|no such" "$folder/info.err"; then
      cat "$folder/info.err"
      failed=1
    fi
    map --resume -o "$out" "$@" 2>"$folder/resume.err" || { cat "$folder/resume.err"; failed=1; }
  fi
  judge "$out"
  echo "| $share | $left | $ate | $fscore | $(number "$out/summary.json" "d['cloud']['points']") |"
  i=$((i + 1))
done
echo "uninterrupted $whole; failures: $failed"
exit $failed
