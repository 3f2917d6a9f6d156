#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that the code can be read: check_style.py ROOT

Functions have at most 60 lines and 6 parameters. Of those of 20 lines and more in a module, the shares with a heading,
and without a run of more than ten lines between blank ones, must reach the module's bounds. Of all functions of 8 lines
and more, at most a quarter has no comment, neither above nor inside. A heading says more than the call below it, and no
comment begins with words that need the name beside them to be understood.
"""
import re
import sys
from pathlib import Path

from cpp_functions import functions, longest_run, without_text

FOLDERS = ["src", "include", "maps", "viz", "examples"]

LONGEST = 60
# Tables, whose lines are alike: their parts would have no name of their own.
TABLES = {"SynthOptions::declare": "an entry for each option of a world, in the order of the help",
          "ExportOptions::declare": "the same of exports",
          "report_style": "the style sheet of the report, a literal"}

MOST_PARAMETERS = 6
# Functions with more parameters, at most, by module. python: the arguments of functions that Python calls.
MORE_PARAMETERS = {"dataset": 2, "mapping": 5, "net": 1, "pipeline": 2, "python": 5}

LONG_FUNCTION = 20
LONG_RUN = 10
BOUND = 0.8
# Modules that have not reached the bound yet, with the share that they have.
BOUNDS = {"features": 0.75}
HEADED = 0.5
HEADED_BOUNDS = {"mapping": 0.21, "pipeline": 0.24}

SHORT_FUNCTION = 8
MOST_WORDLESS = 0.25

OPENING = re.compile(r"(?:^|\s)///?<? ?(What|Those)\b")
# Comments that still begin so, at most, by module.
OPENINGS = {}

LITTLE_WORDS = set("a an and are at by for from in into is it its of on or the their them this to with".split())


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


def is_comment(line):
    return line.strip().startswith("//")


def has_heading(lines, function):
    return any(is_comment(line) for line in lines[function.first + 1:function.last])


def has_words(lines, function):
    above = lines[max(0, function.first - 2):function.first]
    return has_heading(lines, function) or any(is_comment(line) for line in above)


def stems(text):
    """The words of a text or of identifiers, without their endings."""
    words = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", text)
    return {re.sub(r"(?<=\w{3})(?:ing|ed|es|s|e)$", "", word.lower()) for word in words
            if word.lower() not in LITTLE_WORDS}


def restating(lines, code, function):
    """Lines of headings of one line all of whose words are in the call below."""
    for number in range(function.opening + 1, function.last):
        if not is_comment(lines[number]) or is_comment(lines[number - 1]) or "(" not in code[number + 1]:
            continue
        heading = stems(lines[number])
        if heading and heading <= stems(code[number + 1]):
            yield number + 1


class Findings:
    """The problems of single places; functions and counts by module."""

    def __init__(self):
        self.problems = []
        self.runs = {}  # of long functions: (longest run, place)
        self.unheaded = {}  # of long functions: place, or nothing if it has a heading
        self.openings = {}
        self.wide = {}
        self.wordless = []  # of functions that are not short: place, or nothing if it has words

    def take(self, name, source):
        module = module_of(name)
        lines, code = source.splitlines(), without_text(source).splitlines()
        for function in functions(source):
            self.take_function(module, f"{name}:{function.first + 1}: {function.name}: ", lines, function)
            self.problems += [f"{name}:{number}: the heading only repeats the call below"
                              for number in restating(lines, code, function)]
        for number in openings(lines):
            self.openings.setdefault(module, []).append(f"{name}:{number}: begins with a word that explains nothing")

    def take_function(self, module, place, lines, function):
        length = function.last - function.first + 1
        if length > LONGEST and function.name not in TABLES:
            self.problems.append(f"{place}{length} lines; {LONGEST} at most")
        if function.parameters > MOST_PARAMETERS:
            count = f"{function.parameters} parameters; {MOST_PARAMETERS} at most"
            self.wide.setdefault(module, []).append(place + count)

        if length >= LONG_FUNCTION:
            run = longest_run(lines, function)
            self.runs.setdefault(module, []).append((run, f"{place}{run} lines without a blank one"))
            headed = has_heading(lines, function)
            self.unheaded.setdefault(module, []).append("" if headed else f"{place}no heading")
        if length >= SHORT_FUNCTION:
            self.wordless.append("" if has_words(lines, function) else f"{place}no comment")


def check(root):
    """(problems, share with paragraphs by module)"""
    found = Findings()
    for file in sources(root):
        found.take(file.relative_to(root), file.read_text())
    problems, shares = found.problems, {}

    for module, runs in found.runs.items():
        shares[module] = sum(run <= LONG_RUN for run, _ in runs) / len(runs)
        bound = BOUNDS.get(module, BOUND)
        if shares[module] < bound:
            problems.append(f"{module}: {shares[module]:.2f} of its long functions have paragraphs, {bound} must:")
            problems += [place for run, place in sorted(runs, reverse=True) if run > LONG_RUN]

    for module, places in found.unheaded.items():
        share, bound = places.count("") / len(places), HEADED_BOUNDS.get(module, HEADED)
        if share < bound:
            problems.append(f"{module}: {share:.2f} of its long functions have a heading, {bound} must:")
            problems += [place for place in places if place]

    wordless = [place for place in found.wordless if place]
    if len(wordless) > MOST_WORDLESS * len(found.wordless):
        problems.append(f"{len(wordless)} of {len(found.wordless)} functions have no comment:")
        problems += wordless

    for counts, most in [(found.openings, OPENINGS), (found.wide, MORE_PARAMETERS)]:
        for module, places in counts.items():
            if len(places) > most.get(module, 0):
                problems += places
    return problems, shares


def main(root):
    problems, shares = check(root)
    print("\n".join(problems + [f"{module}: {share:.2f}" for module, share in sorted(shares.items())]))
    return 1 if problems or not shares else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve()))
