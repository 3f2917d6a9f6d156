#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Hashes of what a program makes of the same inputs: a change that is to change no result leaves them as they are.
#   result_hashes.sh PROGRAM small|all > hashes.txt      small: some minutes
# Generated worlds are hashed as they are. Each input is mapped with one thread, and with two under a perturbed heap; where the two differ, a line says so and
# the exit code is 1. map.db is hashed by table, without the rows that hold the configuration and the version.
# Recordings are taken from PLUMBLINE_DATA; those that are not there are left out.
set -euo pipefail
[ $# -eq 2 ] || { sed -n '3,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
program=$1 size=$2
data="${PLUMBLINE_DATA:-}"
work="$(mktemp -d)"
trap 'rm -rf "$work"' EXIT
lean=(-q --force --set output.views=)
different=0

hashes() { # FOLDER
  python3 - "$1" <<'PYTHON'
import hashlib, pathlib, sqlite3, sys
folder = pathlib.Path(sys.argv[1])
names = ['map.ply', 'map.pcd', 'lines.ply', 'trajectory.txt', 'keyframes.txt', 'keyframes.csv', 'frames.csv']
for file in sorted(p for p in folder.rglob('*') if p.name in names):
    print(f'  {file.relative_to(folder)} {hashlib.sha256(file.read_bytes()).hexdigest()[:16]}')
if (folder / 'map.db').exists():
    db = sqlite3.connect(folder / 'map.db')
    for (table,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table' ORDER BY name").fetchall():
        skipped = " WHERE key NOT IN ('configuration', 'program', 'run')" if table == 'header' else ''
        digest = hashlib.sha256()
        for row in db.execute(f'SELECT * FROM {table}{skipped} ORDER BY 1, 2'): digest.update(repr(row).encode())
        print(f'  map.db {table} {digest.hexdigest()[:16]}')
PYTHON
}

check() { # NAME COMMAND ARGUMENTS...: of plumbline, which writes to -o
  local name=$1
  shift
  "$program" "$@" -o "$work/one" --threads 1 "${lean[@]}" 2>/dev/null || [ $? -eq 4 ]
  MALLOC_PERTURB_=165 MALLOC_ARENA_MAX=1 GLIBC_TUNABLES=glibc.malloc.tcache_count=0 \
    "$program" "$@" -o "$work/two" --threads 2 "${lean[@]}" 2>/dev/null || [ $? -eq 4 ]
  echo "$name"
  hashes "$work/one" | tee "$work/one.txt"
  hashes "$work/two" >"$work/two.txt"
  cmp -s "$work/one.txt" "$work/two.txt" && return
  echo "  DIFFERENT with two threads:"
  diff "$work/one.txt" "$work/two.txt" | sed 's/^/    /' || true
  different=1
}
recording() { # NAME
  if [ -d "$data/$1" ]; then check "$1" map "$data/$1" "${@:2}"; fi
}

world() { # SCENE OPTIONS...: pictures and points of a generated world
  "$program" synth "$1" -o "$work/world" --width 320 --height 240 --reference-spacing 0.1 -q "${@:2}"
  echo "world $* $(cd "$work/world" && find . -type f ! -name "*.yaml" -print0 | LC_ALL=C sort -z | xargs -0 sha256sum |
    sha256sum | cut -c1-16)"
  rm -r "$work/world"
}
hub() { # ROBOT0 ROBOT1: recordings; each robot maps one and sends it to a hub on this machine
  local network=(--interface lo --domain $((1 + $$ % 200)))
  "$program" hub -o "$work/hub" --robots 2 "${network[@]}" --threads 1 "${lean[@]}" 2>/dev/null &
  local pid=$!
  for robot in 0 1; do
    "$program" robot "${@:robot+1:1}" -o "$work/sent$robot" --name "r$robot" -q --force "${network[@]}" 2>/dev/null &
  done
  wait "$pid" || [ $? -eq 4 ]
  wait
  echo "hub with two robots"
  hashes "$work/hub"
}

for scene in corridor office plane room structure; do world $scene --frames 4; done
world room --walkers 2 --frames 6 --fps 1 --seed 2
world corridor --frames 4 --texture weak --seed 3
world room --frames 4 --sensor realsense --robots 2 --seed 4
world structure --frames 4 --texture none --sensor ideal
recording icl_nuim_of_kt0_a
recording tum_fr3_structure_notexture_far_a
"$program" synth office -o "$work/office" --robots 2 --frames $([ "$size" = all ] && echo 300 || echo 60) --seed 2 \
  --reference-spacing 0.5 -q
if [ "$size" = small ]; then # in 60 frames the two never meet: the second goes the first one's way, 20 frames behind
  rm -r "$work/office/robot1"
  cp -r "$work/office/robot0" "$work/office/robot1"
  for list in rgb depth associations; do
    grep -v "^#" "$work/office/robot0/$list.txt" | tail -n +21 >"$work/office/robot1/$list.txt"
  done
fi
check "office, two robots" map "$work/office/robot0" "$work/office/robot1"
hub "$work/office/robot0" "$work/office/robot1"
if [ "$size" = all ]; then
  recording 7scenes_redkitchen_a
  recording tum_fr1_rpy_a
  recording tum_fr1_rpy_b
  recording 7scenes_redkitchen_a -p depth_only
  recording 7scenes_redkitchen_a -p known_poses
  check "room with a loop" map "synth:room?frames=300&seed=1"
  for robot in 0 1; do "$program" map "$work/office/robot$robot" -o "$work/map$robot" -p robot -q --force; done
  check "office, two maps" fuse "$work/map0" "$work/map1"
fi
exit $different
