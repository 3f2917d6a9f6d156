#!/bin/bash
# SPDX-License-Identifier: BSD-3-Clause
# Kills a hub at moments spread over the time in which a robot sends its map, continues it with --resume, and compares
# the copy's rows with those of the robot.
#
#   kill_hub.sh PLUMBLINE FOLDER [KILLS=13] [DOMAIN=97]
#
# Exit code 1 when a hub is not continued, or the robot's map does not arrive whole.
set -u
program=$1 folder=$2
kills=${3:-13}
network=(--interface lo --domain "${4:-97}")
mkdir -p "$folder" && cd "$folder" || exit 2
[ -d world ] || "$program" synth room -o world --frames 60 --fps 10 --width 320 --height 240 --reference-spacing 10cm -q || exit 2

failed=0
for i in $(seq 1 "$kills"); do
  rm -rf hub hub.partial r0 r0.partial
  "$program" hub -o hub --robots 1 "${network[@]}" -q --set output.views= >hub.txt 2>&1 &
  hub=$!
  "$program" robot world/robot0 -o r0 --name r0 "${network[@]}" -q --threads 1 --pace 20 >robot.txt 2>&1 &
  robot=$!
  while [ ! -e hub.partial/network.db ] && kill -0 $hub 2>/dev/null; do sleep 0.02; done
  sleep "$(awk -v i="$i" -v n="$kills" 'BEGIN {printf "%.3f", 6 * (i - 1) / n}')"
  kill -9 $hub 2>/dev/null
  wait $hub 2>/dev/null
  left=$(ls -A hub.partial 2>/dev/null | tr '\n' ' ')

  timeout 120 "$program" hub -o hub --robots 1 --resume "${network[@]}" -q --set output.views= >hub.txt 2>&1
  code=$?
  wait $robot
  sent=$?
  state=good
  [ $code -eq 0 ] && [ $sent -eq 0 ] && [ -e hub/robots/r0/map.db ] || state="hub $code: $(tail -1 hub.txt), robot $sent: $(tail -1 robot.txt)"
  [ "$("$program" info hub/robots/r0/map.db 2>&1 | grep keyframes)" = "$("$program" info r0/map.db | grep keyframes)" ] || state="$state, not whole"
  [ "$state" = good ] || failed=1
  echo "kill $i | $left| $state"
done
exit $failed
