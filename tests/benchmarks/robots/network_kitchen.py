#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Two robots of one recording and their hub, whatever the network does: network_kitchen.py PROGRAM RECORDING WORK [CASE ...]

RECORDING: a folder in TUM layout with 400 frames; robot a has the even pairs of 0-239, robot b the odd pairs of
160-399, both at --pace 10. Hub and robots run in namespaces of their own, in each case with CYCLONEDDS_URI set to
rubbish. Prints a row for each case: whether all that is promised has the bytes of `plumbline fuse`, and whether each
copy at the hub is its robot's store, table by table; what was sent; breaks; how far the hub was behind. Exit code 1
where a byte differs, 77 where no namespaces can be made.
"""
import filecmp
import json
import os
import shutil
import sqlite3
import subprocess
import sys
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent.parent / "integration"))
from network_links import ENDS, Network, Relay, ip  # noqa: E402

SAME = ["map.ply", "map.pcd", "lines.ply", "robots/a/trajectory.txt", "robots/b/trajectory.txt", "robots/a/keyframes.txt",
        "robots/b/keyframes.txt"]
FUSE = ["--set", "output.views="]
PARTS = {"a": range(0, 240, 2), "b": range(161, 400, 2), "one": range(0, 400, 2)}
LONG_S = 900
CASES = {
    "a": ("no fault", {}),
    "a2": ("no fault, again", {}),
    "b": ("robot b 5 s late", {"late": {"b": 5}}),
    "c": ("hub 5 s late", {"late": {"h": 5}}),
    "d": ("hub killed after 4 and 9 s", {"kill": [(4, "h"), (9, "h")]}),
    "e": ("robot a killed after 6 s", {"kill": [(6, "a")]}),
    "f": ("robot a 22 s without cable", {"cable": (3, 25)}),
    "g": ("5 % loss, 100 ± 50 ms, 20 Mbit/s", {"relay": (0.05, 20e6)}),
    "g2": ("5 % loss, 100 ± 50 ms, 2 Mbit/s", {"relay": (0.05, 2e6)}),
    "h": ("TCP", {"hub": ["--transport", "tcp"], "robot": ["--transport", "tcp", "--peers", ENDS["h"]]}),
    "i": ("with keys", {"keys": True}),
    "j": ("handed in afterwards", {"hand_in": True}),
}


def run(*command):
    done = subprocess.run([str(word) for word in command], check=False, capture_output=True, text=True)
    if done.returncode not in (0, 4):
        raise SystemExit(f"{command}: {done.returncode}\n{done.stderr}")


def part_of(recording, folder, frames):
    """Some frames of a recording, as a recording."""
    folder.mkdir(parents=True)
    for name in ("rgb", "depth", "groundtruth.txt", "camera.yaml"):
        (folder / name).symlink_to(recording / name)
    for name in ("rgb.txt", "depth.txt", "associations.txt"):
        lines = [line for line in (recording / name).read_text().splitlines() if not line.startswith("#")]
        (folder / name).write_text("".join(lines[i] + "\n" for i in frames))


def tables(store):
    with sqlite3.connect(f"file:{store}?mode=ro", uri=True) as database:
        names = [row[0] for row in database.execute("SELECT name FROM sqlite_master WHERE type = 'table'")]
        return {name: database.execute(f"SELECT * FROM {name} ORDER BY 1, 2").fetchall() for name in names}


class Watch(threading.Thread):
    """The most memory that a process had before its map was fused, and when its map.ply was there."""

    def __init__(self, folder):
        super().__init__(daemon=True)
        self.folder, self.pid, self.peak_mb, self.map_at, self.stop = folder, 0, 0.0, None, False

    def run(self):
        partial = self.folder.parent / (self.folder.name + ".partial")
        while not self.stop:
            if self.map_at is None and any((f / "map.ply").exists() for f in (self.folder, partial)):
                self.map_at = time.monotonic()
            try:
                fused = (partial / "fused").exists() or (partial / "fused.partial").exists()
                status = Path(f"/proc/{self.pid}/status").read_text()
                if not fused and "VmHWM" in status:
                    self.peak_mb = max(self.peak_mb, int(status.split("VmHWM:")[1].split()[0]) / 1e3)
            except (OSError, IndexError):
                pass
            time.sleep(0.05)


class Case:
    def __init__(self, program, work, name):
        self.program, self.name, self.folder = program, name, work / name
        self.title, self.what = CASES[name]
        self.ends = {end: self.folder / end for end in ENDS}
        self.running = {}
        shutil.rmtree(self.folder, ignore_errors=True)
        for folder in self.ends.values():
            folder.mkdir(parents=True)

    def command(self, end, resume):
        folder, more = self.ends[end], ["--interface", "net0"] + (["--resume"] if resume else [])
        if self.what.get("keys"):
            more += ["--security", self.folder / "keys" / ("hub" if end == "h" else end)]
        if end == "h":
            return [self.program, "hub", "-o", folder / "out", "--robots", "2", "-v", *FUSE, *more, *self.what.get("hub", [])]
        more += ["--peers", ENDS["h"]] if "relay" in self.what else []
        more += self.what.get("robot", [])
        if self.what.get("hand_in"):
            return [self.program, "robot", folder / end, "--name", end, *more]
        return [self.program, "robot", self.folder.parent / "parts" / end, "-o", folder / end, "--name", end, "--pace", "10",
                "-q", *more]

    def start(self, network, end, resume=False):
        hidden = [other for other in self.ends.values() if other != self.ends[end]]
        with open(self.folder / f"{end}.log", "a") as log:
            self.running[end] = network.run(end, self.command(end, resume), log, hidden)

    def drive(self, network, watch):
        """All that happens, by time."""
        what = self.what
        events = [(what.get("late", {}).get(end, 0), lambda end=end: self.start(network, end)) for end in ENDS]
        for at, end in what.get("kill", []):
            def again(end=end):
                self.running[end].kill()
                self.running[end].wait()
                self.start(network, end, True)
            events.append((at, again))
        for at, state in zip(what.get("cable", ()), ("down", "up")):
            events.append((at, lambda state=state: ip("-n", network.names["h"], "link", "set", "porta", state)))
        began = time.monotonic()
        for at, action in sorted(events, key=lambda event: event[0]):
            time.sleep(max(0.0, began + at - time.monotonic()))
            action()
            watch.pid = self.running["h"].pid if "h" in self.running else 0
        try:
            return began, {end: self.running[end].wait(timeout=LONG_S) for end in "abh"}
        finally:
            for process in self.running.values():
                process.kill()

    def run(self, reference):
        if self.what.get("keys"):
            run(self.program, "keys", "create", self.folder / "keys", "--robots", "a,b")
        if self.what.get("hand_in"):
            for end in "ab":
                shutil.copytree(reference / end, self.ends[end] / end)
        watch = Watch(self.ends["h"] / "out")
        with Network() as network:
            relay = None
            if "relay" in self.what:
                relay = Relay({end: network.tun(end) for end in ENDS}, *self.what["relay"])
                relay.start()
            else:
                network.cables()
            watch.start()
            began, codes = self.drive(network, watch)
            crossed = relay.carried if relay else network.received("a") + network.received("b")
            watch.stop = True
        if relay:
            relay.stop = True
        return self.row(reference, codes, crossed, watch, began)

    def row(self, reference, codes, crossed, watch, began):
        out, wrong = self.ends["h"] / "out", [f"{end} exit {code}" for end, code in codes.items() if code not in (0, 4)]
        fused = reference / "fused"
        if not wrong and self.name == "e":  # its map is another one: it was gone on with
            fused = self.folder / "fused"
            run(self.program, "fuse", self.ends["a"] / "a", self.ends["b"] / "b", "-o", fused, "-q", *FUSE)
        if not wrong:
            wrong += [name for name in SAME if not filecmp.cmp(fused / name, out / name, shallow=False)]
            for end in "ab":
                store = self.ends[end] / end / "map.db"
                if tables(out / "robots" / end / "map.db") != tables(store):
                    wrong.append(f"copy of {end}")
                if (self.name, end) != ("e", "a") and not filecmp.cmp(store, reference / end / "map.db", shallow=False):
                    wrong.append(f"map.db of {end}")
        if not (out / "summary.json").exists():
            return [self.title, "NO: " + ", ".join(wrong), "", "", "", "", "", "", ""]
        told = json.loads((out / "summary.json").read_text())["network"]
        rows = [told[end]["bytes"] for end in "ab"]
        return [self.title, "NO: " + ", ".join(wrong) if wrong else "yes",
                f"{sum(sum(row.values()) for row in rows) / 1e6:.1f} MB",
                f"{sum(told[end]['sent_again_bytes'] for end in 'ab') / 1e6:.1f} MB", f"{crossed / 1e6:.1f} MB",
                f"{max(told[end]['longest_break_s'] for end in 'ab'):.1f} s",
                " / ".join(f"{max(told[end]['lag_s'][what] for end in 'ab'):.2f}" for what in ("median", "p95")) + " s",
                f"{watch.map_at - began:.0f} s" if watch.map_at else "", f"{watch.peak_mb:.0f} MB"]


def main(program, recording, work, names):
    work.mkdir(parents=True, exist_ok=True)
    reference = work / "reference"
    if not (reference / "fused").exists():
        shutil.rmtree(work / "parts", ignore_errors=True)
        shutil.rmtree(reference, ignore_errors=True)
        for name, frames in PARTS.items():
            part_of(recording, work / "parts" / name, frames)
        for end in "ab":
            run(program, "map", work / "parts" / end, "-o", reference / end, "-p", "robot", "-q")
        run(program, "fuse", reference / "a", reference / "b", "-o", reference / "fused", "-q", *FUSE)
    if "one" in names or not names:
        began = time.monotonic()
        run(program, "map", work / "parts/one", "-o", work / "one", "--force", "--pace", "10", "-q", *FUSE)
        print(f"one robot, even pairs of 0-399: {time.monotonic() - began:.0f} s until its map.ply")
    os.environ["CYCLONEDDS_URI"] = "<rubbish"
    print("| case | the bytes of fuse | rows | of these again | over the link | longest break | lag, median / p95 "
          "| until the map | memory of the hub |")
    print("|---|---|---|---|---|---|---|---|---|", flush=True)
    wrong = False
    for name in [name for name in CASES if name in names or not names]:
        row = Case(program, work, name).run(reference)
        wrong = wrong or row[1] != "yes"
        print("| " + " | ".join(row) + " |", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve(), Path(sys.argv[3]).resolve(), sys.argv[4:]))
