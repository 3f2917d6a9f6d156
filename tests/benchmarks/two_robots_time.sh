#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Until when is a world mapped, by one robot that drives all of a path, and by two that drive half of it each?
#   two_robots_time.sh [--estimate] PLUMBLINE RECORDING WORK [SHARED_S] [MAP OPTION...]
# RECORDING: a folder in TUM layout; it is cut in the middle, both halves hold the SHARED_S seconds (0) around the
# cut: halves of a path of laps have enough in common without. WORK: a folder for the halves and the maps. All are
# played at 30 Hz, and what counts is the clock from the start of a program to its end:
#   1          plumbline map of the whole
#   2, fuse    the longer one of the halves (plumbline map -p robot, each with the machine to itself), then
#              plumbline fuse
#   2, map     plumbline map of both halves at a time: robots and fusion in one process
# Until the map: without the merged cloud and what is written at the end. With --estimate recordings are mapped as
# fast as that goes, and a run counts as long as its frames take at 30 Hz, or as mapping took where that is longer,
# plus what its stages did after the last frame; the third line is left out. Seconds mean something on an idle
# machine only. Maps that are in WORK already are taken as they are. PIPELINE=NAME maps with that one, recordings of one
# robot and of several alike.
set -euo pipefail
estimate=
[ "${1:-}" = --estimate ] && { estimate=1; shift; }
[ $# -ge 3 ] || { sed -n '3,19s/^# //p' "$0" >&2; exit 2; }
plumbline=$1 recording=$(realpath "$2") work=$3 shared=${4:-0}
shift $(($# < 4 ? 3 : 4))
options=(-q --force --set output.views= --set output.pcd=off "$@")
pace=(--pace 30)
[ -z "$estimate" ] || pace=()

cut() { # cut NAME FROM TO: seconds, absolute
  mkdir -p "$work/$1"
  ln -sfn "$recording/rgb" "$work/$1/rgb"
  ln -sfn "$recording/depth" "$work/$1/depth"
  cp "$recording/camera.yaml" "$work/$1/"
  for list in rgb.txt depth.txt associations.txt groundtruth.txt; do
    awk -v from="$2" -v to="$3" '/^#/ || ($1 >= from && $1 <= to)' "$recording/$list" >"$work/$1/$list"
  done
}

run() { # run NAME COMMAND...: its seconds in WORK/NAME.s; exit code 4 is a result, too
  local name=$1 start
  shift
  [ ! -f "$work/$name/summary.json" ] || return 0
  start=$(date +%s.%N)
  "$plumbline" "$@" -o "$work/$name" "${options[@]}" || [ $? -eq 4 ]
  echo "$(date +%s.%N) - $start" | bc -l >"$work/$name.s"
}

read -r first last < <(awk '!/^#/ {if (!n++) f = $1; l = $1} END {print f, l}' "$recording/rgb.txt")
cut a "$first" "$(echo "($first + $last + $shared) / 2" | bc -l)"
cut b "$(echo "($first + $last - $shared) / 2" | bc -l)" "$last"
whole=(${PIPELINE:+-p "$PIPELINE"})
run one map "$recording" "${whole[@]}" "${pace[@]}"
# Pictures and tables are no part of the pipeline `robot`.
views=("${options[@]}")
options=(-q --force "$@")
run map_a map "$work/a" -p "${PIPELINE:-robot}" "${pace[@]}"
run map_b map "$work/b" -p "${PIPELINE:-robot}" "${pace[@]}"
options=("${views[@]}")
run two fuse "$work/map_a" "$work/map_b"
[ -n "$estimate" ] || run both map "$work/a" "$work/b" "${whole[@]}" "${pace[@]}"

python3 - "$work" "$recording" "$estimate" <<'PYTHON'
import json
import sys

work, recording, estimate = sys.argv[1:]


def load(name):
    return json.load(open(f"{work}/{name}/summary.json"))


def clock(name):
    return float(open(f"{work}/{name}.s").read())


def finish(summary, *stages):
    times = summary["timing"]["stages_ms"]
    return sum(times[stage]["finish"] for stage in times if not stages or stage in stages) / 1e3


EXPORTS = ("store", "keep", "output")  # they run side by side: their time is export_s


def after_the_map(summary):
    return finish(summary, "fuse") + summary["timing"]["export_s"]


def driving(summary, folder):
    frames = sum(1 for line in open(f"{folder}/rgb.txt") if not line.startswith("#"))
    ends = finish(summary, *(s for s in summary["timing"]["stages_ms"] if s not in EXPORTS))
    return max(frames / 30, summary["timing"]["map_s"] - ends)


one, a, b, two = (load(name) for name in ("one", "map_a", "map_b", "two"))
rows = []
if estimate:
    driven = driving(one, recording)
    whole = driven + finish(one, "track", "refine", "fuse") + one["timing"]["export_s"]
    rows.append(("1", driven, whole - after_the_map(one), whole))
    driven = max(driving(s, f"{work}/{f}") + finish(s, "track", "store") for s, f in ((a, "a"), (b, "b")))
    whole = driven + two["timing"]["wall_s"]
    rows.append(("2, fuse", driven, whole - after_the_map(two), whole))
else:
    rows.append(("1", clock("one") - finish(one) + finish(one, *EXPORTS) - one["timing"]["export_s"],
                 clock("one") - after_the_map(one), clock("one")))
    driven = max(clock("map_a"), clock("map_b"))
    whole = driven + clock("two")
    rows.append(("2, fuse", driven, whole - after_the_map(two), whole))
    both = load("both")
    rows.append(("2, map", clock("both") - finish(both) + finish(both, *EXPORTS) - both["timing"]["export_s"],
                 clock("both") - after_the_map(both), clock("both")))
    behind = {name: load(name)["timing"]["behind_s"] for name in ("one", "map_a", "map_b", "both")}
    print("behind the pace at most, s:", ", ".join(f"{name} {s:.2f}" for name, s in behind.items()))
print("| robots | driven s | until the map s | ratio | until the cloud s | ratio |")
print("|---|---|---|---|---|---|")
for name, driven, until_map, until_cloud in rows:
    print(f"| {name} | {driven:.1f} | {until_map:.1f} | {until_map / rows[0][2]:.3f} "
          f"| {until_cloud:.1f} | {until_cloud / rows[0][3]:.3f} |")
merges = two["merges"] + ([] if estimate else both["merges"])
print("merged" if all(merge["accepted"] for merge in merges) else "NOT MERGED")
PYTHON
