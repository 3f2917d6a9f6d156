#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Hub and robots on links of their own: network_links.py PROGRAM FOLDER CASE

Each runs in a network namespace, and does not see the others' folders. Whatever the link does, the hub's map has the
bytes of `plumbline fuse` of the robots' folders.

  cable   Ethernet (veth and a bridge); robot a has no cable for 12 s while it drives
  relay   three TUN devices and a relay between them: 5 % of the packets are lost, the others come 50 to 150 ms later
          and share 20 Mbit/s in each direction; no multicast
  slow    the same without loss at 2 Mbit/s

Exit code 77 with the reason where namespaces or devices cannot be made.
"""
import ctypes
import fcntl
import filecmp
import heapq
import os
import random
import select
import shutil
import socket
import struct
import subprocess
import sys
import threading
import time
from pathlib import Path

LONG_S = 200
SAME = ["map.ply", "lines.ply", "robots/a/trajectory.txt", "robots/b/trajectory.txt"]
ROBOT = ["-q", "--set", "cloud.filters=[]"]
FUSE = ["--set", "output.pcd=off", "--set", "fuse.voxel=3cm", "--set", "output.views=", "--set", "merge.min_pairs=3"]
PARTS = {"a": ["--to", "3"], "b": ["--from", "1.5"]}
ENDS = {"h": "10.91.0.1", "a": "10.91.0.2", "b": "10.91.0.3"}


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def ip(*words, check=True):
    return subprocess.run(["ip", *words], check=check, capture_output=True, text=True)


class Network:
    """Namespaces for hub and robots, which go with it."""

    def __init__(self):
        self.names = {end: f"plumb{os.getpid()}{end}" for end in ENDS}

    def __enter__(self):
        if os.geteuid() != 0 or shutil.which("ip") is None:
            skip("network namespaces want root and the program ip")
        try:
            for name in self.names.values():
                ip("netns", "add", name)
                ip("-n", name, "link", "set", "lo", "up")
        except subprocess.CalledProcessError as error:
            self.__exit__()
            skip(f"no network namespaces here: {error.stderr.strip()}")
        return self

    def __exit__(self, *_):
        for name in self.names.values():
            ip("netns", "del", name, check=False)

    def cables(self):
        """Both robots at a bridge that the hub is on."""
        hub = self.names["h"]
        try:
            ip("-n", hub, "link", "add", "net0", "type", "bridge")
            ip("-n", hub, "addr", "add", ENDS["h"] + "/24", "dev", "net0")
            ip("-n", hub, "link", "set", "net0", "up")
            for end in "ab":
                ip("link", "add", f"port{end}", "netns", hub, "type", "veth", "peer", "name", "net0",
                   "netns", self.names[end])
                ip("-n", hub, "link", "set", f"port{end}", "master", "net0")
                ip("-n", hub, "link", "set", f"port{end}", "up")
                ip("-n", self.names[end], "addr", "add", ENDS[end] + "/24", "dev", "net0")
                ip("-n", self.names[end], "link", "set", "net0", "up")
        except subprocess.CalledProcessError as error:
            self.__exit__()
            skip(f"no veth or bridge here: {error.stderr.strip()}")

    def received(self, end):
        """Bytes that came to the hub from this robot's cable."""
        counters = ip("-n", self.names["h"], "-s", "-j", "link", "show", f"port{end}").stdout
        import json
        return json.loads(counters)[0]["stats64"]["rx"]["bytes"]

    def tun(self, end):
        """The other side of a TUN device in a namespace."""
        ours, theirs = socket.socketpair()
        child = os.fork()
        if child == 0:
            try:
                with open(f"/run/netns/{self.names[end]}") as namespace:
                    if ctypes.CDLL(None, use_errno=True).setns(namespace.fileno(), 0x40000000) != 0:
                        os._exit(1)
                device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
                fcntl.ioctl(device, 0x400454CA, struct.pack("16sH", b"net0", 0x0001 | 0x1000))  # TUN, bare packets
                socket.send_fds(theirs, [b"x"], [device])
                os._exit(0)
            except OSError:
                os._exit(1)
        theirs.close()
        message, devices, _, _ = socket.recv_fds(ours, 1, 1)
        os.waitpid(child, 0)
        if not devices:
            self.__exit__()
            skip("no TUN devices here")
        ip("-n", self.names[end], "addr", "add", ENDS[end] + "/24", "dev", "net0")
        ip("-n", self.names[end], "link", "set", "net0", "up")
        return devices[0]

    def run(self, end, command, log, hidden):
        """In its namespace; folders in `hidden` are empty to it."""
        mounts = "".join(f"mount -t tmpfs none '{folder}' && " for folder in hidden)
        script = f"mount --make-rprivate / && {mounts} exec \"$@\""
        return subprocess.Popen(["ip", "netns", "exec", self.names[end], "unshare", "-m", "sh", "-c", script, "sh",
                                 *map(str, command)], stdout=log, stderr=log, stdin=subprocess.DEVNULL)


