#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Until when is a world mapped, by one robot that drives all of a path, and by two that drive half of it each?
# The recording is played at 30 Hz; what is left to do after the last frame counts, and so does fusion.
#   two_robots_time.sh PLUMBLINE RECORDING WORK [SHARED_S] [MAP OPTION...]
# RECORDING: a folder in TUM layout; it is cut in the middle, both halves hold the SHARED_S seconds (0) around the
# cut: halves of a path of laps have enough in common without. WORK: a folder for the halves and the maps. Nothing is
# paced: recordings are mapped as fast as that goes, and a run counts as long as its frames take at 30 Hz, or as mapping
# took where that is longer, plus what its stages did after the last frame. Of the two robots that is the longer one's
# tracker and store, then all that plumbline fuse does from opening the maps on: what they do for pictures and clouds of
# their own is not needed. Programs are taken as started. Seconds mean something on an idle machine only. Maps that are
# in WORK already are taken as they are.
set -euo pipefail
[ $# -ge 3 ] || { sed -n '3,13s/^# //p' "$0" >&2; exit 2; }
plumbline=$1 recording=$(realpath "$2") work=$3 shared=${4:-0}
shift $(($# < 4 ? 3 : 4))
options=(-q --force --set output.views= --set output.pcd=off "$@")

cut() { # cut NAME FROM TO: seconds, absolute
  mkdir -p "$work/$1"
  ln -sfn "$recording/rgb" "$work/$1/rgb"
  ln -sfn "$recording/depth" "$work/$1/depth"
  cp "$recording/camera.yaml" "$work/$1/"
  for list in rgb.txt depth.txt associations.txt groundtruth.txt; do
    awk -v from="$2" -v to="$3" '/^#/ || ($1 >= from && $1 <= to)' "$recording/$list" >"$work/$1/$list"
  done
}

read -r first last < <(awk '!/^#/ {if (!n++) f = $1; l = $1} END {print f, l}' "$recording/rgb.txt")
cut a "$first" "$(echo "($first + $last + $shared) / 2" | bc -l)"
cut b "$(echo "($first + $last - $shared) / 2" | bc -l)" "$last"
map() { [ -f "$work/$2/summary.json" ] || "$plumbline" map "$1" -o "$work/$2" "${options[@]}"; }
map "$recording" one
map "$work/a" map_a
map "$work/b" map_b
"$plumbline" fuse "$work/map_a" "$work/map_b" -o "$work/two" "${options[@]}" || [ $? -eq 4 ]

python3 - "$work" "$recording" <<'PYTHON'
import json
import sys

work, recording = sys.argv[1:]


def load(name):
    return json.load(open(f"{work}/{name}/summary.json"))


def finish(summary, *stages):
    times = summary["timing"]["stages_ms"]
    return sum(times[stage]["finish"] for stage in times if not stages or stage in stages) / 1e3


EXPORTS = ("store", "keep", "output")  # they run side by side: their time is export_s


def before_exports(summary):
    stages = [stage for stage in summary["timing"]["stages_ms"] if stage not in EXPORTS]
    return finish(summary, *stages)


def driving(summary, folder):
    frames = sum(1 for line in open(f"{folder}/rgb.txt") if not line.startswith("#"))
    return max(frames / 30, summary["timing"]["map_s"] - before_exports(summary))


one, a, b, two = (load(name) for name in ("one", "map_a", "map_b", "two"))
print("| robots | driven s | until the map s | until the cloud s |")
print("|---|---|---|---|")
alone = driving(one, recording)
alone_map = alone + finish(one, "track", "refine")
alone_all = alone + before_exports(one) + one["timing"]["export_s"]
print(f"| 1 | {alone:.1f} | {alone_map:.1f} | {alone_all:.1f} |")
longer = max(driving(s, f"{work}/{f}") + finish(s, "track", "store") for s, f in ((a, "a"), (b, "b")))
both_all = longer + two["timing"]["wall_s"]
both_map = both_all - finish(two, "fuse") - two["timing"]["export_s"]
print(f"| 2 | {longer:.1f} | {both_map:.1f} | {both_all:.1f} |")
print(f"ratio: map {both_map / alone_map:.3f}, with the dense cloud {both_all / alone_all:.3f}")
print("merged" if all(merge["accepted"] for merge in two["merges"]) else "NOT MERGED")
PYTHON
