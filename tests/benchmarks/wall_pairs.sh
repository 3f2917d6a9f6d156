#!/usr/bin/env bash
# SPDX-License-Identifier: BSD-3-Clause
# Wall time of the whole command `plumbline map`, two programs in turn on the same machine, which should be quiet.
#   wall_pairs.sh OLD NEW RECORDING...
# One line of a table for each recording, by default and with track.camera.refine=off: medians of PAIRS pairs (5) of
# seconds and of their ratio, with the least and the largest ratio; and what NEW needs by default over what it needs
# with the camera as its file says.
set -euo pipefail
[ $# -ge 3 ] || { sed -n '3,8s/^# \{0,1\}//p' "$0" >&2; exit 2; }
python3 - "$@" <<'PYTHON'
import os, statistics, subprocess, sys, tempfile, time
old, new, *recordings = sys.argv[1:]
pairs = int(os.environ.get('PAIRS', '5'))
work = tempfile.mkdtemp()

def seconds(program, recording, options):
    command = [program, 'map', recording, '-o', work + '/out', '-q', '--force', *options]
    began = time.monotonic()
    code = subprocess.run(command, stderr=subprocess.DEVNULL).returncode
    if code not in (0, 4): sys.exit(f'{" ".join(command)}: exit {code}')
    return time.monotonic() - began

print('| recording | camera | old (s) | new (s) | new / old | least, largest | new, default / off |')
print('|---|---|---|---|---|---|---|')
for recording in recordings:
    medians = {}
    for name, options in (('off', ['--set', 'track.camera.refine=off']), ('default', [])):
        times = [(seconds(old, recording, options), seconds(new, recording, options)) for _ in range(pairs)]
        ratios = sorted(n / o for o, n in times)
        medians[name] = statistics.median(n for _, n in times)
        both = f'{medians[name] / medians["off"]:.2f}' if name == 'default' else ''
        print(f'| {os.path.basename(recording)} | {name} | {statistics.median(o for o, _ in times):.1f} | '
              f'{medians[name]:.1f} | {statistics.median(ratios):.2f} | {ratios[0]:.2f}, {ratios[-1]:.2f} | {both} |', flush=True)
PYTHON
