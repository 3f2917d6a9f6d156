#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Man pages and completion in the programs that people use: run_shells.py PROGRAM WORK man|bash|zsh|fish

Exit code 77 where the program (groff, the shell) is not installed.
"""
import os
import pty
import re
import select
import shutil
import subprocess
import sys
import time
from pathlib import Path

SKIPPED = 77
# What is typed, and what must stand there after the tabulator: {} is a place where more than one word may follow.
COMPLETED = [
    ("plumbline fus", "plumbline fuse "),
    ("plumbline evaluate traj", "plumbline evaluate trajectory "),
    ("plumbline map --debug", "plumbline map --debug-video "),
    ("plumbline map rec -p points_o", "plumbline map rec -p points_only "),
    ("plumbline map rec --camera tum_fr1", "plumbline map rec --camera tum_fr1 "),
    ("plumbline map rec --set track.loops.min_g", "plumbline map rec --set track.loops.min_gap="),
    ("plumbline map rec --set track.loops=of", "plumbline map rec --set track.loops=off "),
    ("plumbline filter keyf", "plumbline filter keyframe "),
    ("plumbline filters describe voxel_g", "plumbline filters describe voxel_grid "),
    ("plumbline pipelines describe featu", "plumbline pipelines describe features "),
    ("plumbline synth corri", "plumbline synth corridor "),
    ("plumbline export out --format colm", "plumbline export out --format colmap "),
    ("plumbline render out --color hei", "plumbline render out --color height "),
    ("plumbline completion fi", "plumbline completion fish "),
    ("plumbline map a_recor", "plumbline map a_recording/"),
    ("plumbline map synth:corr", "plumbline map synth:corridor "),
    ("plumbline render both --robot upst", "plumbline render both --robot upstairs "),
    ("plumbline fuse both --anchor cel", "plumbline fuse both --anchor cellar "),
]


def environment(program):
    return dict(os.environ, PATH=f"{Path(program).resolve().parent}:{os.environ['PATH']}", TERM="dumb", LC_ALL="C.UTF-8")


def run(program, *words):
    return subprocess.run([program, *words], capture_output=True, text=True, check=True).stdout


def commands(program, words=()):
    """All commands, as lists of words, and the help of each."""
    text = run(program, *words, "--help")
    yield list(words), text
    listed = text.split("Subcommands:")[1] if "Subcommands:" in text else ""
    for name in re.findall(r"^  ([a-z]+) ", listed, re.M):
        yield from commands(program, (*words, name))


def check_pages(program, work):
    problems = []
    run(program, "man", "-o", str(work / "man"))
    for words, help_text in commands(program):
        page = work / "man" / ("-".join(["plumbline", *words]) + ".1")
        if not page.exists():
            problems.append(f"{' '.join(words)}: has no page")
            continue
        groff = subprocess.run(["groff", "-man", "-Tutf8", "-ww", "-rF0", "-P-c", str(page)], capture_output=True, text=True)
        problems += [f"{page.name}: {line}" for line in groff.stderr.splitlines()]
        shown = re.sub(r".\x08", "", groff.stdout)
        if page.read_text() != run(program, "man", *words):
            problems.append(f"{page.name}: is not what `plumbline man` prints")
        for heading in ("NAME", "SYNOPSIS", "OPTIONS", "EXIT STATUS", "SEE ALSO"):
            if not re.search(rf"^{heading}$", shown, re.M):
                problems.append(f"{page.name}: has no {heading}")
        for flag in re.findall(r"^  (?:-\w,)?(--[a-z-]+)", help_text, re.M):
            if not re.search(rf"{flag}(?![\w-])", shown):
                problems.append(f"{page.name}: does not have {flag}")
    return problems


def map_two_robots(program, work):
    """A result of robots whose names nothing else has; both see the same."""
    size = ["--frames", "60", "--width", "320", "--height", "240"]
    run(program, "synth", "room", "-o", str(work / "world"), *size, "-q")
    for name in ("upstairs", "cellar"):
        shutil.copytree(work / "world" / "robot0", work / name)
    mapped = subprocess.run([program, "map", "upstairs", "cellar", "-o", "both", "-q"], cwd=work, capture_output=True, text=True)
    assert mapped.returncode == 0, mapped.stderr


class Terminal:
    """A shell that believes in a person."""

    def __init__(self, command, env, folder):
        self.child, self.master = pty.fork()
        if self.child == 0:
            os.chdir(folder)
            os.execvpe(command[0], command, env)

    def type(self, text):
        os.write(self.master, text.encode())

    def read_until(self, wanted, seconds=30.0):
        seen = ""
        end = time.monotonic() + seconds
        while time.monotonic() < end and wanted not in plain(seen):
            if select.select([self.master], [], [], 0.1)[0]:
                try:
                    seen += os.read(self.master, 65536).decode(errors="replace")
                except OSError:
                    break
        return seen

    def close(self):
        os.close(self.master)
        os.waitpid(self.child, 0)


def plain(text):
    """What stays to be read of escapes, bells and carriage returns."""
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]|\x1b[=>()][0-9A-B]?|[\x07\r]", "", text)


def check_typed(shell, setup, env, work):
    """Types every line with a tabulator behind it and has the shell say what stands there."""
    problems = []
    for typed, wanted in COMPLETED:
        terminal = Terminal(shell, env, work)
        terminal.type(setup + "\n")
        terminal.read_until("READY>")
        time.sleep(0.2)
        terminal.type(typed + "\t")
        terminal.read_until(wanted, seconds=10.0)
        # The line becomes an argument: what the shell has made of it comes back in brackets.
        terminal.type("END\x01printf '[%s]\\n' '\x05'\n")
        answer = plain(terminal.read_until("END]", seconds=10.0))
        terminal.close()
        if f"[{wanted}END]" not in answer:
            problems.append(f"{shell[0]}: {typed!r} became {answer.strip().splitlines()[-3:]!r}, not {wanted!r}")
    return problems


def check_bash(program, work):
    script = work / "plumbline.bash"
    script.write_text(run(program, "completion", "bash"))
    setup = f"set +o history; bind 'set enable-bracketed-paste off'; PS1='READ''Y>'; source {script}"
    return check_typed(["bash", "--norc", "--noprofile", "-i"], setup, environment(program), work)


def check_zsh(program, work):
    folder = work / "functions"
    folder.mkdir(exist_ok=True)
    (folder / "_plumbline").write_text(run(program, "completion", "zsh"))
    setup = f"fpath=({folder} $fpath); autoload -U compinit; compinit -u -d {work}/dump; PS1='READ''Y>'"
    return check_typed(["zsh", "-f", "-i"], setup, environment(program), work)


def check_fish(program, work):
    """fish answers what it would offer, by itself."""
    script = work / "plumbline.fish"
    script.write_text(run(program, "completion", "fish"))
    problems = []
    env = dict(environment(program), HOME=str(work), XDG_CONFIG_HOME=str(work / "config"))
    for typed, wanted in COMPLETED:
        answer = subprocess.run(["fish", "--no-config", "-c", f"source {script}; complete -C '{typed}'"], cwd=work, env=env,
                                capture_output=True, text=True)
        words = [line.split("\t")[0] for line in answer.stdout.splitlines()]
        if wanted.split(" ")[-1] not in words and wanted.split()[-1] not in words:
            problems.append(f"fish: {typed!r} offers {words[:5]!r}, not {wanted.split()[-1]!r}; {answer.stderr.strip()}")
    return problems


def main(program, work, case):
    needed = {"man": "groff"}.get(case, case)
    if shutil.which(needed) is None:
        print(f"{needed} is not installed (scripts/install-deps --judges)")
        return SKIPPED
    shutil.rmtree(work, ignore_errors=True)
    (work / "a_recording").mkdir(parents=True)
    if case != "man":
        map_two_robots(program, work)
    check = {"man": check_pages, "bash": check_bash, "zsh": check_zsh, "fish": check_fish}[case]
    problems = check(program, work)
    print("\n".join([*problems, f"{case}: {len(problems)} problems"]))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(str(Path(sys.argv[1]).resolve()), Path(sys.argv[2]).resolve(), sys.argv[3]))
