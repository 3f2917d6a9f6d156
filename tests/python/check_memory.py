#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Memory stays where it is over many runs of open, feed, finish: check_memory.py RUNS

After a first tenth of the runs, neither what the process has asked of the C library's allocator and not returned, nor
Python's own objects, may grow by a noticeable part of a run's images. The resident size is printed but not judged:
the allocator keeps 25 MB of freed memory after one run and returns them to the system after another.
"""
import ctypes
import gc
import sys
import tracemalloc

import plumbline

SCENE = "synth:room?frames=8&width=160&height=120"
MOST_MB = 1.0  # allocated and not freed, over all later runs
MOST_PYTHON_KB = 64.0


class Mallinfo2(ctypes.Structure):
    """The struct that mallinfo2(3) returns."""

    _fields_ = [(name, ctypes.c_size_t) for name in ("arena", "ordblks", "smblks", "hblks", "hblkhd", "usmblks", "fsmblks",
                                                     "uordblks", "fordblks", "keepcost")]


C_LIBRARY = ctypes.CDLL(None)
C_LIBRARY.mallinfo2.restype = Mallinfo2


def allocated_mb():
    info = C_LIBRARY.mallinfo2()
    return (info.uordblks + info.hblkhd) / 2**20


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
            early = (allocated_mb(), tracemalloc.get_traced_memory()[0])
        if number % 20 == 0:
            python_kb = tracemalloc.get_traced_memory()[0] / 1024
            print(f"run {number}: {allocated_mb():.1f} MB allocated ({resident_mb():.0f} resident), Python {python_kb:.0f} KB",
                  flush=True)
    grown_mb = allocated_mb() - early[0]
    grown_kb = (tracemalloc.get_traced_memory()[0] - early[1]) / 1024.0
    print(f"{runs} runs: {grown_mb:+.2f} MB, Python {grown_kb:+.1f} KB")
    return 1 if grown_mb > MOST_MB or grown_kb > MOST_PYTHON_KB else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))
