#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the Python examples on a recording as a user would: run_examples.py EXAMPLES PROGRAM WORK"""
import shutil
import subprocess
import sys
from pathlib import Path


def run(*command):
    print("+", *command, flush=True)
    return subprocess.run(list(map(str, command)), check=True, stdout=subprocess.PIPE, text=True).stdout


def main(examples, program, work):
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    run(program, "synth", "room", "-o", work / "world", "--frames", 40, "--width", 320, "--height", 240, "-q")
    recording = work / "world" / "robot0" if (work / "world" / "robot0").is_dir() else work / "world"

    text = run(sys.executable, examples / "map_folder.py", recording, work / "mapped")
    assert "40 poses" in text and (work / "mapped" / "iso.png").exists() and (work / "mapped" / "thin.ply").exists(), text
    text = run(sys.executable, examples / "camera_loop.py", recording, work / "live")
    assert " keyframe" in text and "left out" in text and (work / "live" / "map.ply").exists(), text
    text = run(sys.executable, examples / "compare_settings.py", recording, work / "compared")
    assert text.count("ATE") == 2 and ("errors.png" not in text or (work / "compared" / "errors.png").exists()), text
    tried = {"map_folder.py", "camera_loop.py", "compare_settings.py"}
    assert {file.name for file in examples.glob("*.py")} == tried, "an example is not tried here"
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), sys.argv[2], Path(sys.argv[3])))
