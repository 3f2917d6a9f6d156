#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the files that start the program on a robot: check_robot_files.py PROGRAM FOLDER

systemd accepts the unit, and the program has each option that the unit and the launch file give it.
"""
import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path


def options_of(program, command):
    text = subprocess.run([program, command, "--help"], capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", text))


def strings_in(node):
    return [n.value for n in ast.walk(node) if isinstance(n, ast.Constant) and isinstance(n.value, str)]


def launched(file):
    """(command, words) of each program that the launch file starts."""
    tree = ast.parse(file.read_text(), file.name)
    lists = {n.targets[0].id: strings_in(n.value) for n in tree.body if isinstance(n, ast.Assign)}
    for call in ast.walk(tree):
        if not (isinstance(call, ast.Call) and getattr(call.func, "id", "") == "ExecuteProcess"):
            continue
        cmd = next(k.value for k in call.keywords if k.arg == "cmd")
        words = strings_in(cmd) + [w for n in ast.walk(cmd) if isinstance(n, ast.Name) for w in lists.get(n.id, [])]
        assert words[0] == "plumbline", words
        yield words[1], words[2:]


def main(program, folder):
    problems, unit = [], folder / "plumbline-robot.service"
    line = re.search(r"/usr/bin/plumbline (\w+) (.*)'", unit.read_text())
    starts = [(unit.name, line[1], line[2].split())]
    starts += [("plumbline.launch.py", command, words) for command, words in launched(folder / "plumbline.launch.py")]
    assert len(starts) == 3, starts
    for name, command, words in starts:
        known = options_of(program, command)
        problems += [f"{name}: plumbline {command} has no {w}" for w in words if w.startswith("-") and w not in known]

    if shutil.which("systemd-analyze"):
        # The program that the unit starts need not be installed here.
        done = subprocess.run(["systemd-analyze", "verify", "--man=no", unit], capture_output=True, text=True, check=False)
        problems += [line for line in done.stderr.splitlines() if unit.name in line and "not executable" not in line]
    print("\n".join(problems) or f"{len(starts)} starts are right")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], Path(sys.argv[2])))
