#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks that identifiers use the field's terms: check_words.py ROOT, against words.txt beside this file.

A line there: regular expression  # the term that stands for it  @ folders or files where the expression counts.
"""
import re
import sys
from pathlib import Path

FOLDERS = ["src", "include", "maps", "viz", "examples"]
TEXT = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.S)


def rules(file):
    for line in file.read_text().splitlines():
        if line.startswith("#") or not line.strip():
            continue
        pattern, _, rest = line.partition("#")
        term, _, where = rest.partition("@")
        yield re.compile(f"(?:{pattern.strip()})"), term.strip(), where.split()


def offences(root, words):
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.[ch]pp")):
            name = path.relative_to(root).as_posix()
            known = {}
            code = TEXT.sub(lambda m: "\n" * m.group().count("\n"), path.read_text())
            for number, line in enumerate(code.splitlines(), 1):
                for word in re.findall(r"[A-Za-z_]\w*", line):
                    known.setdefault(word, number)
            for pattern, term, where in words:
                if where and not any(name.startswith(w) for w in where):
                    continue
                for word in filter(pattern.fullmatch, known):
                    yield f"{name}:{known[word]}: '{word}' is a word of our own: {term}"


def main():
    found = list(offences(Path(sys.argv[1]), list(rules(Path(__file__).with_name("words.txt")))))
    print("\n".join(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
