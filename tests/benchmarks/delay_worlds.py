#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Depth images that come late or early: generated offices, mapped with the delay told in the camera's file and not told.

usage: delay_worlds.py PROGRAM FOLDER [--first 1] [--seeds 30] [--delays -0.025 -0.015 0.015 0.025] [--frames 300]

Needs NumPy. Prints a Markdown table, a row for each world: ATE in mm, the share of frames tracked, and by how much the
longest step between two frames exceeds the true one, in mm; then the shares that stay within 3 and 6 mm.
"""
import argparse
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np


def places(file):
    rows = np.loadtxt(file, ndmin=2)
    return dict(zip(np.round(rows[:, 0], 6), rows[:, 1:4]))


def excess_of_steps(result, recording):
    """By how much a step of the path is longer than the true one, at most, in mm."""
    found, true = places(result / "trajectory.txt"), places(recording / "groundtruth.txt")
    stamps = [stamp for stamp in sorted(found) if stamp in true]
    step = [np.linalg.norm(np.diff([path[stamp] for stamp in stamps], axis=0), axis=1) for path in (found, true)]
    return 1e3 * float(np.max(step[0] - step[1]))


def mapped(program, recording, camera, out):
    """ATE in mm, percent tracked, excess of steps in mm."""
    done = subprocess.run([program, "map", recording, "-o", out, "--camera", camera, "-q", "--force", "--threads", "1",
                           "--set", "output.views=", "--set", "output.pcd=off", "--set", "output.ply=off", "--set",
                           "fuse.voxel=20mm"], capture_output=True, text=True)
    if done.returncode not in (0, 4):
        raise SystemExit(done.stderr)
    judged = subprocess.run([program, "evaluate", "trajectory", out, recording, "--json"], capture_output=True, text=True, check=True)
    tracked = json.loads((out / "summary.json").read_text())["frames"]["tracked_percent"]
    return 1e3 * json.loads(judged.stdout)["ate_m"]["rmse"], tracked, excess_of_steps(out, recording)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--delays", type=float, nargs="+", default=[-0.025, -0.015, 0.015, 0.025])
    parser.add_argument("--frames", type=int, default=300)
    options = parser.parse_args()

    rows = {"told": [], "not told": []}
    print("| seed | delay (ms) | told: ATE, tracked, step | not told |\n|---|---|---|---|", flush=True)
    for seed in range(options.first, options.first + options.seeds):
        for delay in options.delays:
            # The world, and its camera file without the delay
            world = options.folder / f"office.{seed}.{delay}"
            subprocess.run([options.program, "synth", "office", "-o", world, "--frames", str(options.frames), "--seed", str(seed), "--depth-delay",
                            str(delay), "--reference-spacing", "0.5", "-q", "--threads", "1"], check=True)
            recording = world / "robot0"
            told, silent = recording / "camera.yaml", world / "silent.yaml"
            silent.write_text(re.sub(r"(?m)^depth_delay.*\n", "", told.read_text()))

            for name, camera in (("told", told), ("not told", silent)):
                rows[name].append(mapped(options.program, recording, camera, world / "out"))
            cells = ["{:.1f} ({:.0f} %), {:.1f}".format(*rows[name][-1]) for name in rows]
            print(f"| {seed} | {1e3 * delay:.0f} | {' | '.join(cells)} |", flush=True)
            shutil.rmtree(world)

    print()
    for name, values in rows.items():
        ate, tracked, step = np.array(values).T
        print(f"{name}: {len(ate)} runs, median {np.median(ate):.1f} mm, worst {ate.max():.1f}; within 3 mm {np.mean(ate <= 3):.0%}, within 6 mm "
              f"{np.mean(ate <= 6):.0%}; longest step {step.max():.1f} mm beyond the true one; least tracked {tracked.min():.0f} %")


if __name__ == "__main__":
    main()
