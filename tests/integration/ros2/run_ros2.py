#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Cameras on ROS 2's network, played and mapped by the program on one machine: run_ros2.py PROGRAM WORK CASE

    live      600 frames at 30 Hz: nearly all are taken, and what was recorded of them maps to the same bytes
    messages  what is told when there is no camera, or no certain one, and when addresses make no sense
    robots    two robots and their hub publish, and are told apart by name; the judge listens to the hub
    judge     what a run publishes is received by @foxglove/ros2 on Node (scripts/install-deps --judges; without it the
              exit code is 77)
"""
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
SKIPPED = 77
FILES = ["trajectory.txt", "keyframes.txt", "keyframes.csv", "frames.csv", "lines.ply", "map.ply", "map.pcd", "camera.yaml"]
RATE_HZ = 30


def judges():
    given = os.environ.get("PLUMBLINE_JUDGES")
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "plumbline/judges"
    return (Path(given) if given else cache) / "node_modules"


def check(condition, message):
    if not condition:
        raise AssertionError(message)


class Case:
    def __init__(self, program, work):
        self.program, self.work = program, work
        # Domains apart from those of tests side by side, and of the user.
        self.domain = 40 + os.getpid() % 90

    def address(self, more=""):
        return f"ros2://{self.domain}?interface=lo{more}"

    def start(self, *arguments, log):
        out = open(self.work / log, "w", encoding="utf-8")
        return subprocess.Popen([self.program, *map(str, arguments)], stdout=out, stderr=subprocess.STDOUT)

    def run(self, *arguments, code=0, timeout=600):
        done = subprocess.run([self.program, *map(str, arguments)], capture_output=True, text=True, timeout=timeout,
                              check=False)
        text = done.stdout + done.stderr
        check(done.returncode == code, f"{arguments}: exit code {done.returncode}, not {code}\n{text}")
        return text

    def log(self, name):
        return (self.work / name).read_text(encoding="utf-8")

    def world(self, frames):
        """A generated room on disk."""
        folder = self.work / "room"
        self.run("synth", "room", "-o", folder, "--frames", frames, "--seed", 1, "-q")
        return folder / "robot0"

    def to_and_fro(self, room, frames):
        """The room's frames again and again, forwards and backwards, 30 a second."""
        folder = self.work / "long"
        for kind in ("rgb", "depth"):
            (folder / kind).mkdir(parents=True)
        lines = [line.split() for line in (room / "associations.txt").read_text().splitlines() if not line.startswith("#")]
        turn = list(range(len(lines))) + list(range(len(lines) - 2, 0, -1))
        with open(folder / "associations.txt", "w", encoding="utf-8") as out:
            for i in range(frames):
                _, color, _, depth = lines[turn[i % len(turn)]]
                stamp = f"{100 + i / RATE_HZ:.6f}"
                # Each image has a name of its own: one that is named a second time is not used.
                os.link(room / color, folder / "rgb" / f"{i}.png")
                os.link(room / depth, folder / "depth" / f"{i}.png")
                out.write(f"{stamp} rgb/{i}.png {stamp} depth/{i}.png\n")
        shutil.copy(room / "camera.yaml", folder)
        return folder

    def end(self, process, name, code=0, timeout=600):
        got = process.wait(timeout)
        check(got == code, f"exit code {got}, not {code}\n{self.log(name)}")


def live(case):
    frames = 600
    recording = case.to_and_fro(case.world(60), frames)
    record = case.work / "taken.mcap"
    mapping = case.start("map", case.address(), "-o", case.work / "live", "--record", record, log="map.log")
    playing = case.start("play", recording, case.address(), "--wait", 60, log="play.log")
    case.end(playing, "play.log")
    time.sleep(1.0)
    mapping.send_signal(signal.SIGINT)
    case.end(mapping, "map.log", timeout=1200)

    summary = json.loads((case.work / "live/summary.json").read_text())
    taken = summary["live"]["taken"]
    print(f"{taken} of {frames} frames were taken: {summary['live']}; {case.log('play.log').strip()}")
    check(taken >= 0.99 * frames, f"{taken} of {frames} frames were taken\n{case.log('map.log')}")
    check(f"{taken} of" in case.log("map.log"), "the summary does not tell how many frames were taken")
    check(not summary["stopped"], "a live run that is ended is not cut off")

    case.run("map", record, "-o", case.work / "again", "-q", timeout=1200)
    for name in FILES:
        # The robot is named after the network's domain, and after the record.
        live_bytes, again_bytes = ((case.work / folder / name).read_bytes() for folder in ("live", "again"))
        robot = f"ros2_{case.domain}".encode()
        same = live_bytes.replace(robot, b"taken") == again_bytes
        check(same, f"{name} is another one when the recording is mapped")
    print("the recording gives the same bytes")


