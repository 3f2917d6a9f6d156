#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Memory stays where it is over many runs of open, feed, finish: check_memory.py RUNS

After a first tenth of the runs, neither the process nor Python's own objects may grow by more than a run's own images.
"""
import gc
import sys
import tracemalloc

import plumbline

SCENE = "synth:room?frames=8&width=160&height=120"
MOST_MB = 25.0  # of the process, over all later runs: allocators keep some
MOST_PYTHON_KB = 64.0


def resident_mb():
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) / 1024.0 for line in status if line.startswith("VmRSS"))


def run_once():
    recording = plumbline.open(SCENE)
    mapper = plumbline.Mapper(recording.camera, threads=2)
    for frame in recording:
        mapper.feed(frame.color, frame.depth, frame.stamp)
    mapper.finish().trajectory


def main(runs):
    tracemalloc.start()
    early = (0.0, 0)
    for number in range(runs):
        run_once()
        gc.collect()
        if number + 1 == max(runs // 10, 3):
            early = (resident_mb(), tracemalloc.get_traced_memory()[0])
        if number % 20 == 0:
            print(f"run {number}: {resident_mb():.1f} MB, Python {tracemalloc.get_traced_memory()[0] / 1024:.0f} KB", flush=True)
    grown_mb = resident_mb() - early[0]
    grown_kb = (tracemalloc.get_traced_memory()[0] - early[1]) / 1024.0
    print(f"{runs} runs: {grown_mb:+.1f} MB, Python {grown_kb:+.1f} KB")
    return 1 if grown_mb > MOST_MB or grown_kb > MOST_PYTHON_KB else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))
