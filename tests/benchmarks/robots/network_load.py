#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What the network costs a robot, and what robots cost the hub: network_load.py PROGRAM FLOOD_WORDS RECORDING WORK

RECORDING: a folder in TUM layout with 400 frames. First its even pairs of 0-239 are mapped at --pace 10 in turns, ROUNDS
times: without a network, with a hub that is not there, behind 2 Mbit/s with 5 % loss, and beside one that speaks without
a pause (which takes a core: so does the busy process that stands beside it). A frame's time in tracking (features,
tracker) is the least of the rounds, as other work disturbs some. Printed is the median over frames, that of the ratio
to the same frame's without a network, and the least CPU time of the robot's process. Then eight maps (100 frames each, one after another 42 later) are handed in
at once: until everything is at the hub, lags, and the hub's memory before it fuses.
"""
import csv
import json
import os
import shutil
import statistics
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from network_kitchen import ENDS, FUSE, Network, Relay, Watch, part_of, run  # noqa: E402

ROUNDS = 4
MODES = ["no network", "no hub", "slow", "no network, a busy process beside", "flood"]


def frame_times(folder):
    with open(folder / "timing.csv") as table:
        return [float(row["features_ms"]) + float(row["track_ms"]) for row in csv.DictReader(table)]


def cpu_of(process):
    """Seconds of a process that ends by itself."""
    _, _, usage = os.wait4(process.pid, 0)
    return usage.ru_utime + usage.ru_stime


def drive(program, flood, recording, work, mode):
    """Times of the frames, and CPU seconds of the robot."""
    out = work / "a"
    shutil.rmtree(out, ignore_errors=True)
    beside = []
    with Network() as network, open(work / "log", "w") as log:
        command = [program, "map", recording, "-p", "robot"]
        if not mode.startswith("no network"):
            command = [program, "robot", recording, "--name", "a", "--wait", "0", "--wait-lost", "0", "--interface", "net0",
                       "--peers", ENDS["h"]]
        if mode == "slow":
            relay = Relay({end: network.tun(end) for end in ENDS}, 0.05, 2e6)
            relay.start()
            shutil.rmtree(work / "hub.partial", ignore_errors=True)
            beside.append([program, "hub", "-o", work / "hub", "--force", "--interface", "net0", *FUSE])
        else:
            network.cables()
        if "busy" in mode:
            beside.append(["sh", "-c", "while :; do :; done"])
        if mode == "flood":
            beside.append([flood, "net0", "a", "100"])
        beside = [network.run("h", words, log, []) for words in beside]
        cpu = cpu_of(network.run("a", [*command, "-o", out, "--pace", "10", "-q"], log, []))
        for process in beside:
            process.kill()
            process.wait()
        if mode == "slow":
            relay.stop = True
    return frame_times(out), cpu


def frames(program, flood, recording, work):
    runs = {mode: [] for mode in MODES}
    for turn in range(ROUNDS):
        for mode in MODES[:: 1 if turn % 2 == 0 else -1]:
            runs[mode].append(drive(program, flood, recording, work, mode))
    best = {mode: [min(times) for times in zip(*(times for times, _ in runs[mode]))] for mode in MODES}
    print("| network | a frame, ms | 95 % of frames under, ms | ratio, frame by frame | CPU of the robot, s |\n|---|---|---|---|---|")
    for mode in MODES:
        every = sorted(best[mode])
        ratios = [t / n for t, n in zip(best[mode], best[MODES[0]])]
        print(f"| {mode} | {statistics.median(every):.1f} | {every[int(0.95 * len(every))]:.1f} | {statistics.median(ratios):.3f} "
              f"| {min(cpu for _, cpu in runs[mode]):.1f} |", flush=True)


def eight(program, recording, work):
    names = [f"r{i}" for i in range(8)]
    for i, name in enumerate(names):
        if not (work / "eight" / name / "map.db").exists():
            shutil.rmtree(work / "cuts" / name, ignore_errors=True)
            part_of(recording, work / "cuts" / name, range(42 * i, 42 * i + 100))
            run(program, "map", work / "cuts" / name, "-o", work / "eight" / name, "-p", "robot", "-q", "--force")
        (work / "eight" / name / "network.db").unlink(missing_ok=True)
    for folder in ("hub", "hub.partial"):
        shutil.rmtree(work / folder, ignore_errors=True)
    with Network() as network, open(work / "log", "w") as log:
        hub = network.run("h", [program, "hub", "-o", work / "hub", "--robots", "8", "--interface", "lo", *FUSE], log, [])
        watch = Watch(work / "hub")
        watch.pid = hub.pid
        watch.start()
        began = time.monotonic()
        robots = [network.run("h", [program, "robot", work / "eight" / name, "--name", name, "--interface", "lo"], log, [])
                  for name in names]
        codes = [robot.wait() for robot in robots]
        delivered = time.monotonic() - began
        hub.wait()
        watch.stop = True
    told = json.loads((work / "hub/summary.json").read_text())["network"]
    rows = [sum(told[name]["bytes"].values()) for name in names]
    print(f"eight maps: exit codes {codes}, {sum(t['keyframes'] for t in told.values())} keyframes, {sum(rows) / 1e6:.1f} MB of rows, "
          f"{sum(t['sent_again_bytes'] for t in told.values()) / 1e6:.1f} MB again, delivered after {delivered:.1f} s, "
          f"map.ply after {watch.map_at - began:.1f} s, {watch.peak_mb:.0f} MB at the hub at most")


def main(program, flood, recording, work):
    shutil.rmtree(work / "part", ignore_errors=True)
    work.mkdir(parents=True, exist_ok=True)
    part_of(recording, work / "part", range(0, 240, 2))
    frames(program, flood, work / "part", work)
    eight(program, recording, work)


if __name__ == "__main__":
    main(*(Path(argument).resolve() for argument in sys.argv[1:5]))
