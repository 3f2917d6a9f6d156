#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One recording in the layouts that people have: layouts.py PROGRAM FOLDER [RECORDING [NAME...]]

Writes RECORDING (default: icl_nuim_of_kt0_a in PLUMBLINE_DATA; a TUM folder with associations.txt, groundtruth.txt and a
camera.yaml without distortion) into FOLDER in each layout with numpy, OpenCV and ffmpeg, maps all of them and compares
their absolute trajectory errors with that of RECORDING. Exit code 77 with the reason where one of these is missing.
"""
import json
import os
import re
import shutil
import struct
import subprocess
import sys

os.environ["OPENCV_IO_ENABLE_OPENEXR"] = "1"
try:
    import cv2
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}; scripts/install-deps --judges brings it for /usr/bin/python3")
    sys.exit(77)

WORLD = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], float)  # of ARKit's axes: z up from y up
FLIP = np.diag([1.0, -1.0, -1.0])  # camera axes: OpenCV's from ARKit's
AZURE_COLOR = [0.33, -2.489, 1.4537, 0.2089, -2.3029, 1.3751, -0.00013, -0.00016]  # k1 ... k6, p2, p1
AZURE_DEPTH = [6.084, 4.375, 0.2362, 6.409, 6.418, 1.2202, 6.5e-5, -5.5e-5]


class Recording:
    """Colour, raw depth and world_from_camera of each pair."""

    def __init__(self, folder):
        self.folder = folder
        rows = [line.split() for line in open(f"{folder}/associations.txt") if line.strip() and line[0] != "#"]
        self.rows = rows[:60]
        text = open(f"{folder}/camera.yaml").read()
        keys = {m[1]: float(m[2]) for m in re.finditer(r"^(fx|fy|cx|cy|width|height|depth_scale):\s*([-\d.]+)", text, re.M)}
        self.camera_yaml = text
        self.k = np.array([[keys["fx"], 0, keys["cx"]], [0, keys["fy"], keys["cy"]], [0, 0, 1]])
        self.size = (int(keys["width"]), int(keys["height"]))
        self.scale = keys["depth_scale"]
        truth = "groundtruth_sfm.txt" if os.path.exists(f"{folder}/groundtruth_sfm.txt") else "groundtruth.txt"
        self.truth_file = f"{folder}/{truth}"
        lines = [line.split() for line in open(f"{folder}/groundtruth.txt") if line.strip() and line[0] != "#"]
        self.truth = np.array(lines, float)

    def __len__(self):
        return len(self.rows)

    def stamp(self, i):
        return float(self.rows[i][0])

    def color(self, i):
        return cv2.imread(f"{self.folder}/{self.rows[i][1]}")

    def metres(self, i):
        return (cv2.imread(f"{self.folder}/{self.rows[i][3]}", -1) / self.scale).astype(np.float32)

    def millimetres(self, i):
        return np.round(self.metres(i) * 1000).astype(np.uint16)

    def pose(self, i):
        row = self.truth[np.argmin(np.abs(self.truth[:, 0] - self.stamp(i)))]
        x, y, z, w = row[4:8]
        m = np.eye(4)
        m[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
        m[:3, 3] = row[1:4]
        return m


def fresh(folder, *inside):
    shutil.rmtree(folder, ignore_errors=True)
    for name in inside or ("",):
        os.makedirs(f"{folder}/{name}")
    return folder


def write(file, text):
    with open(file, "w") as out:
        out.write(text)


def resized(k, size, to):
    """The camera matrix of an image resized: the middle of the first pixel is at 0."""
    sx, sy = to[0] / size[0], to[1] / size[1]
    return np.array([[k[0, 0] * sx, 0, (k[0, 2] + 0.5) * sx - 0.5], [0, k[1, 1] * sy, (k[1, 2] + 0.5) * sy - 0.5], [0, 0, 1]])


def quaternion(r):
    """x y z w, by the axis and the angle."""
    vector = cv2.Rodrigues(r)[0].ravel()
    angle = np.linalg.norm(vector)
    axis = vector / angle if angle > 0 else vector
    return [*(axis * np.sin(angle / 2)), np.cos(angle / 2)]


def arkit(pose):
    m = np.eye(4)
    m[:3, :3] = WORLD.T @ pose[:3, :3] @ FLIP
    m[:3, 3] = WORLD.T @ pose[:3, 3]
    return m


def lens_maps(rec, k, size, rays_of):
    """Where the recording shows what another camera sees; `rays_of` undistorts its normalised pixels."""
    u, v = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
    bent = np.stack([(u - k[0, 2]) / k[0, 0], (v - k[1, 2]) / k[1, 1]], -1).reshape(-1, 1, 2)
    rays = rays_of(bent).reshape(size[1], size[0], 2)
    x = (rays[..., 0] * rec.k[0, 0] + rec.k[0, 2]).astype(np.float32)
    y = (rays[..., 1] * rec.k[1, 1] + rec.k[1, 2]).astype(np.float32)
    return x, y


def seen(image, maps, nearest):
    how = cv2.INTER_NEAREST if nearest else cv2.INTER_CUBIC
    border = cv2.BORDER_CONSTANT if nearest else cv2.BORDER_REPLICATE
    return cv2.remap(image, maps[0], maps[1], how, borderMode=border)


def camera_yaml(k, size, scale, more=""):
    return (f"model: pinhole\nwidth: {size[0]}\nheight: {size[1]}\nfx: {k[0, 0]}\nfy: {k[1, 1]}\ncx: {k[0, 2]}\n"
            f"cy: {k[1, 2]}\ndepth_scale: {scale}\n{more}")


def seven_scenes(rec, d):
    fresh(d)
    for i in range(len(rec)):
        cv2.imwrite(f"{d}/frame-{i:06d}.color.png", rec.color(i))
        cv2.imwrite(f"{d}/frame-{i:06d}.depth.png", rec.millimetres(i))
        np.savetxt(f"{d}/frame-{i:06d}.pose.txt", rec.pose(i))
    write(f"{d}/camera.yaml", camera_yaml(rec.k, rec.size, 1000))


def tartanair(rec, d):
    fresh(d, "image_left", "depth_left")
    axes = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], float)  # forward right down from right down forward
    rows = []
    for i in range(len(rec)):
        cv2.imwrite(f"{d}/image_left/{i:06d}_left.png", rec.color(i))
        np.save(f"{d}/depth_left/{i:06d}_left_depth.npy", rec.metres(i))
        pose = rec.pose(i)
        rows.append([*(FLIP @ pose[:3, 3]), *quaternion(FLIP @ pose[:3, :3] @ axes.T)])
    np.savetxt(f"{d}/pose_left.txt", np.array(rows))
    write(f"{d}/camera.yaml", camera_yaml(rec.k, rec.size, 5000))


def record3d(rec, d):
    fresh(d, "EXR_RGBD/rgb", "EXR_RGBD/depth")
    poses, stamps = [], []
    for i in range(len(rec)):
        cv2.imwrite(f"{d}/EXR_RGBD/rgb/{i}.jpg", rec.color(i), [cv2.IMWRITE_JPEG_QUALITY, 97])
        cv2.imwrite(f"{d}/EXR_RGBD/depth/{i}.exr", rec.metres(i))
        m = arkit(rec.pose(i))
        poses.append([*quaternion(m[:3, :3]), *m[:3, 3]])
        stamps.append(i / 30)
    write(f"{d}/EXR_RGBD/metadata.json",
          json.dumps({"w": rec.size[0], "h": rec.size[1], "fps": 30, "K": list(rec.k.T.ravel()), "poses": poses,
                      "frameTimestamps": stamps}))


def polycam(rec, d, every=1):
    """Each frame with a focal length of its own, as a lens that focuses has."""
    fresh(d, "keyframes/images", "keyframes/depth", "keyframes/confidence", "keyframes/cameras")
    size, small = (1024, 768), (256, 192)
    for i in range(0, len(rec), every):
        name = f"{1000000 + i * 33333}"
        grow = 1 + 0.01 * np.sin(0.3 * i)
        k = resized(rec.k, rec.size, size)
        k[0, 0] *= grow
        k[1, 1] *= grow
        maps = lens_maps(rec, k, size, lambda rays: rays)
        cv2.imwrite(f"{d}/keyframes/images/{name}.jpg", seen(rec.color(i), maps, False), [cv2.IMWRITE_JPEG_QUALITY, 97])
        maps = lens_maps(rec, resized(k, size, small), small, lambda rays: rays)
        cv2.imwrite(f"{d}/keyframes/depth/{name}.png", seen(rec.millimetres(i), maps, True))
        cv2.imwrite(f"{d}/keyframes/confidence/{name}.png", np.full(small[::-1], 255, np.uint8))
        m = arkit(rec.pose(i))
        camera = {f"t_{r}{c}": m[r, c] for r in range(3) for c in range(4)}
        camera.update(fx=k[0, 0], fy=k[1, 1], cx=k[0, 2], cy=k[1, 2], width=size[0], height=size[1], blur_score=1.0)
        write(f"{d}/keyframes/cameras/{name}.json", json.dumps(camera))


def tum_lists(rec, d, color, depth, camera, extension=".png"):
    fresh(d, "rgb", "depth")
    rows = ""
    for i in range(len(rec)):
        cv2.imwrite(f"{d}/rgb/{i}.png", color(i))
        cv2.imwrite(f"{d}/depth/{i}{extension}", depth(i))
        rows += f"{rec.rows[i][0]} rgb/{i}.png {rec.rows[i][0]} depth/{i}{extension}\n"
    write(f"{d}/associations.txt", rows)
    write(f"{d}/camera.yaml", camera)


def two_sizes(rec, d):
    """Colour of twice the size, one calibration for both."""
    big = (2 * rec.size[0], 2 * rec.size[1])
    tum_lists(rec, d, lambda i: cv2.resize(rec.color(i), big, interpolation=cv2.INTER_CUBIC), rec.millimetres,
              camera_yaml(resized(rec.k, rec.size, big), big, 1000))


def fisheye(rec, d):
    k = rec.k * [[0.83], [0.835], [1]] + [[0, 0, 0.17 * rec.k[0, 2] + 1.5], [0, 0, 0.165 * rec.k[1, 2] - 1.5], [0, 0, 0]]
    bend = np.array([-0.02, 0.003, -0.001, 0.0002])
    maps = lens_maps(rec, k, rec.size, lambda rays: cv2.fisheye.undistortPoints(rays, np.eye(3), bend))
    tum_lists(rec, d, lambda i: seen(rec.color(i), maps, False), lambda i: seen(rec.millimetres(i), maps, True),
              camera_yaml(k, rec.size, 1000).replace("pinhole", "equidistant") + f"distortion: {bend.tolist()}\n")


def azure_kinect(rec, d):
    """A 720P colour and an NFOV_UNBINNED depth camera at one place, both with their lenses."""
    fresh(d, "raw")

    def mode(p, sensor, crop, size, k):
        matrix = np.array([[p[2] * sensor[0], 0, p[0] * sensor[0] - crop[0] - 0.5],
                           [0, p[3] * sensor[1], p[1] * sensor[1] - crop[1] - 0.5], [0, 0, 1]])
        opencv = np.array([k[0], k[1], k[7], k[6], k[2], k[3], k[4], k[5]])
        steps = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
        undistort = lambda rays: cv2.undistortPointsIter(rays, np.eye(3), opencv, None, None, steps)
        return size, lens_maps(rec, matrix, size, undistort)

    color_at, depth_at = [0.4998, 0.5066, 0.478, 0.6374], [0.5123, 0.4945, 0.4921, 0.4922]
    color_size, color_maps = mode(color_at, (1280, 960), (0, 120), (1280, 720), AZURE_COLOR)
    depth_size, depth_maps = mode(depth_at, (1024, 1024), (192, 180), (640, 576), AZURE_DEPTH)
    with open(f"{d}/depth.raw", "wb") as raw:
        for i in range(len(rec)):
            cv2.imwrite(f"{d}/raw/{i:06d}.jpg", seen(rec.color(i), color_maps, False), [cv2.IMWRITE_JPEG_QUALITY, 97])
            raw.write(seen(rec.millimetres(i), depth_maps, True).astype(">u2").tobytes())

    def camera(purpose, at, k):
        return {"Purpose": f"CALIBRATION_CameraPurpose{purpose}", "Rt": {"Rotation": [1, 0, 0, 0, 1, 0, 0, 0, 1], "Translation": [0, 0, 0]},
                "Intrinsics": {"ModelType": "CALIBRATION_LensDistortionModelBrownConrady", "ModelParameterCount": 14,
                               "ModelParameters": [*at, *k[:6], 0, 0, *k[6:]]}}

    write(f"{d}/calibration.json", json.dumps({"CalibrationInformation": {"Cameras": [
        camera("Depth", depth_at, AZURE_DEPTH), camera("PhotoVideo", color_at, AZURE_COLOR)]}}))
    subprocess.run(
        ["ffmpeg", "-v", "error", "-y", "-framerate", "30", "-i", f"{d}/raw/%06d.jpg", "-f", "rawvideo", "-pix_fmt", "gray16be", "-s",
         "640x576", "-framerate", "30", "-i", f"{d}/depth.raw", "-map", "0:v", "-map", "1:v", "-c:v:0", "copy", "-c:v:1", "rawvideo",
         "-pix_fmt:v:1", "gray16be", "-allow_raw_vfw", "1", "-metadata:s:v:0", "title=COLOR", "-metadata:s:v:0",
         "K4A_COLOR_MODE=MJPG_720P", "-metadata:s:v:1", "title=DEPTH", "-metadata:s:v:1", "K4A_DEPTH_MODE=NFOV_UNBINNED", "-attach",
         f"{d}/calibration.json", "-metadata:s:t", "mimetype=application/octet-stream", "-metadata:s:t", "filename=calibration.json",
         f"{d}/kinect.mkv"], check=True)
    # ffmpeg leaves the compression of the bitmap header open; k4arecorder names it b16g
    film = open(f"{d}/kinect.mkv", "rb").read()
    bitmap = struct.pack("<IiiHH", 40, 640, -576, 1, 16) + bytes(4)
    assert film.count(bitmap) == 1
    with open(f"{d}/kinect.mkv", "wb") as out:
        out.write(film.replace(bitmap, struct.pack("<IiiHH", 40, 640, 576, 1, 16) + b"b16g"))
    shutil.rmtree(f"{d}/raw")
    os.remove(f"{d}/depth.raw")
    return f"{d}/kinect.mkv"


# name: (writer, the most that its ATE may be above the recording's, m, and share of frames tracked, %)
LAYOUTS = {
    "seven_scenes": (seven_scenes, 0.002, 100),
    "tartanair": (tartanair, 0.002, 100),
    "record3d": (record3d, 0.002, 100),
    "two_sizes": (two_sizes, 0.002, 100),
    "fisheye": (fisheye, 0.002, 100),
    "azure_kinect": (azure_kinect, 0.002, 100),
    "polycam": (polycam, 0.005, 100),
    "polycam_sparse": (lambda rec, d: polycam(rec, d, 6), 0.02, 80),
}


WITHOUT_POSES = ("two_sizes", "fisheye")


class Checker:
    def __init__(self, program, folder):
        self.program, self.folder, self.failures = program, folder, 0

    def run(self, *words):
        return subprocess.run([self.program, *words], capture_output=True, text=True)

    def map(self, name, recording, *more):
        out = f"{self.folder}/out/{name}"
        ran = self.run("map", recording, "-o", out, "--force", "-q", "--set", "output.views=", *more)
        if ran.returncode not in (0, 4):
            return None, None, f"map ended with code {ran.returncode}: {ran.stderr.strip()}"
        summary = json.load(open(f"{out}/summary.json"))
        return out, summary["frames"]["tracked_percent"], ran.stderr.strip()

    def ate(self, out, truth):
        ran = self.run("evaluate", "trajectory", out, truth, "--json")
        return json.loads(ran.stdout)["ate_m"]["rmse"] if ran.returncode == 0 else None

    def expect(self, holds, text):
        print(("ok     " if holds else "FAILED ") + text, flush=True)
        self.failures += not holds


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    program, folder = sys.argv[1:3]
    data = os.environ.get("PLUMBLINE_DATA", "")
    recording = sys.argv[3] if len(sys.argv) > 3 else f"{data}/icl_nuim_of_kt0_a"
    names = sys.argv[4:] or list(LAYOUTS)
    for there, what in ((os.path.isdir(recording), "PLUMBLINE_DATA names no folder of recordings"),
                        (shutil.which("ffmpeg"), "no ffmpeg; scripts/install-deps --judges brings it")):
        if not there:
            print(f"skipped: {what}")
            sys.exit(77)
    rec = Recording(recording)
    check = Checker(program, folder)
    out, _, told = check.map("original", recording, "--to", f"{rec.stamp(len(rec) - 1) - rec.stamp(0)}")
    best = check.ate(out, rec.truth_file)
    print(f"original: ATE {best:.4f} m")
    for name in names:
        writer, worse, share = LAYOUTS[name]
        made = f"{folder}/{name}"
        place = writer(rec, made) or made
        out, tracked, told = check.map(name, place)
        own = out and os.path.isdir(place) and name not in WITHOUT_POSES
        ate = check.ate(out, place if own else numbered_truth(rec, made)) if out else None
        holds = ate is not None and ate <= best + worse and tracked >= share
        check.expect(holds, f"{name}: ATE {ate if ate is None else round(ate, 4)} m, {tracked} % tracked" + ("" if holds else f"\n{told}"))
        info = check.run("info", place)
        check.expect(info.returncode == 0 and "pairs:" in info.stdout, f"{name}: {info.stdout.splitlines()[:1]}{info.stderr if info.returncode else ''}")
        shutil.rmtree(made)
    sys.exit(1 if check.failures else 0)


def numbered_truth(rec, folder):
    """Where the layout holds no poses: by the stamps of the recording, or by number / 30 Hz."""
    file = f"{folder}/truth.txt"
    rows = []
    for i in range(len(rec)):
        m = rec.pose(i)
        stamp = rec.stamp(i) if os.path.exists(f"{folder}/associations.txt") else i / 30
        rows.append([stamp, *m[:3, 3], *quaternion(m[:3, :3])])
    np.savetxt(file, np.array(rows))
    return file


if __name__ == "__main__":
    main()
