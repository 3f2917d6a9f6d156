#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Checks the pages: check_docs.py ROOT PROGRAM

Links to files and headings of the tree must lead somewhere, as must names of pages in sources; every page of
docs/ is in an index; every `plumbline` command in a page is one that the program has, with the flags it is shown
with (but for the notes, which keep the commands of their day); and the guide's pages together are not too long.
"""
import functools
import re
import subprocess
import sys
from pathlib import Path

LINK = re.compile(r"\]\(([^)#\s]*)(?:#([^)\s]+))?\)")
PAGE = re.compile(r"docs/[\w/.-]+\.md")
GUIDE_LINES = 2000
MADE = "<!-- Made by "  # pages that are made from the code do not count
BLOCK = re.compile(r"^```[a-z]*\n(.*?)^```", re.S | re.M)


def pages(root):
    return sorted(root.glob("*.md")) + sorted((root / "docs").rglob("*.md")) + sorted((root / "examples").rglob("*.md"))


def anchors(page):
    """The headings of a page as GitHub names them in links."""
    text = BLOCK.sub("", page.read_text())
    headings = re.findall(r"^#+ (.+)$", text, re.M)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def check_links(root):
    problems = []
    for page in pages(root):
        for number, line in enumerate(page.read_text().splitlines(), 1):
            for target, anchor in LINK.findall(line):
                if re.match(r"[a-z]+:", target):
                    continue
                where = f"{page.relative_to(root)}:{number}"
                file = page.parent / target if target else page
                if not file.exists():
                    problems.append(f"{where}: {target} is not there")
                elif anchor and file.suffix == ".md" and anchor not in anchors(file):
                    problems.append(f"{where}: {target} has no heading #{anchor}")
    return problems


def check_index(root):
    """Every page is listed by docs/README.md or by a README.md of its own folder that is."""
    docs = root / "docs"
    listed = set()
    for index in docs.rglob("README.md"):
        listed |= {(index.parent / target).resolve() for target, _ in LINK.findall(index.read_text())}
    return [f"docs/README.md:1: does not list {page.relative_to(docs)}" for page in pages(root)
            if docs in page.parents and page != docs / "README.md" and page.resolve() not in listed]


def check_citations(root):
    """Pages that sources and messages name are there."""
    problems = []
    for folder in ("src", "include", "maps", "viz", "pipelines", "examples", "scripts"):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".hpp", ".cpp", ".idl", ".yaml", ".sh", ".txt"):
                for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                    gone = [page for page in PAGE.findall(line) if not (root / page).exists()]
                    problems += [f"{file.relative_to(root)}:{number}: {page} is not there" for page in gone]
    return problems


def check_length(root):
    pages = [page.read_text().splitlines() for page in (root / "docs" / "guide").glob("*.md")]
    lines = sum(len(page) for page in pages if not any(line.startswith(MADE) for line in page))
    return [f"docs/guide: {lines} lines; {GUIDE_LINES} at most"] if lines > GUIDE_LINES else []


def commands(text):
    """(line, words) of every plumbline command in the code blocks of a page."""
    for block in BLOCK.finditer(text):
        first = text.count("\n", 0, block.start(1)) + 1
        for number, line in enumerate(block.group(1).splitlines(), first):
            words = line.split("#")[0].replace("build/release/bin/", "").split()
            if words[:1] == ["plumbline"]:
                yield number, words[1:]


def find_command(words, help_of):
    """(words that name the command, its help); a group's help lists the commands that may follow."""
    command = words[:1]
    text = help_of(command)
    while text is not None and "Subcommands:" in text:
        following = words[len(command):len(command) + 1]
        if not following or following[0].startswith("-"):
            break
        command = command + following
        listed = re.search(rf"^ +{re.escape(following[0])}(?![\w-])", text.split("Subcommands:")[1], re.M)
        text = help_of(command) if listed else None
    return command, text


def check_commands(root, help_of):
    """`help_of(words)` gives the help of a command, None when there is no such command."""
    problems = []
    for page in pages(root):
        if root / "docs" / "notes" in page.parents:
            continue
        for number, words in commands(page.read_text()):
            where = f"{page.relative_to(root)}:{number}"
            command, text = find_command(words, help_of)
            if text is None:
                problems.append(f"{where}: there is no command 'plumbline {' '.join(command)}'")
                continue
            for flag in [w.split("=")[0] for w in words if re.match(r"--?[a-z]", w)]:
                if not re.search(rf"(?<![\w-]){re.escape(flag)}(?![\w-])", text):
                    problems.append(f"{where}: plumbline {' '.join(command)} has no {flag}")
    return problems


def check_layouts(root, help_of):
    """The page of inputs has a row for each layout that --format takes."""
    listed = re.search(r"--format TEXT:\{([^}]*)\}", help_of(("map",)) or "")
    page = root / "docs" / "guide" / "inputs.md"
    text = page.read_text() if page.is_file() else ""
    return [f"docs/guide/inputs.md: there is no row for --format {name}" for name in
            (listed.group(1).split(",") if listed else []) if name != "auto" and f"| `{name}` |" not in text]


def check(root, help_of):
    return (check_layouts(root, help_of) + check_links(root) + check_index(root) + check_citations(root) + check_length(root) +
            check_commands(root, help_of))


def main(root, program):
    @functools.lru_cache(maxsize=None)
    def help_of_words(*command):
        run = subprocess.run([program, *command, "--help"], capture_output=True, text=True)
        return run.stdout if run.returncode == 0 else None

    def help_of(command):
        return help_of_words(*command)

    problems = check(root, help_of)
    print("\n".join(problems + [f"{len(pages(root))} pages, {len(problems)} problems"]))
    return 1 if problems or not pages(root) else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), sys.argv[2]))
