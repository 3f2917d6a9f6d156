#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs clang-format on all C++ sources and clang-tidy on those that have changed.

check_tidy.py format ROOT          every file is as .clang-format wants it
check_tidy.py tidy ROOT BUILD      changed sources have none of the problems that .clang-tidy lists

Changed is what differs from PLUMBLINE_BASE, by default from the last commit but one. At most 12 sources are looked at,
the ones with most changes. Without the tool, or outside a git checkout, the exit code is 77: skipped.
"""
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

SKIPPED = 77
MOST = 12
FOREIGN = ("-Winvalid-pch", "-fpch-preprocess")  # of g++'s precompiled headers


def git(root, *arguments):
    run = subprocess.run(["git", "-C", str(root), *arguments], capture_output=True, text=True)
    return run.stdout.splitlines() if run.returncode == 0 else None


def check_format(root):
    files = git(root, "ls-files", "-co", "--exclude-standard", "*.cpp", "*.hpp")
    if not shutil.which("clang-format") or files is None:
        print("clang-format or git is missing")
        return SKIPPED
    files = [file for file in files if (root / file).exists()]
    wrong = []
    for first in range(0, len(files), 100):
        run = subprocess.run(["clang-format", "--dry-run", "-Werror", *files[first:first + 100]], cwd=root,
                             capture_output=True, text=True)
        wrong += [line for line in run.stderr.splitlines() if "clang-format-violations" in line]
    print("\n".join(wrong + [f"{len(files)} files, {len(wrong)} places that clang-format would change"]))
    return 1 if wrong or not files else 0


def now(name):
    """The name of a file today: git says FOLDER/{OLD => NEW}/FILE of one that was moved."""
    moved = re.sub(r"\{.* => (.*)\}", r"\1", name)
    return (moved.split(" => ")[1] if " => " in moved else moved).replace("//", "/")


def changed_sources(root):
    """Sources of the product that differ from the base, most changes first; None outside git."""
    base = os.environ.get("PLUMBLINE_BASE", "HEAD~1")
    # A file that was only moved, or whose includes were, has not changed.
    lines = git(root, "diff", "--numstat", "-M", "-I^#include", base, "--", "src", "maps", "viz")
    if lines is None:
        return None
    changes = [line.split("\t") for line in lines]
    changes += [("1", "0", name) for name in git(root, "ls-files", "-o", "--exclude-standard", "src", "maps", "viz")]
    sources = [(int(added) + int(removed), now(name)) for added, removed, name in changes if added + removed != "00"]
    sources = [(count, name) for count, name in sources if name.endswith(".cpp") and (root / name).exists()]
    return [name for _, name in sorted(sources, reverse=True)]


def commands_of(build):
    """(source, folder, arguments) as the build has them; a unity source stands for its folder's sources."""
    for entry in json.loads((build / "compile_commands.json").read_text()):
        yield Path(entry["file"]), entry["directory"], shlex.split(entry["command"])


def without_foreign(arguments):
    kept, skip = [], 0
    for at, argument in enumerate(arguments):
        if skip:
            skip -= 1
        elif argument in ("-o", "-MF", "-MT", "-MQ", "-c") or (
                argument == "-include" and "cmake_pch" in arguments[at + 1]):
            skip = 1
        elif argument not in FOREIGN and argument != "-MD":
            kept.append(argument)
    compiler = next(at for at, a in enumerate(kept) if Path(a).name in ("c++", "g++", "clang++"))
    return kept[compiler:]


def compiles(file, source):
    """Whether the file is that source, or a unity source that includes it."""
    return file == source or ("Unity" in file.parts and file.exists() and f'"{source}"' in file.read_text())


def database(root, build, sources):
    """Compile commands for single sources, with the flags of their target, or of the closest one."""
    commands = list(commands_of(build))
    entries = []
    for source in sources:
        def closeness(command, folder=(build / source).parent):
            return len(os.path.commonpath([str(command[0].parent), str(folder)]))
        exact = [command for command in commands if compiles(command[0], root / source)]
        file, folder, arguments = (exact or [max(commands, key=closeness)])[0]
        entries.append({"file": str(root / source), "directory": folder,
                        "arguments": [a for a in without_foreign(arguments) if a != str(file)] +
                                     ["-c", str(root / source)]})
    return entries


def check_tidy(root, build):
    sources = changed_sources(root)
    if not shutil.which("clang-tidy") or sources is None or not (build / "compile_commands.json").exists():
        print("clang-tidy, git or compile commands are missing")
        return SKIPPED
    looked_at, left_out = sources[:MOST], sources[MOST:]
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "compile_commands.json").write_text(json.dumps(database(root, build, looked_at)))
        failed = []
        for source in looked_at:
            run = subprocess.run(["clang-tidy", "-p", folder, "--quiet", "--warnings-as-errors=*",
                                  "--extra-arg=-Wno-unknown-warning-option", str(root / source)],
                                 capture_output=True, text=True)
            if run.returncode != 0:
                failed.append(source)
                print(f"{source}:\n{run.stdout}")
    print(f"{len(looked_at)} changed sources, {len(failed)} with problems; left out: {', '.join(left_out) or 'none'}")
    return 1 if failed else 0


if __name__ == "__main__":
    if sys.argv[1] == "format":
        sys.exit(check_format(Path(sys.argv[2]).resolve()))
    sys.exit(check_tidy(Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve()))
