#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How often doubts about a result are right: recordings, right ones and ones made wrong, and paths spoilt by hand.

usage: trust_worlds.py PROGRAM WORK [DATA]    DATA: a folder of recordings with groundtruth.txt; WORK keeps everything

The list of bases is frozen; even ones tune, odd ones test. Needs nothing but Python 3. Prints Markdown tables.
Environment: ONLY=tuning|test; WORLDS=N: the first ones; FIRST=N: from there on; AGAIN=1 checks the kept results again.
"""
import json, math, os, random, shutil, subprocess, sys

PROGRAM, WORK, DATA = (sys.argv[1:] + [None])[:3]
FRAMES, FPS = 200, 20
SCENES = ['home', 'office', 'corridor', 'building', 'room']
SENSORS = ['kinect', 'realsense', 'tof', 'structured', 'stereo', 'phone', 'ideal']
EVENTS = ['', 'cover@4+0.6', 'blur@3+0.7*6', '', 'drop@5+0.3', 'nodepth@4+0.5', '', 'lampoff@4+0.5', 'whiteout@3+0.4', '']
# Kinds of wrong input, taken in turn: how the recording is filmed, how its camera file is changed, how it is mapped.
KINDS = [('ray distance', '--depth-faults ray', {}, ''), ('fx 4 % held', '', {'fx': 1.04, 'fy': 1.04}, 'held'),
         ('dots', '--color-faults dots', {}, ''), ('depth 40 ms late, held', '--depth-delay 0.04', {}, 'held'),
         ('poses inverted', '', {}, 'inverted'), ('poses opengl', '', {}, 'opengl'),
         ('depth drifts', '--depth-faults drift=0.05', {}, ''), ('fx 15 %', '', {'fx': 1.15, 'fy': 1.15}, ''),
         ('depth x 10', '', {'depth_scale': 0.1}, ''), ('poses given, right', '', {}, 'given')]
CUTS = {'tum_fr1_rpy_a': 0, 'tum_fr1_rpy_b': 0, 'tum_fr3_structure_notexture_far_a': 0, 'icl_nuim_of_kt0_a': 1,
        '7scenes_redkitchen_a': 0, '7scenes_redkitchen_a@6.6': 1}
STARTS = [0, 0.2, 0.4, 0.6, 0.8]


def worlds():
    for i in range(int(os.environ.get('FIRST', 0)), int(os.environ.get('WORLDS', 42))):
        scene, sensor = SCENES[i % 5], SENSORS[i % 7]
        options = f'--seed {300 + i} --sensor {sensor} --fps {FPS} --frames {FRAMES} --width 320 --height 240'
        if scene != 'room': options += f' --layout {300 + i} --path {"wander" if i % 4 == 3 else "tour"}'
        if EVENTS[i % 10]: options += f' --events {EVENTS[i % 10]}'
        if i % 6 == 5: options += ' --readout 0.02'
        yield f'{i:02d}_{scene}_{sensor}', (i // 2 + i) % 2, f'{scene} {options}', KINDS[i % 10]


def run(*words):
    return subprocess.run([PROGRAM, *words, '-q', '--threads', '1'], capture_output=True, text=True)


def film(name, options):
    folder = f'{WORK}/{name}'
    if not os.path.exists(f'{folder}/done'):
        shutil.rmtree(folder, ignore_errors=True)
        made = run('synth', *options.split(), '-o', folder, '--reference-spacing', '50cm')
        if made.returncode: sys.exit(made.stderr)
        open(f'{folder}/done', 'w').close()
    return f'{folder}/robot0'


def poses(file):
    rows = [[float(x) for x in line.split()] for line in open(file) if line.strip() and line[0] != '#']
    return [row for row in rows if len(row) == 8]


def write(file, rows):
    with open(file, 'w') as out: out.writelines(' '.join(f'{x:.9f}' for x in row) + '\n' for row in rows)


def times(p, q):
    x, y, z, w = p
    a, b, c, d = q
    return [w*a + x*d + y*c - z*b, w*b - x*c + y*d + z*a, w*c + x*b - y*a + z*d, w*d - x*a - y*b - z*c]


def changed_poses(rows, how):
    for t, x, y, z, *q in rows:
        if how == 'inverted':
            q = [-q[0], -q[1], -q[2], q[3]]
            x, y, z, _ = (-v for v in times(times(q, [x, y, z, 0.0]), [-q[0], -q[1], -q[2], q[3]]))
        if how == 'opengl': q = times(q, [1.0, 0.0, 0.0, 0.0])
        yield [t, x, y, z, *q]


def map_of(name, recording, how='', options=()):
    """The result folder; the recording is mapped once."""
    out = f'{WORK}/{name}.map'
    if not os.path.exists(f'{out}.json'):
        words = ['map', recording, '-o', out, '--force', '--set', 'output.views=', '--set', 'output.pcd=off',
                 '--set', 'check.enabled=off', *options]
        if how == 'held': words += ['--set', 'track.camera.refine=off']
        if how not in ('inverted', 'opengl', 'given'):
            words += ['--set', 'store.enabled=off']
        else:
            write(f'{out}.given', changed_poses(poses(f'{recording}/groundtruth.txt'), how))
            words += ['-p', 'known_poses', '--set', f'poses.file={out}.given']
        done = run(*words)
        if done.returncode in (1, 2, 5): sys.exit(done.stderr)
        json.dump({'code': done.returncode, 'told': done.stderr[-500:]}, open(f'{out}.json', 'w'))
        for big in ('map.ply', 'map.db', 'lines.ply'):
            if os.path.exists(f'{out}/{big}'): os.remove(f'{out}/{big}')
    return out


def spoilt(rows, how, rng):
    """A path with one fault of about 2 to 8 cm, at a random place."""
    size = rng.choice([0.03, 0.06, 0.12])
    at = rng.uniform(0.25, 0.75) * len(rows)
    angle = rng.uniform(0, 2 * math.pi)
    for i, row in enumerate(rows):
        share = {'jump': i > at, 'drift': i / len(rows), 'bend': (2 * i / len(rows) - 1) ** 2,
                 'away and back': at <= i < at + 20, 'wave': math.sin(12 * i / len(rows))}[how]
        row = list(row)
        row[1] += size * share * math.cos(angle)
        row[2] += size * share * math.sin(angle)
        yield row


def ate(path, recording):
    """(RMS, length) in metres; None: there is no truth for it."""
    truth = next((f for f in (f'{recording}/groundtruth_sfm.txt', f'{recording}/groundtruth.txt') if os.path.exists(f)), recording)
    done = run('evaluate', 'trajectory', path, truth, '--json')
    if done.returncode: return None, None
    found = json.loads(done.stdout)
    return found['ate_m']['rmse'], found['path_m']


def check(name, path, recording, options=()):
    file = f'{WORK}/{name}.check'
    if os.environ.get('AGAIN') or not os.path.exists(file):
        done = run('check', path, recording, '--json', file, *options)
        if done.returncode not in (0, 4): json.dump({'trusted': True, 'reasons': [done.stderr[-300:]], 'expected_m': 0}, open(file, 'w'))
    return json.load(open(file))


def trials():
    """(base, test, kind, result, recording, spoilt) of all."""
    for name, test, options, (kind, filmed, camera, how) in worlds():
        if os.environ.get('ONLY', 'test' if test else 'tuning') != ('test' if test else 'tuning'): continue
        right = film(name, options)
        yield name, test, 'right', map_of(name, right), right
        wrong = film(f'{name}.wrong', f'{options} {filmed}') if filmed else right
        if camera:
            wrong = f'{WORK}/{name}.wrong'
            if not os.path.exists(wrong):
                os.makedirs(wrong)
                for entry in os.listdir(right): os.symlink(os.path.join(os.path.abspath(right), entry), f'{wrong}/{entry}')
                os.remove(f'{wrong}/camera.yaml')
                with open(f'{wrong}/camera.yaml', 'w') as out:
                    for line in open(f'{right}/camera.yaml'):
                        key, _, value = line.partition(':')
                        out.write(f'{key}: {float(value.split("#")[0]) * camera[key]}\n' if key in camera else line)
        yield name, test, kind, map_of(f'{name}.{kind.replace(" ", "_")}', wrong, how), wrong
    for cut, test in CUTS.items() if DATA else ():
        if os.environ.get('ONLY', 'test' if test else 'tuning') != ('test' if test else 'tuning'): continue
        folder, _, begin = cut.partition('@')
        for start in STARTS:
            first = float(begin or 0) + start
            span = ['--from', str(first)] + (['--to', '6.6'] if cut == '7scenes_redkitchen_a' else [])
            yield cut, test, 'right', map_of(f'{cut}@{start}', f'{DATA}/{folder}', '', span), f'{DATA}/{folder}'
        truth = f'{DATA}/{folder}'
        if not os.path.exists(f'{truth}/groundtruth_sfm.txt'):
            for how in ('given', 'inverted', 'opengl'):
                yield cut, test, 'poses ' + how, map_of(f'{cut}.{how}', truth, how), truth


def judged():
    for base, test, kind, result, recording in trials():
        told = json.load(open(f'{result}.json'))
        name = os.path.basename(result)
        if not os.path.exists(f'{result}/trajectory.txt'):
            yield base, test, kind, None, None, {'trusted': False, 'expected_m': 0, 'reasons': [told['told'][-200:]]}
            continue
        summary = json.load(open(f'{result}/summary.json'))
        error, length = ate(result, recording)
        checked = check(name, result, recording)
        if told['code'] == 4: checked['trusted'] = False
        checked['reasons'] = [summary['reason']] * bool(summary['reason']) + checked['reasons']
        checked['parts'] = any(sign in summary['reason'] for sign in ('no place with the first', 'have no pose', 'can be seen in'))
        yield base, test, kind, error, length, checked
        if kind != 'right' or told['code'] or name.rpartition('@')[2][:3] in ('0.2', '0.4', '0.6', '0.8'): continue
        rows, rng = poses(f'{result}/trajectory.txt'), random.Random(name)
        for how in ('jump', 'drift', 'bend', 'away and back', 'wave'):
            file = f'{WORK}/{name}.{how.replace(" ", "_")}.txt'
            if not os.path.exists(file): write(file, spoilt(rows, how, rng))
            error, length = ate(file, recording)
            yield base, test, how, error, length, check(f'{name}.{how.replace(" ", "_")}', file, recording, ['--camera', f'{result}/camera.yaml'])


def quantiles(values):
    values = sorted(values)
    return ', '.join(f'{values[min(len(values) - 1, int(q * len(values)))]:.2f}' for q in (0.1, 0.5, 0.9)) if values else '–'


def label(kind, error, length, checked):
    """Bad: ATE above 2 cm or 0.5 % of the path up to 10 cm; good: below half of that; given poses by their convention;
    parts: doubted because frames are lost or form a second map, which says nothing about accuracy."""
    if kind in ('poses inverted', 'poses opengl', 'depth x 10'): return 'bad'
    if kind in ('poses given, right', 'poses given'): return 'good'
    if error is None: return 'none'
    if checked.get('parts'): return 'parts'
    limit = min(0.10, max(0.02, 0.005 * (length or 0)))
    spoilt_by_hand = kind in ('jump', 'drift', 'bend', 'away and back', 'wave')  # never right
    return 'bad' if error > limit else 'good' if error < 0.5 * limit and not spoilt_by_hand else 'between'


def main():
    os.makedirs(WORK, exist_ok=True)
    table = [(*row, label(row[2], *row[3:6])) for row in judged()]
    with open(f'{WORK}/table.txt', 'w') as out:
        for base, test, kind, error, length, c, which in table:
            out.write(f"{'test' if test else 'tuning':6} {base:34} {kind:22} {which:7} ATE {1e3 * (error or 0):7.1f} E {1e3 * c['expected_m']:6.1f} "
                      f"told {1e3 * c.get('told_m', 0):5.1f} path {length or 0:5.1f} {'' if c['trusted'] else 'DOUBT'} {'; '.join(c['reasons'])[:160]}\n")
    print('| part | bases | bad | doubted | good | doubted | between | ATE / E: 10 %, 50 %, 90 % |\n|---|---|---|---|---|---|---|---|')
    for part, name in enumerate(('tuning', 'test')):
        rows = [r for r in table if r[1] == part]
        some = lambda which: [r for r in rows if r[6] == which]
        doubted = lambda which: sum(not r[5]['trusted'] for r in some(which))
        ratios = [r[3] / r[5]['expected_m'] for r in rows if r[3] and r[5]['expected_m'] > 0 and r[2] != 'depth x 10']
        print(f"| {name} | {len({r[0] for r in rows})} | {len(some('bad'))} | {doubted('bad')} | {len(some('good'))} | {doubted('good')} | "
              f"{len(some('between'))} | {quantiles(ratios)} |")
    print('\n| kind | part | bad | doubted | good | doubted |\n|---|---|---|---|---|---|')
    for kind, part in sorted({(r[2], r[1]) for r in table}):
        count = lambda which: [not r[5]['trusted'] for r in table if r[2] == kind and r[1] == part and r[6] == which]
        print(f"| {kind} | {'test' if part else 'tuning'} | {len(count('bad'))} | {sum(count('bad'))} | {len(count('good'))} | {sum(count('good'))} |")


if __name__ == '__main__': main()
