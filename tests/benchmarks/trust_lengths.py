#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How often the told 95 % of lengths hold: of 1000 random pairs of points that the cameras of a result have before them.

usage: trust_lengths.py PROGRAM RESULT RECORDING [RESULT RECORDING ...]    recordings with groundtruth.txt

Needs NumPy. Prints a Markdown table: share that holds, half widths, and 95 % of the true errors.
"""
import json, subprocess, sys, tempfile

import numpy as np

PAIRS, SEED = 1000, 62


def poses(file):
    """Stamps, positions, rotations."""
    rows = np.array([[float(x) for x in line.split()[:8]] for line in open(file) if line.strip() and line[0] != '#'])
    x, y, z, w = rows[:, 4:].T
    turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return rows[:, 0], rows[:, 1:4], np.moveaxis(np.array(turn), 2, 0)


def lengths(program, result, recording):
    """Errors and told half widths of random lengths, and the error to expect, metres."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run([*program.split(), 'check', result, recording, '--samples', f'{folder}/s.npy', '--json', f'{folder}/c.json', '-q',
                               '--threads', '1'], capture_output=True, text=True)
        if done.returncode not in (0, 4): sys.exit(done.stderr)
        motion = np.load(f'{folder}/s.npy')['motion'].astype(float)
        told = json.load(open(f'{folder}/c.json'))

    # Poses with truth, and points that they see.
    stamps, place, turn = poses(f'{result}/trajectory.txt')
    true_stamps, true_place, true_turn = poses(f'{recording}/groundtruth.txt')
    near = np.abs(true_stamps[:, None] - stamps[None]).argmin(axis=0)
    known = np.flatnonzero(np.abs(true_stamps[near] - stamps) < 1e-3)
    rng = np.random.default_rng(SEED)
    at = rng.choice(known, (2, PAIRS))
    z = told['distance_m'] * rng.uniform(0.6, 1.4, (2, PAIRS))
    points = np.stack([rng.uniform(-0.5, 0.5, z.shape) * z, rng.uniform(-0.4, 0.4, z.shape) * z, z], axis=-1)

    moved = points[:, :, None] + motion[at][..., :3] + np.cross(motion[at][..., 3:], points[:, :, None])
    distance = lambda p: np.linalg.norm(p[0] - p[1], axis=-1)
    of = lambda turn, place, local: np.einsum('anij,an...j->an...i', turn, local) + place.reshape(*local.shape[:2], *[1] * (local.ndim - 3), 3)
    measured = distance(of(turn[at], place[at], points))
    drawn = distance(of(turn[at], place[at], moved))
    true = distance(of(true_turn[near[at]], true_place[near[at]], points))
    return np.abs(measured - true), 2.04 * np.sqrt(np.mean((drawn - measured[:, None]) ** 2, axis=1)), told


def main():
    print('| result | path m | revisits | E mm | holds % | half width, median mm | 95 % of the errors mm | ratio |\n|---|---|---|---|---|---|---|---|')
    every, shares = [], []
    for result, recording in zip(sys.argv[2::2], sys.argv[3::2]):
        error, within, told = lengths(sys.argv[1], result, recording)
        shares.append(100 * np.mean(error < within))
        every.append(error / within)
        worst = np.quantile(error, 0.95)
        print(f"| {result.split('/')[-1]} | {told['path_m']:.0f} | {told['revisits']} | {1e3 * told['expected_m']:.1f} | {shares[-1]:.1f} | {1e3 * np.median(within):.1f} | {1e3 * worst:.1f} | {np.median(within) / worst:.2f} |", flush=True)
    print(f'\n{len(shares)} results: {np.mean(shares):.1f} % hold; widths would have to be times {np.quantile(np.concatenate(every), 0.95):.2f}')


if __name__ == '__main__': main()
