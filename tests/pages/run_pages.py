#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs what the guide's pages tell users to type: run_pages.py ROOT PROGRAM WORK

Every ```sh block of docs/guide is run, one shell for a block, in the folder WORK; getting_started.md and
several_robots.md come first, as the others go on with their results. Recordings are made small: fewer frames,
smaller images. A comment before a block says what else is to be done with it:

    <!-- not run: reason -->   it needs what a test has not, and is reported as skipped
    <!-- file: NAME -->        the block is written to WORK/NAME; <!-- append: NAME --> goes on with such a file

A block with a plumbline command must be one of these. At the end docs/reference/files.md must know every file,
column and key of the results out/room and out/both.
"""
import json
import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

BLOCK = re.compile(r"(?:^<!-- (not run|file|append): (.+?) -->\n)?^```([a-z]*)\n(.*?)^```$", re.S | re.M)
FRAMES = 80  # at most, of each recording
FIRST = ["getting_started.md", "several_robots.md"]


def small(script):
    """The same commands with recordings that take seconds."""
    def fewer(match):
        return match.group(1) + str(min(int(match.group(2)), FRAMES))

    script = re.sub(r"(--frames |frames=)(\d+)", fewer, script)
    script = re.sub(r"(synth:[a-z]+)\?", r"\1?width=320&height=240&", script)
    script = re.sub(r"^(plumbline synth .*?)( *#.*)?$", r"\1 --width 320 --height 240", script, flags=re.M)
    script = re.sub(r"^(plumbline synth (?!.*--frames).*)$", rf"\1 --frames {FRAMES}", script, flags=re.M)
    # Not among the hubs and robots of others.
    return re.sub(r"^(plumbline (?:hub|robot) )", r"\1--domain 217 ", script, flags=re.M)


def blocks(text):
    """(line, what, value, language, body) of every fenced block; what: not run, file, append or empty."""
    for match in BLOCK.finditer(text):
        line = text.count("\n", 0, match.start(4)) + 1
        yield line, match.group(1) or "", match.group(2) or "", match.group(3), match.group(4)


def steps(page, text):
    """(where, kind, value, body) of a page: run, skip, file, append, or problem."""
    for line, what, value, language, body in blocks(text):
        where = f"{page}:{line}"
        if what in ("file", "append"):
            yield where, what, value, body
        elif what == "not run":
            yield where, "skip", value, body
        elif language == "sh":
            yield where, "run", "", body
        elif re.search(r"^plumbline ", body, re.M):
            yield where, "problem", "is no ```sh block; say `<!-- not run: reason -->` if it cannot be run", body


def run(script, work, program):
    """Exit code and output of a block, each command in turn until one fails."""
    environment = dict(os.environ, PATH=f"{Path(program).resolve().parent}:{os.environ['PATH']}")
    done = subprocess.run(["bash", "-euo", "pipefail", "-c", script], cwd=work, env=environment,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    return done.returncode, done.stdout


def do(step, work, program):
    """The problem with one step, if there is one."""
    where, kind, value, body = step
    if kind == "problem":
        return f"{where}: {value}"
    if kind in ("file", "append"):
        with open(work / value, "w" if kind == "file" else "a", encoding="utf-8") as file:
            file.write(body)
    elif kind == "run":
        begin = time.monotonic()
        code, output = run(small(body), work, program)
        print(f"{where}: exit code {code}, {time.monotonic() - begin:.1f} s", flush=True)
        if code != 0:
            return f"{where}: exit code {code}\n{small(body)}\n{output[-3000:]}"
    else:
        print(f"{where}: skipped, {value}", flush=True)
    return None


def names(result):
    """Files of a result, columns of its tables and keys of its summary."""
    found = {file.name + ("/" if file.is_dir() else "") for file in result.iterdir()}
    for table in ("frames.csv", "keyframes.csv"):
        with open(result / table, encoding="utf-8") as file:
            found |= set(file.readline().strip().split(","))
    return found | set(json.loads((result / "summary.json").read_text(encoding="utf-8")))


def check_files(root, work):
    page = root / "docs" / "reference" / "files.md"
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    known = set(re.findall(r"`([\w./]+?)(?:\*\.png|NAME/)?`", text))
    return [f"docs/reference/files.md: does not tell of {name}, which {result} has"
            for result in ("out/room", "out/both") if (work / result / "summary.json").is_file()
            for name in sorted(names(work / result) - known)]


def main(root, program, work):
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    pages = sorted((root / "docs" / "guide").glob("*.md"), key=lambda page: (page.name not in FIRST, page.name))
    problems = []
    for page in pages:
        for step in steps(page.name, page.read_text(encoding="utf-8")):
            problems += filter(None, [do(step, work, program)])
    problems += check_files(root, work)
    print("\n".join(problems + [f"{len(pages)} pages, {len(problems)} problems"]))
    return 1 if problems or not pages else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), sys.argv[2], Path(sys.argv[3]).resolve()))
