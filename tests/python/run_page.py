#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the Python blocks of a page one after the other, as one script: run_page.py PAGE PROGRAM WORK"""
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path


def main(page, program, work):
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    subprocess.run([program, "synth", "room", "-o", "world", "--frames", "40", "--width", "320", "--height", "240", "-q"],
                   cwd=work, check=True)
    os.symlink("world/robot0" if (work / "world" / "robot0").is_dir() else "world", work / "recording")
    blocks = re.findall(r"^```python\n(.*?)^```$", page.read_text(), re.M | re.S)
    assert len(blocks) > 3, "the page has no blocks"
    (work / "page.py").write_text("\n".join(blocks))
    return subprocess.run([sys.executable, "page.py"], cwd=work, check=False).returncode


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), sys.argv[2], Path(sys.argv[3]).resolve()))
