#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Which setting is better on this recording? compare_settings.py RECORDING OUT

Maps a recording with groundtruth.txt twice, with and without lines, and plots the error of the camera's position over
time into OUT/errors.png (needs matplotlib; without it only the numbers are printed).
"""
import sys
from pathlib import Path
from typing import Any, Dict

import plumbline

SETTINGS: Dict[str, Dict[str, Any]] = {"points and lines": {}, "points alone": {"features": {"lines": False}}}


def main(recording: str, out: str) -> int:
    reports = {}
    for name, options in SETTINGS.items():
        result = plumbline.map(recording, Path(out) / name.replace(" ", "_"), force=True, **options)
        report = plumbline.evaluate_trajectory(result, recording)
        reports[name] = report
        ate_mm = 1000.0 * report["ate_m"]["rmse"]
        print(f"{name}: ATE {ate_mm:.2f} mm, {report['matched']} poses, {result.summary['timing']['wall_s']:.1f} s")
    try:
        import matplotlib  # type: ignore[import]

        matplotlib.use("Agg")
        from matplotlib import pyplot
    except ImportError:
        return 0

    figure, axes = pyplot.subplots(figsize=(8, 4))
    for name, report in reports.items():
        axes.plot(report.stamps - report.stamps[0], 1000.0 * report.errors, label=name)
    axes.set_xlabel("time (s)")
    axes.set_ylabel("error of the position (mm)")
    axes.legend()
    figure.savefig(Path(out) / "errors.png", dpi=120)
    print("written", Path(out) / "errors.png")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2]))
