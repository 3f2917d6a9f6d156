#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What families of measurements are worth, and what our deviations from the paper are worth.

  method_table.py PROGRAM families|deviations INPUT...

INPUT: a recording's folder with truth, or synth:SCENE?...; each is mapped from STARTS moments (5; environment), STEP_S
(0.1) seconds apart, in JOBS (2) runs at a time, once for each variant. A table of ATE in mm, medians of the starts, and
of the least share of frames tracked where that is not 100 %. ONLY=NAME[,NAME] leaves other variants out; runs that are in
WORK already are taken as they are.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys

OFF = {
    'points': 'features.points=off',
    'lines': 'features.lines=off',
    'depth': 'track.depth=off track.edges=off track.verify.align=off refine.icp=off refine.adjust.surface_weight=0',
    'grey values': 'features.photometric=off track.edges.photometric=off',
}
CONES = 'track.keyframe.rule=cone track.keyframe.urgent=nearly_lost'
TABLES = {
    'families': {
        'points': '-p points_only',
        'points + lines': '-p points_lines',
        '+ depth': OFF['grey values'],
        '+ grey values (all)': '',
        **{f'all but {family}': OFF[family] for family in ('points', 'lines', 'depth')},
    },
    'deviations': {
        'ours': '',
        'exact number of false alarms': 'features.line.exact_nfa=on',
        'LSD at full scale': 'features.line.scale=full',
        'strongest points': 'features.orb.spread=off',
        'border by either end': 'features.line.border_either=on',
        'lengths of matched lines': 'track.match.min_line_ratio=0.5',
        'matching to the last keyframe': 'track.local.keyframes=1',
        'PnP at every frame': 'track.pnp_start=on',
        '30 % by keyframes': 'track.landmark.by_keyframes=on track.landmark.min_visible=3',
        'three keyframes': 'track.landmark.min_keyframes=3',
        'no depth rows': 'track.solver.depth_rows=off track.bundle.depth_rows=off refine.adjust.depth_rows=off',
        'cones, not scaled': CONES,
        **{f'cones, {balance}': f'{CONES} track.keyframe.cone_scaled=on track.keyframe.cone_balance={balance}'
           for balance in ('above', 'below', 'off')},
        'votes of the index': 'track.places.votes=on',
        'absolute eta': 'track.places.min_score=0 track.places.min_absolute=0.05',
        'pair: R, t and structure': 'track.verify.joint=on',
    },
}
LEAN = ['-q', '--force', '--threads', '1', '--set', 'output.views=', '--set', 'output.pcd=off', '--set',
        'refine.accuracy=off', '--set', 'fuse.free_space=off', '--set', 'fuse.exposure=off', '--set',
        'track.camera.refine=off']


def word(text):
    return re.sub(r'[^a-z0-9]+', '_', text.lower()).strip('_')


def options_of(variant):
    words = variant.split()
    if words[:1] == ['-p']:
        return words
    return [part for pair in words for part in ('--set', pair)]


def film(program, url, work):
    """Once on disk, for its truth."""
    scene, _, values = url[len('synth:'):].partition('?')
    folder = work / word(url)
    if not (folder / 'robot0/groundtruth.txt').exists():
        options = [part for pair in values.split('&') for part in ('--' + pair.split('=')[0], pair.split('=')[1])]
        subprocess.run([program, 'synth', scene, '-o', folder, *options, '--reference-spacing', '0.5', '-q'], check=True)
    return folder / 'robot0'


def measure(program, recording, start, variant, out):
    """ATE in mm (None: none) and the share of frames tracked."""
    kept = out.with_name(out.name + '.json')
    if not kept.exists():
        subprocess.run([program, 'map', recording, '-o', out, '--from', str(start), *LEAN, *options_of(variant)],
                       stderr=subprocess.DEVNULL, check=False)
        found = subprocess.run([program, 'evaluate', 'trajectory', out, recording, '--json'], stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, text=True, check=False).stdout
        summary = out / 'summary.json'
        tracked = json.loads(summary.read_text())['frames']['tracked_percent'] if summary.exists() else 0.0
        kept.write_text(json.dumps([1e3 * json.loads(found)['ate_m']['rmse'] if found else None, tracked]))
        subprocess.run(['rm', '-rf', out, f'{out}.partial'], check=True)
    return json.loads(kept.read_text())


def cell(runs):
    errors = [error for error, _ in runs if error is not None]
    tracked = min(share for _, share in runs)
    text = f'{statistics.median(errors):.1f}' if errors else '–'
    return text if tracked >= 100 else f'{text} ({tracked:.0f} %)'


def main():
    if len(sys.argv) < 4 or sys.argv[2] not in TABLES:
        sys.exit(__doc__)
    program, table, inputs = sys.argv[1], TABLES[sys.argv[2]], sys.argv[3:]
    only = [name for name in os.environ.get('ONLY', '').split(',') if name]
    table = {name: variant for name, variant in table.items() if not only or name in only}
    work = pathlib.Path(os.environ.get('WORK', '/tmp/method_table'))
    work.mkdir(parents=True, exist_ok=True)
    starts = [i * float(os.environ.get('STEP_S', '0.1')) for i in range(int(os.environ.get('STARTS', '5')))]
    recordings = {i: film(program, i, work) if i.startswith('synth:') else pathlib.Path(i) for i in inputs}
    jobs = [(name, i, start) for name in table for i in inputs for start in starts]

    def one(job):
        name, i, start = job
        return measure(program, recordings[i], start, table[name], work / f'{word(name)}-{word(i)}-{start:.1f}')

    with concurrent.futures.ThreadPoolExecutor(int(os.environ.get('JOBS', '2'))) as pool:
        results = dict(zip(jobs, pool.map(one, jobs)))
    names = [i.rstrip('/').rsplit('/', 1)[-1] for i in inputs]
    print('| | ' + ' | '.join(names) + ' |')
    print('|---' * (len(names) + 1) + '|')
    for name in table:
        cells = [cell([results[name, i, start] for start in starts]) for i in inputs]
        print(f'| {name} | ' + ' | '.join(cells) + ' |')


if __name__ == '__main__':
    main()
