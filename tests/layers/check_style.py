#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that the code reads in paragraphs: check_style.py ROOT

Of the functions of 20 lines and more in a module, the share without a run of more than ten lines between blank ones
must reach the module's bound. Comments do not begin with words that need the name beside them to be understood.
"""
import re
import sys
from pathlib import Path

from cpp_functions import functions, longest_run

FOLDERS = ["src", "include", "maps", "viz", "examples"]
LONG_FUNCTION = 20
LONG_RUN = 10
BOUND = 0.8
# Modules that have not reached the bound yet, with the share that they have.
BOUNDS = {"features": 0.75}
OPENING = re.compile(r"(?:^|\s)///?<? ?(What|Those)\b")
# Comments that still begin so, at most, by module.
OPENINGS = {}


def sources(root):
    for folder in FOLDERS:
        yield from sorted((root / folder).rglob("*.[ch]pp"))


def module_of(relative):
    parts = relative.parts
    if parts[0] == "include":
        return parts[2]
    return parts[1] if parts[0] == "src" else parts[0]


def openings(lines):
    """Lines on which a comment begins with one of the words; a comment goes on from line to line."""
    for number, line in enumerate(lines):
        before = lines[number - 1].strip() if number > 0 else ""
        goes_on = before.startswith("//") and line.strip().startswith("//")
        if OPENING.search(re.sub(r'"(?:\\.|[^"\\])*"', '""', line)) and not goes_on:
            yield number + 1


def check(root):
    """(problems, share by module)"""
    long_functions, found, problems = {}, {}, []
    for file in sources(root):
        source = file.read_text()
        lines = source.splitlines()
        name = file.relative_to(root)
        for function in functions(source):
            if function.last - function.first + 1 >= LONG_FUNCTION:
                run = longest_run(lines, function)
                place = f"{name}:{function.first + 1}: {function.name}: {run} lines without a blank one"
                long_functions.setdefault(module_of(name), []).append((run, place))
        for number in openings(lines):
            found.setdefault(module_of(name), []).append(f"{name}:{number}: begins with a word that explains nothing")
    shares = {}
    for module, runs in long_functions.items():
        shares[module] = sum(run <= LONG_RUN for run, _ in runs) / len(runs)
        bound = BOUNDS.get(module, BOUND)
        if shares[module] < bound:
            problems += [f"{module}: {shares[module]:.2f} of its long functions have paragraphs, {bound} must:"]
            problems += [place for run, place in sorted(runs, reverse=True) if run > LONG_RUN]
    for module, places in found.items():
        if len(places) > OPENINGS.get(module, 0):
            problems += places
    return problems, shares


def main(root):
    problems, shares = check(root)
    print("\n".join(problems + [f"{module}: {share:.2f}" for module, share in sorted(shares.items())]))
    return 1 if problems or not shares else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