def messages(case):
    text = case.run("map", case.address(), "-o", case.work / "none", code=3)
    check("nothing at all is published" in text and "ROS_DOMAIN_ID" in text, text)
    for address, word in (("ros2://x", "is not a domain"), ("ros2://7?colour=/a", "'colour' is not a setting"),
                          ("ros2://300", "--domain"), ("ros2://7?interface=none0", "no interface")):
        check(word in case.run("map", address, "-o", case.work / "none", code=2), address)
    check("is live" in case.run("map", case.address(), "-o", case.work / "none", "--from", 1, code=2), "--from")
    check("plumbline map" in case.run("convert", case.address(), case.work / "copy", code=2), "convert")

    room = case.world(10)
    playing = case.start("play", room, case.address(), "--loop", "--wait", 0, log="play.log")
    try:
        time.sleep(1.0)
        text = case.run("map", case.address("&color=/other/image"), "-o", case.work / "none", code=2)
        check("/camera/color/image_raw" in text, text)
        text = case.run("info", case.address())
        check("colour: /camera/color/image_raw" in text and "sensor_msgs/CameraInfo" in text, text)
        text = case.run("map", case.address(), "-o", case.work / "short", "--for", "2s", "--record", case.work / "short.txt",
                        code=2)
        check("ends in .mcap" in text, text)
        for size, word in (("1MB", "64MB or more"), ("much", "much"), ("100 parsecs", "unit")):
            text = case.run("map", case.address(), "-o", case.work / "short", "--max-memory", size, code=2)
            check(word in text, text)
        text = case.run("map", room, "-o", case.work / "short", "--max-memory", "128MB", code=2)
        check("are for live cameras" in text, text)
        text = case.run("map", case.address(), "-o", case.work / "short", "--for", "2s", "--max-memory", "128MB")
        check("up to 128 MB of frames wait" in text, text)
        check("received frames were mapped" in text, text)
    finally:
        playing.send_signal(signal.SIGINT)
        case.end(playing, "play.log")


def has_route():
    """Whether there is an interface beside lo: the judge finds others by multicast only."""
    routes = Path("/proc/net/route").read_text(encoding="utf-8").splitlines()[1:]
    return any(line.split()[1] == "00000000" for line in routes)


def listen(case, *arguments):
    """The judge, once it listens."""
    listening = subprocess.Popen(["node", HERE / "judge_ros2.mjs", str(case.domain), *map(str, arguments)],
                                 env={**os.environ, "JUDGES": str(judges())}, stdout=subprocess.PIPE,
                                 stderr=open(case.work / "judge.log", "w", encoding="utf-8"), text=True)
    time.sleep(3.0)
    return listening


def check_poses(case, room):
    """Poses of frames that were located in a finished map, and their covariance: row by row, metres and radians."""
    listening = listen(case, "plumbline", 300, "plumbline", "pose")
    case.run("localize", case.work / "out", room, "-o", case.work / "located", "--publish", f"ros2://{case.domain}", "-q")
    heard, _ = listening.communicate(timeout=60)
    check(listening.returncode == 0, f"no pose was heard: {heard}\n{case.log('judge.log')}")
    pose = json.loads(heard)["pose"]
    print(json.dumps(pose))

    rows = [line.split() for line in (case.work / "located/trajectory.txt").read_text().splitlines() if line[0] != "#"]
    check(pose["frame"] == "map", pose)
    check(0.5 * len(rows) <= pose["messages"] <= len(rows), f"{pose['messages']} poses of {len(rows)} located frames")
    off = sum((pose["last"][axis] - float(value)) ** 2 for axis, value in zip("xyz", rows[-1][1:4])) ** 0.5
    check(off < 0.01, f"the last pose lies {off:.3f} m beside that of trajectory.txt")
    matrix = pose["covariance"]
    check(len(matrix) == 36 and all(0.0 < matrix[7 * i] < 0.01 for i in range(6)), matrix)
    check(all(abs(matrix[6 * i + j] - matrix[6 * j + i]) < 1e-12 for i in range(6) for j in range(6)), matrix)


