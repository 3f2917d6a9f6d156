#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the words of the code and of what users read: check_words.py ROOT

words.txt beside this file bans identifiers of our own. A line there:
  regular expression  # the term that stands for it  @ folders or files where the expression counts
phrases.txt bans wording in comments, in texts (string literals: help, descriptions, messages) and in pages:
  regular expression  # what to write instead  @ comment, text or page (all three without them), and folders as above
In both, a folder after '!' is excepted, and NAME = FOLDERS gives folders a name for that.
"""
import bisect
import re
import sys
from pathlib import Path

FOLDERS = ["src", "include", "maps", "viz", "examples"]
PAGES = ["*.md", "docs/*.md", "docs/*/*.md"]
KINDS = ("comment", "text", "page")
TOKEN = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\((?:.*?)\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])\'', re.S)
GROUP = re.compile(r"(?P<name>\w+) = (?P<folders>[^#]*)")
RAW = re.compile(r'R"(\w*)\((.*)\)\1"', re.S)
# The expression, "#" between blanks, what to write instead, "@" between blanks, where.
RULE = re.compile(r"(?P<pattern>.*?)\s+#\s+(?P<instead>.*?)(?:\s+@\s+(?P<where>.*))?")


def rules(file):
    """(pattern, what to write instead, words behind the @) of each line"""
    groups = {}
    for line in file.read_text().splitlines():
        if line.startswith("#") or not line.strip():
            continue
        group = GROUP.fullmatch(line)
        if group is not None:
            groups["!" + group["name"]] = ["!" + folder for folder in group["folders"].split()]
            continue
        rule = RULE.fullmatch(line.rstrip())
        if rule is None:
            raise ValueError(f"{file.name}: no '#' with what to write instead: {line}")
        where = (rule["where"] or "").split()
        yield rule["pattern"], rule["instead"], [folder for w in where for folder in groups.get(w, [w])]


def counts_in(name, where):
    """True if a rule with these folders counts in the file."""
    if any(name.startswith(w[1:]) for w in where if w.startswith("!")):
        return False
    only = [w for w in where if not w.startswith("!")]
    return not only or any(name.startswith(w) for w in only)


def without_text(source):
    """The code without comments and string literals, on the same lines."""
    return TOKEN.sub(lambda m: "\n" * m.group().count("\n"), source)


class Passage:
    """Text that reads as one, with the line on which each part of it stands."""

    def __init__(self):
        self.text, self.starts, self.lines = "", [], []

    def add(self, text, line, space=" "):
        self.text += space if self.text else ""
        self.starts.append(len(self.text))
        self.lines.append(line)
        self.text += text

    def line_of(self, offset):
        return self.lines[bisect.bisect_right(self.starts, offset) - 1]


def comments(source):
    """Passages: comments that stand on lines of their own and follow each other are one."""
    passage, last = None, -1
    for token in TOKEN.finditer(source):
        if not token.group().startswith("//"):
            continue
        line = source.count("\n", 0, token.start()) + 1
        text = token.group().lstrip("/<").strip()
        alone = not source[source.rfind("\n", 0, token.start()) + 1:token.start()].strip()
        if passage is None or not alone or line != last + 1:
            if passage is not None:
                yield passage
            passage = Passage()
        passage.add(text, line)
        last = line if alone else -1
    if passage is not None:
        yield passage


def content(literal):
    raw = RAW.fullmatch(literal)
    return raw[2] if raw else literal[1:-1]


def texts(source):
    """Passages: string literals that the compiler joins are one. Names of headers and characters are none."""
    passage, end = None, 0
    for token in TOKEN.finditer(source):
        text = token.group()
        if text.startswith(("//", "/*", "'")):
            continue
        line_start = source.rfind("\n", 0, token.start()) + 1
        if source.startswith("#include", line_start):
            continue
        line = source.count("\n", 0, token.start()) + 1
        if passage is not None and TOKEN.sub("", source[end:token.start()]).strip():
            yield passage
            passage = None
        passage = passage or Passage()
        passage.add(content(text), line, space="")
        end = token.end()
    if passage is not None:
        yield passage


def paragraphs(page):
    """Passages: paragraphs, points of lists and rows of tables, without blocks of code."""
    passage, fenced = None, False
    for number, line in enumerate(page.splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        stripped = "" if fenced or line.lstrip().startswith("```") else line.strip()
        if passage is not None and (not stripped or re.match(r"[*|#-]|\d+\.\s", stripped)):
            yield passage
            passage = None
        if stripped:
            passage = passage or Passage()
            passage.add(re.sub(r"^([*#-]+|\d+\.)\s+", "", stripped), number)
    if passage is not None:
        yield passage


def sources(root):
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.[ch]pp")):
            yield path.relative_to(root).as_posix(), path.read_text()


def pages(root):
    for pattern in PAGES:
        for path in sorted(root.glob(pattern)):
            yield path.relative_to(root).as_posix(), path.read_text()


def offences(root, words):
    """Identifiers that are words of our own."""
    compiled = [(re.compile(f"(?:{pattern})"), term, where) for pattern, term, where in words]
    for name, source in sources(root):
        known = {}
        for number, line in enumerate(without_text(source).splitlines(), 1):
            for word in re.findall(r"[A-Za-z_]\w*", line):
                known.setdefault(word, number)
        for pattern, term, where in compiled:
            if counts_in(name, where):
                for word in filter(pattern.fullmatch, known):
                    yield f"{name}:{known[word]}: '{word}' is a word of our own: {term}"


def phrase_offences(root, phrases):
    """Wording in comments, texts and pages that needs a second reading."""
    compiled = []
    for pattern, instead, where in phrases:
        kinds = [w for w in where if w in KINDS] or KINDS
        compiled.append((re.compile(pattern), instead, kinds, [w for w in where if w not in KINDS]))

    def found_in(name, kind, passages):
        counting = [(pattern, instead) for pattern, instead, kinds, where in compiled
                    if kind in kinds and counts_in(name, where)]
        for passage in passages:
            for pattern, instead in counting:
                found = pattern.search(passage.text)
                if found:
                    words = " ".join(found.group().split())
                    yield f"{name}:{passage.line_of(found.start())}: '{words}' in a {kind}: {instead}"

    for name, source in sources(root):
        yield from found_in(name, "comment", comments(source))
        yield from found_in(name, "text", texts(source))
    for name, page in pages(root):
        yield from found_in(name, "page", paragraphs(page))


def check(root, words, phrases):
    return list(offences(root, words)) + list(phrase_offences(root, phrases))


def main():
    here = Path(__file__)
    found = check(Path(sys.argv[1]), list(rules(here.with_name("words.txt"))),
                  list(rules(here.with_name("phrases.txt"))))
    print("\n".join(found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
