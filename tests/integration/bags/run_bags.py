#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Bags that programs of others wrote, given to the program: they are mapped to the bytes of the folder that they were
made of, read whatever their encoding, and survive what damaged files hold.

    run_bags.py PROGRAM WORK same|encodings|cut|mutations

PLUMBLINE_DATA has the recordings, PLUMBLINE_JUDGES node_modules with @mcap/core (scripts/install-deps --judges); without
them, or Debian's python3-rosbag, python3-opencv, lz4 and zstd, the test is skipped (exit code 77).
"""
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
PYTHON = "/usr/bin/python3"  # the one that Debian's modules are for
SKIPPED = 77
DOCUMENTED = {0, 2, 3, 4, 5}


def judges():
    given = os.environ.get("PLUMBLINE_JUDGES")
    if given:
        return Path(given)
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    return Path(cache) / "plumbline" / "judges"


def missing():
    """What the test cannot do without, or None."""
    if not os.environ.get("PLUMBLINE_DATA"):
        return "PLUMBLINE_DATA is not set"
    for tool in ("node", "zstd", "lz4"):
        if shutil.which(tool) is None:
            return f"{tool} is not installed"
    if not (judges() / "node_modules/@mcap/core").is_dir():
        return f"{judges()} has no @mcap/core"
    modules = "import cv2, numpy, rosbag, sensor_msgs, tf2_msgs"
    if subprocess.run([PYTHON, "-c", modules], stderr=subprocess.DEVNULL, check=False).returncode != 0:
        return f"{PYTHON} cannot {modules}"
    return None


class Test:
    def __init__(self, program, work):
        self.program, self.work = program, work
        self.failures = 0

    def check(self, holds, what):
        if not holds:
            self.failures += 1
            print(f"FAILED: {what}", flush=True)

    def frames(self, name, recording, count, color, depth, *options):
        out = self.work / name
        data = Path(os.environ["PLUMBLINE_DATA"]) / recording
        subprocess.run([PYTHON, HERE / "make_frames.py", data, out, str(count), color, depth, *options], check=True)
        return out

    def mcap(self, frames, name, compression, *options):
        out = self.work / name
        subprocess.run(["node", HERE / "make_mcap.mjs", frames, out, compression, "cdr", *options], check=True,
                       env={**os.environ, "PLUMBLINE_JUDGES": str(judges())})
        return out

    def db3(self, frames, name, *options):
        messages = self.mcap(frames, name + ".cdr", "none")
        out = self.work / name
        subprocess.run([PYTHON, HERE / "make_db3.py", messages, out, *options], check=True)
        messages.unlink()
        return out

    def rosbag(self, frames, name, compression, *options):
        out = self.work / name
        subprocess.run([PYTHON, HERE / "make_rosbag.py", frames, out, compression, *options], check=True)
        return out

    def run(self, *arguments, limit_kb=None, timeout=300):
        command = [str(self.program), *map(str, arguments)]
        if limit_kb:
            command = ["bash", "-c", f'ulimit -v {limit_kb}; exec "$@"', "_", *command]
        return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace",
                              timeout=timeout, check=False)

    def map(self, recording, name):
        out = self.work / name
        done = self.run("map", recording, "-o", out, "-q", "--force")
        self.check(done.returncode in (0, 4), f"map {recording}: {done.returncode} {done.stderr}")
        return {part: (out / part).read_bytes() if (out / part).exists() else None
                for part in ("trajectory.txt", "map.ply")}

    def expect_same_maps(self, reference, recordings):
        expected = self.map(reference, "map_reference")
        self.check(all(expected.values()), f"{reference} is mapped")
        for recording in recordings:
            mapped = self.map(recording, "map_bag")
            for part, content in expected.items():
                self.check(mapped[part] == content, f"{recording.name}: {part} is that of the folder")
            print(f"{recording.name}: mapped as the folder", flush=True)

    def expect_same_images(self, reference, bag, tolerance_m=0.0):
        """The bag as a folder, image by image as OpenCV reads it."""
        out = self.work / "copied"
        done = self.run("convert", bag, out, "-q", "--force")
        self.check(done.returncode == 0, f"convert {bag}: {done.stderr}")
        script = HERE / "compare_folders.py"
        same = subprocess.run([PYTHON, script, reference, out, str(tolerance_m)], stdout=subprocess.PIPE, text=True,
                              check=False)
        self.check(same.returncode == 0, f"{bag.name}: {same.stdout}")
        print(f"{bag.name}: {same.stdout.strip()}", flush=True)


def same(test):
    frames = test.frames("icl", "icl_nuim_of_kt0_a", 50, "rgb8", "16UC1")
    bags = [test.mcap(frames, f"icl_{c}.mcap", c) for c in ("none", "zstd", "lz4")]
    bags += [test.db3(frames, "icl_db3", "split=3"), test.rosbag(frames, "icl.bag", "lz4")]
    test.expect_same_maps(frames / "folder", bags)
    shutil.rmtree(frames)
    for bag in bags:
        shutil.rmtree(bag) if bag.is_dir() else bag.unlink()

    frames = test.frames("kitchen", "7scenes_redkitchen_a", 60, "jpeg", "32FC1")
    test.expect_same_maps(frames / "folder", [test.mcap(frames, "kitchen.mcap", "zstd")])
    shutil.rmtree(frames)
    frames = test.frames("kitchen_raw", "7scenes_redkitchen_a", 60, "bgr8", "32FC1")
    test.expect_same_maps(frames / "folder", [test.mcap(frames, "kitchen_raw.mcap", "lz4")])
    shutil.rmtree(frames)
    frames = test.frames("rvl", "icl_nuim_of_kt0_a", 20, "png", "rvl")
    test.expect_same_maps(frames / "folder", [test.mcap(frames, "rvl.mcap", "zstd")])


def encodings(test):
    kinds = [("bgr8", "png"), ("rgba8", "mono16"), ("bgra8", "16UC1"), ("8UC3", "rvl"), ("png", "16UC1"),
             ("mono8", "16UC1"), ("yuyv", "32FC1"), ("yuv422", "16UC1")]
    for color, depth in kinds:
        frames = test.frames(f"{color}_{depth}", "icl_nuim_of_kt0_a", 4, color, depth)
        test.expect_same_images(frames / "folder", test.mcap(frames, f"{color}_{depth}.mcap", "zstd"))
    frames = test.frames("png32", "7scenes_redkitchen_a", 4, "jpeg", "png32")
    test.expect_same_images(frames / "folder", test.mcap(frames, "png32.mcap", "zstd"), 0.0002)

    frames = test.frames("unaligned", "icl_nuim_of_kt0_a", 4, "rgb8", "16UC1", "--unaligned")
    for bag in (test.mcap(frames, "unaligned.mcap", "zstd"), test.rosbag(frames, "unaligned.bag", "none"),
                test.rosbag(frames, "realsense.bag", "none", "realsense")):
        test.expect_same_images(frames / "folder", bag)
        camera = (test.work / "copied/camera.yaml").read_text()
        test.check("color_from_depth" in camera and "0.025" in camera, f"{bag.name}: how depth sits is known")

    frames = test.frames("ways", "icl_nuim_of_kt0_a", 6, "rgb8", "16UC1")
    packed = test.mcap(frames, "packed.mcap", "none")
    subprocess.run(["zstd", "-q", "-f", packed], check=True)
    ways = [packed.with_name("packed.mcap.zst"), test.mcap(frames, "open.mcap", "none", "nochunks", "noindex"),
            test.db3(frames, "killed", "wal", "no-metadata"), test.db3(frames, "single", "message-zstd"),
            test.rosbag(frames, "bz2.bag", "bz2"), test.rosbag(frames, "aligned.bag", "none", "realsense")]
    ways[0] = ways[0].rename(packed.with_name("packed.mcap.zstd"))
    for bag in ways:
        test.expect_same_images(frames / "folder", bag)
    region(test)


def region(test):
    """CameraInfo of a larger picture, of which the images are a binned part: the camera is that of the images."""
    frames = test.frames("region", "icl_nuim_of_kt0_a", 2, "rgb8", "16UC1")
    said = json.loads((frames / "frames.json").read_text())
    camera = camera_line(test.run("info", frames / "folder").stdout)
    for binning in (1, 2):
        x, y = 2 * 50, 2 * 30
        full = dict(said)
        fx, _, cx, _, fy, cy = said["k"][:6]
        full["k"] = [fx * binning, 0, (cx + 0.5) * binning - 0.5 + x, 0, fy * binning,
                     (cy + 0.5) * binning - 0.5 + y, 0, 0, 1]
        full["roi"] = {"x_offset": x, "y_offset": y, "width": binning * said["width"], "height": binning * said["height"]}
        full["width"], full["height"] = full["roi"]["width"] + x + 20, full["roi"]["height"] + y + 10
        full["binning"] = binning
        (frames / "frames.json").write_text(json.dumps(full))
        for bag in (test.mcap(frames, f"region{binning}.mcap", "zstd"), test.rosbag(frames, f"region{binning}.bag", "none")):
            told = camera_line(test.run("info", bag).stdout)
            test.check(camera and told == camera, f"{bag.name}: the camera is {told}, not {camera}")
            print(f"{bag.name}: camera {told}", flush=True)


def camera_line(text):
    """Size and pinhole of what `info` prints."""
    return next((line.split(", ", 1)[1].split(", depth")[0] for line in text.splitlines()
                 if line.startswith("camera: ")), "")


def cut(test):
    frames = test.frames("cut", "icl_nuim_of_kt0_a", 8, "rgb8", "16UC1")
    for bag in (test.mcap(frames, "whole.mcap", "zstd"), test.rosbag(frames, "whole.bag", "lz4"),
                test.mcap(frames, "unfinished.mcap", "lz4", "unfinished")):
        data = bag.read_bytes()
        for share in (0.3, 0.6, 0.95):
            part = test.work / ("cut" + bag.suffix)
            part.write_bytes(data[: int(share * len(data))])
            done = test.run("info", part)
            test.check(done.returncode == 0, f"{bag.name} cut at {share}: {done.stderr}")
            test.check("cut off or damaged at byte" in done.stdout, f"{bag.name} cut at {share}: it is told")
            print(f"{bag.name} cut at {share}: {[l for l in done.stdout.splitlines() if l.startswith('pairs')]}", flush=True)


def processor_time():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def mutations(test, count=500, budget_s=400):
    """Any byte of small bags changed, taken out or doubled; 2 GB of memory, 10 s of a processor."""
    rng = random.Random(1)
    corpus = sorted((HERE.parents[1] / "fuzz/corpus/bag").iterdir())
    begin, done, codes = time.monotonic(), 0, {}
    for done in range(1, count + 1):
        source = rng.choice(corpus)
        data = bytearray(source.read_bytes())
        for _ in range(rng.randint(1, 4)):
            place, length = rng.randrange(len(data)), rng.randint(1, 64)
            kind = rng.randrange(4)
            if kind == 0:
                data[place] = rng.randrange(256)
            elif kind == 1:
                del data[place:place + length]
            elif kind == 2:
                data[place:place] = data[place:place + length]
            else:
                data[place:place + 8] = rng.choice([b"\xff" * 8, b"\x00" * 8, b"\xff\xff\xff\x7f" * 2])
        bag = test.work / ("mutated" + source.suffix)
        bag.write_bytes(data)
        before = processor_time()
        outcome = test.run("info", bag, limit_kb=2_000_000, timeout=60)
        codes[outcome.returncode] = codes.get(outcome.returncode, 0) + 1
        slow = processor_time() - before > 10
        if outcome.returncode not in DOCUMENTED or slow:
            kept = test.work / f"finding_{done}{source.suffix}"
            shutil.copy(bag, kept)
            test.check(False, f"{kept}: {outcome.returncode} {outcome.stderr[-300:]}")
        if time.monotonic() - begin > budget_s:
            break
    print(f"{done} mutated bags, exit codes {codes}", flush=True)
    test.check(done >= min(count, 100), "enough of them were tried")


def main():
    program, work, case = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    why = missing() if case != "mutations" else None
    if why:
        print(f"skipped: {why}")
        return SKIPPED
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    test = Test(program, work)
    {"same": same, "encodings": encodings, "cut": cut, "mutations": mutations}[case](test)
    if test.failures == 0:
        shutil.rmtree(work, ignore_errors=True)
    return 1 if test.failures else 0


sys.exit(main())