def judge(case):
    if shutil.which("node") is None or not (judges() / "@foxglove/ros2").is_dir():
        print(f"no @foxglove/ros2 in {judges()}")
        return SKIPPED
    if not has_route():
        print("no network whose multicast the judge could listen to")
        return SKIPPED
    room = case.world(60)
    listening = listen(case, "plumbline", 300)
    case.run("map", room, "-o", case.work / "out", "--publish", f"ros2://{case.domain}", "-q")
    heard, _ = listening.communicate(timeout=60)
    check(listening.returncode == 0, f"nothing was heard: {heard}\n{case.log('judge.log')}")
    told = json.loads(heard)
    print(json.dumps(told))

    summary = json.loads((case.work / "out/summary.json").read_text())
    check(told["map"]["points"] == summary["cloud"]["points"], f"{told['map']} of {summary['cloud']}")
    check(told["map"]["frame"] == "map" and told["map"]["fields"] == ["x@0", "y@4", "z@8", "rgb@12"], told["map"])
    check(told["path"]["poses"] == summary["frames"]["tracked"], told["path"])
    check({"map -> odom", "odom -> camera"} <= set(told["tf"]["chains"]), told["tf"])
    check(told["tf"]["messages"] > 5, told["tf"])
    check(told["points"]["messages"] >= 1, told["points"])
    case.run("map", room, "-o", case.work / "silent", "-q")
    for name in FILES:
        same = (case.work / "out" / name).read_bytes() == (case.work / "silent" / name).read_bytes()
        check(same, f"{name} is another one when it is published")
    check_poses(case, room)
    return 0


def robots(case):
    if shutil.which("node") is None or not (judges() / "@foxglove/ros2").is_dir() or not has_route():
        print(f"no @foxglove/ros2 in {judges()}, or no network that it could listen to")
        return SKIPPED
    listening = listen(case, "plumbline", 400, "r0")
    # Robots and hub have a domain of their own; what they publish is in another one.
    lan = ["--interface", "lo", "--domain", case.domain + 95]
    publish = ["--publish", f"ros2://{case.domain}"]
    hub = case.start("hub", "-o", case.work / "hub", "--robots", 2, *lan, *publish, log="hub.log")
    world = "synth:room?frames=240&seed=1"
    first = case.start("robot", world, "--to", 6, "--name", "r0", "-o", case.work / "r0", *lan, *publish, log="r0.log")
    second = case.start("robot", world, "--from", 2, "--name", "r1", "-o", case.work / "r1", *lan, log="r1.log")
    for process, name in ((first, "r0.log"), (second, "r1.log"), (hub, "hub.log")):
        case.end(process, name, timeout=900)
    heard, _ = listening.communicate(timeout=120)
    check(listening.returncode == 0, f"nothing was heard of the hub: {heard}\n{case.log('judge.log')}")
    told = json.loads(heard)
    print(json.dumps(told))

    summary = json.loads((case.work / "hub/summary.json").read_text())
    check(told["map"]["points"] == summary["cloud"]["points"], f"{told['map']} of {summary['cloud']}")
    check(told["map"]["frame"] == "map", told["map"])
    chains = set(told["tf"]["chains"])
    check({"r0/map -> r0/odom", "r0/odom -> r0/camera"} <= chains, chains)
    check("r1/odom -> r1/camera" in chains, f"the hub tells where r1 is: {chains}")
    check({"map -> r0/map", "map -> r1/map"} <= chains, f"the hub tells where maps lie: {chains}")
    check(told["path"]["messages"] > 0 and told["points"]["messages"] > 0, told)
    return 0


def main():
    program, work, name = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve(), sys.argv[3]
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    return {"live": live, "messages": messages, "judge": judge, "robots": robots}[name](Case(program, work)) or 0


if __name__ == "__main__":
    sys.exit(main())
