#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Two robots map a part of a room each and send their maps to a hub, all on this machine:
#   two_robots.sh PLUMBLINE FOLDER [DOMAIN]
# PLUMBLINE is the program; FOLDER, which must not exist yet, gets the recording and the results.
set -euo pipefail
plumbline=$(realpath "$1")
folder=$2
domain=${3:-0}
mkdir "$folder"
cd "$folder"

"$plumbline" synth room -o world --frames 50 --fps 10 --width 320 --height 240 -q
network="--interface lo --domain $domain"

"$plumbline" hub -o both --robots 2 $network -q --set merge.min_pairs=3 --set output.views= &
hub=$!
"$plumbline" robot world/robot0 --to 3 --name r0 $network -q &
robot=$!
"$plumbline" robot world/robot0 --from 1.5 --name r1 $network -q
wait $robot
wait $hub

# What came over the network is what the robots have.
"$plumbline" fuse r0 r1 -o again -q --set merge.min_pairs=3 --set output.views=
cmp both/map.ply again/map.ply
echo "the hub's map is that of plumbline fuse: $PWD/both/map.ply"
