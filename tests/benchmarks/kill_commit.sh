#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# Kills plumbline map at each of its last steps on files (rename, unlink, rmdir), while it replaces an earlier result,
# and continues it. Needs strace.
#
#   kill_commit.sh PLUMBLINE RECORDING FOLDER [STEPS=20] [option of map...]
#
# Exit code 1 when a run is not continued, the file of a user is lost, or something is left over.
set -u
program=$1 recording=$2 folder=$3
steps=${4:-20}
[ $# -ge 4 ] && shift 4 || shift 3
calls=rename,renameat,renameat2,unlink,unlinkat,rmdir
map=("$program" map "$recording" -o out -q --threads 1 --set output.views= "$@")
mkdir -p "$folder" && cd "$folder" || exit 2

"${map[@]}" --force || exit 1
rm -rf earlier && cp -r out earlier
strace -f -qq -o trace.txt -e trace=$calls "${map[@]}" --force || exit 1
all=$(grep -c -E "^[0-9]+ +(rename|unlink|rmdir)" trace.txt)
failed=0
first=$((all > steps ? all - steps + 1 : 1))
for step in $(seq "$first" "$all"); do
  rm -rf out out.partial out.replaced && cp -r earlier out
  # A call that is told to fail with EIO and to kill does not take place: the moment before the step.
  strace -f -qq -o killed.txt -e trace=$calls -e inject=$calls:error=EIO:signal=KILL:when="$step" "${map[@]}" --force 2>err.txt
  left=$(ls -d out out.partial out.replaced 2>/dev/null | tr '\n' ' ')

  plain=$("${map[@]}" 2>&1); told=$?
  resumed=$("${map[@]}" --resume --force 2>&1); code=$?
  state=good
  [ $told -eq 2 ] && [[ $plain == *--force* && $plain != *"in the way"* ]] || state="a new run says: $plain"
  [ $code -eq 0 ] && [ -e out/summary.json ] && [ -e out/map.db ] || state="--resume: $code $resumed"
  [ -e out.partial ] || [ -e out.replaced ] && state="left: $(ls -d out.*)"
  [ "$(find out -name '.plumbline*' | wc -l)" -eq 0 ] || state="a marker is left"
  "$program" info out >/dev/null || state="info fails"
  [ "$state" = good ] || failed=1
  echo "$step of $all | $(grep -E "^[0-9]+ +(rename|unlink|rmdir)" killed.txt | tail -1 | cut -d' ' -f2- | cut -c1-110) | $left| $state"
done
exit $failed