class Relay(threading.Thread):
    """Carries packets between TUN devices as a bad link would; the same choices for the same seed."""

    def __init__(self, devices, loss, rate_bit_s):
        super().__init__(daemon=True)
        self.devices, self.loss, self.rate = devices, loss, rate_bit_s
        self.random = random.Random(1)
        self.free_at = {end: 0.0 for end in devices}  # of each one's way out
        self.carried = 0
        self.stop = False

    def run(self):
        to_end = {socket.inet_aton(address): end for end, address in ENDS.items()}
        waiting = []
        count = 0
        while not self.stop:
            now = time.monotonic()
            while waiting and waiting[0][0] <= now:
                _, _, end, packet = heapq.heappop(waiting)
                try:
                    os.write(self.devices[end], packet)
                    self.carried += len(packet)
                except OSError:
                    pass
            left = min(0.05, max(0.0, waiting[0][0] - now)) if waiting else 0.05
            ready, _, _ = select.select(list(self.devices.values()), [], [], left)
            for end, device in self.devices.items():
                if device not in ready:
                    continue
                for _ in range(64):
                    try:
                        packet = os.read(device, 65536)
                    except OSError:
                        break
                    target = to_end.get(packet[16:20])
                    if packet[0] >> 4 != 4 or target is None or self.random.random() < self.loss:
                        continue
                    now = time.monotonic()
                    if self.free_at[end] - now > 0.5:
                        continue  # the queue is full
                    self.free_at[end] = max(now, self.free_at[end]) + len(packet) * 8 / self.rate
                    count += 1
                    at = self.free_at[end] + self.random.uniform(0.05, 0.15)
                    heapq.heappush(waiting, (at, count, target, packet))


def main(program, work, case):
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    folders = {end: work / end for end in ENDS}
    with Network() as network:
        relay = None
        more = {end: [] for end in ENDS}
        if case == "cable":
            network.cables()
        else:
            relay = Relay({end: network.tun(end) for end in ENDS}, 0.05 if case == "relay" else 0.0,
                          20e6 if case == "relay" else 2e6)
            relay.start()
            more["a"] = more["b"] = ["--peers", ENDS["h"]]
        made = subprocess.run([program, "synth", "room", "-o", work / "world", "--frames", "50", "--fps", "10", "--width",
                               "320", "--height", "240", "-q"], check=False)
        assert made.returncode == 0
        for folder in folders.values():
            folder.mkdir()
        started = {}
        began = time.monotonic()
        for end, folder in folders.items():
            hidden = [other for other in folders.values() if other != folder]
            command = ([program, "hub", "-o", folder / "out", "--robots", "2", "-v", "--interface", "net0", *FUSE]
                       if end == "h" else
                       [program, "robot", work / "world/robot0", *PARTS[end], "--name", end, "-o", folder / end, "--pace",
                        "10", "--interface", "net0", *more[end], *ROBOT])
            started[end] = network.run(end, command, open(work / f"{end}.log", "w"), hidden)
        if case == "cable":
            while not (folders["h"] / "out.partial/robots/a/map.db").exists() and time.monotonic() - began < LONG_S:
                time.sleep(0.02)
            ip("-n", network.names["h"], "link", "set", "porta", "down")
            time.sleep(12)
            ip("-n", network.names["h"], "link", "set", "porta", "up")
        codes = {}
        try:
            for end in "abh":
                codes[end] = started[end].wait(timeout=LONG_S)
        finally:
            for process in started.values():
                process.kill()
        spent = time.monotonic() - began
        crossed = network.received("a") if case == "cable" else relay.carried
    logs = "".join(f"--- {end}\n" + (work / f"{end}.log").read_text() for end in ENDS)
    assert codes == {"a": 0, "b": 0, "h": 0}, f"{codes}\n{logs}"
    fused = subprocess.run([program, "fuse", folders["a"] / "a", folders["b"] / "b", "-o", work / "fused", "-q", *FUSE],
                           check=False)
    assert fused.returncode == 0
    for name in SAME:
        assert filecmp.cmp(work / "fused" / name, folders["h"] / "out" / name, shallow=False), f"{name} differs\n{logs}"
    import json
    told = json.loads((folders["h"] / "out/summary.json").read_text())["network"]
    rows = {end: sum(told[end]["bytes"].values()) for end in "ab"}
    least = rows["a"] if case == "cable" else rows["a"] + rows["b"]
    assert crossed >= least, f"{least} bytes of rows, but {crossed} crossed the link: by which side door?"
    assert case != "cable" or told["a"]["longest_break_s"] > 8, f"robot a was done before its cable was out: {told['a']}"
    print(f"{case}: {spent:.0f} s, rows {rows} bytes, over the link {crossed} bytes, "
          f"break {told['a']['longest_break_s']:.1f} s, lag {told['a']['lag_s']}, again {told['a']['sent_again_bytes']} bytes")


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve(), sys.argv[3])
