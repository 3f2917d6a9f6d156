#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Takes a TUM folder apart into messages that other programs write bags of, and into the folder that a bag has to
agree with. Decoded by OpenCV, encoded by OpenCV and numpy: nothing of Plumbline's.

    make_frames.py FOLDER OUT COUNT COLOR DEPTH [--unaligned]

COLOR: rgb8, bgr8, rgba8, bgra8, 8UC3, jpeg (the folder's own bytes), png, mono8, yuyv, yuv422. DEPTH: 16UC1 (millimetres), mono16,
32FC1 (metres), png, rvl (compressedDepth of millimetres), png32 (of floats). OUT/frames.json lists messages in the
order of their stamps, with the fields of the messages; `data` names files. OUT/folder is a TUM folder of the same
pixels and metres.
"""
import json
import struct
import sys
from pathlib import Path

import cv2
import numpy as np


def read_list(file):
    rows = [line.split() for line in file.read_text().splitlines() if line.strip() and not line.startswith("#")]
    return {row[0]: row[1] for row in rows}


def pairs_of(folder):
    lists = folder / "associations.txt"
    if lists.exists():
        rows = [l.split() for l in lists.read_text().splitlines() if l.strip() and not l.startswith("#")]
        color_first = rows[0][1].startswith("rgb")
        for row in rows:
            yield (row[0], row[1], row[2], row[3]) if color_first else (row[2], row[3], row[0], row[1])
        return
    color, depth = read_list(folder / "rgb.txt"), read_list(folder / "depth.txt")
    for stamp, name in color.items():
        if stamp in depth:
            yield stamp, name, stamp, depth[stamp]


def camera_of(folder):
    values = {}
    for line in (folder / "camera.yaml").read_text().splitlines():
        key, _, value = line.split("#")[0].partition(":")
        if value.strip():
            values[key.strip()] = value.strip()
    return values


class RvlWriter:
    """Wilson 2017: groups of three bits in nibbles, eight nibbles a word, the first one on top."""

    def __init__(self):
        self.nibbles = []

    def number(self, value):
        while True:
            group, value = value & 7, value >> 3
            self.nibbles.append(group | (8 if value else 0))
            if not value:
                return

    def image(self, depth):
        flat = depth.ravel().astype(np.int64)
        ends = np.flatnonzero(np.diff((flat != 0).astype(np.int8))) + 1
        runs = np.split(flat, ends)
        if runs[0][0] != 0:
            runs.insert(0, flat[:0])
        previous = 0
        for zeros, measured in zip(runs[0::2], runs[1::2] + [flat[:0]] * (len(runs) % 2)):
            self.number(len(zeros))
            self.number(len(measured))
            for value in measured.tolist():
                step, previous = value - previous, value
                self.number(2 * step if step >= 0 else -2 * step - 1)
        self.nibbles += [0] * (-len(self.nibbles) % 8)
        n = np.array(self.nibbles, dtype=np.uint32).reshape(-1, 8)
        words = np.zeros(len(n), dtype=np.uint32)
        for i in range(8):
            words = (words << np.uint32(4)) | n[:, i]
        return words.astype("<u4").tobytes()


def depth_message(kind, depth, metres):
    """(type, fields, bytes) of a depth image; `depth` in millimetres."""
    height, width = depth.shape
    if kind in ("16UC1", "mono16"):
        return "Image", {"encoding": kind, "step": 2 * width}, depth.astype("<u2").tobytes()
    if kind == "32FC1":
        return "Image", {"encoding": kind, "step": 4 * width}, metres.astype("<f4").tobytes()
    head = struct.pack("<iff", 0, 0.0, 0.0)
    if kind == "rvl":
        return "CompressedImage", {"format": "16UC1; compressedDepth rvl"}, \
            head + struct.pack("<II", width, height) + RvlWriter().image(depth)
    return "CompressedImage", {"format": "16UC1; compressedDepth png"}, \
        head + cv2.imencode(".png", depth)[1].tobytes()


def inverse_depth(metres):
    """compressedDepth of floats, as its authors do it; and the metres that come back."""
    quantization, max_depth = 100.0, 10.0
    a = np.float32(quantization * (quantization + 1.0))
    b = np.float32(1.0 - a / max_depth)
    good = metres > 0
    values = np.zeros(metres.shape, dtype=np.uint16)
    values[good] = (a / metres[good] + b).astype(np.uint16)
    back = np.zeros(metres.shape, dtype=np.float32)
    some = values > 0
    back[some] = a / (values[some].astype(np.float32) - b)
    data = struct.pack("<iff", 0, a, b) + cv2.imencode(".png", values)[1].tobytes()
    return data, back


def color_message(kind, image, file):
    height, width = image.shape[:2]
    if kind == "jpeg":
        return "CompressedImage", {"format": "bgr8; jpeg compressed bgr8"}, file.read_bytes()
    if kind == "png":
        return "CompressedImage", {"format": "rgb8; png compressed bgr8"}, cv2.imencode(".png", image)[1].tobytes()
    convert = {"rgb8": cv2.COLOR_BGR2RGB, "rgba8": cv2.COLOR_BGR2RGBA, "bgra8": cv2.COLOR_BGR2BGRA,
               "mono8": cv2.COLOR_BGR2GRAY}
    if kind in ("yuyv", "yuv422"):
        yuv = cv2.cvtColor(image, cv2.COLOR_BGR2YUV)
        y, u, v = yuv[:, :, 0], yuv[:, ::2, 1], yuv[:, ::2, 2]
        packed = np.zeros((height, width, 2), dtype=np.uint8)
        first, second = (0, 1) if kind == "yuyv" else (1, 0)
        packed[:, :, first] = y
        packed[:, ::2, second], packed[:, 1::2, second] = u, v
        return "Image", {"encoding": kind, "step": 2 * width}, packed.tobytes()
    data = cv2.cvtColor(image, convert[kind]) if kind in convert else image
    return "Image", {"encoding": kind, "step": data.strides[0]}, data.tobytes()


def stored_color(kind, image):
    if kind == "mono8":
        return cv2.cvtColor(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), cv2.COLOR_GRAY2BGR)
    if kind in ("yuyv", "yuv422"):
        _, _, data = color_message("yuyv", image, None)
        packed = np.frombuffer(data, dtype=np.uint8).reshape(image.shape[0], image.shape[1], 2)
        return cv2.cvtColor(packed, cv2.COLOR_YUV2BGR_YUYV)
    return image


def main():
    arguments = [a for a in sys.argv[1:] if not a.startswith("--")]
    unaligned = "--unaligned" in sys.argv
    folder, out, count, color_kind, depth_kind = Path(arguments[0]), Path(arguments[1]), int(arguments[2]), \
        arguments[3], arguments[4]
    camera = camera_of(folder)
    scale = float(camera["depth_scale"])
    target = out / "folder"
    for name in ("rgb", "depth"):
        (target / name).mkdir(parents=True, exist_ok=True)
    k = [float(camera["fx"]), 0, float(camera["cx"]), 0, float(camera["fy"]), float(camera["cy"]), 0, 0, 1]
    d = [float(x) for x in camera.get("distortion", "[0,0,0,0,0]").strip("[]").split(",")]
    metric = depth_kind in ("32FC1", "png32")
    messages, rows = [], []

    for number, (stamp, color_file, depth_stamp, depth_file) in enumerate(pairs_of(folder)):
        if number == count:
            break
        image = cv2.imread(str(folder / color_file), cv2.IMREAD_COLOR)
        raw = cv2.imread(str(folder / depth_file), cv2.IMREAD_UNCHANGED)
        raw[raw == 65535] = 0
        height, width = raw.shape
        millimetres = np.round(raw * (1000.0 / scale)).astype(np.uint16)
        metres = raw.astype(np.float32) / np.float32(scale)
        if depth_kind == "png32":
            data, metres = inverse_depth(metres)
            depth = ("CompressedImage", {"format": "32FC1; compressedDepth png"}, data)
        else:
            depth = depth_message(depth_kind, millimetres, metres)
        color = color_message(color_kind, image, folder / color_file)

        for what, when, (kind, fields, data) in (("depth", depth_stamp, depth), ("color", stamp, color)):
            seconds, _, rest = when.partition(".")
            name = f"{number:06d}.{what}"
            (out / name).write_bytes(data)
            messages.append({"what": what, "type": kind, "sec": int(seconds), "nanosec": int(rest.ljust(9, "0")),
                             "width": width, "height": height, "data": name, **fields})

        # The folder of the same numbers; the folder's own JPEG where its bytes are in the bag.
        ending = Path(color_file).suffix if color_kind == "jpeg" else ".png"
        color_name, depth_name = f"rgb/{number:06d}{ending}", f"depth/{number:06d}.{'tiff' if metric else 'png'}"
        if color_kind == "jpeg":
            (target / color_name).write_bytes((folder / color_file).read_bytes())
        else:
            cv2.imwrite(str(target / color_name), stored_color(color_kind, image))
        cv2.imwrite(str(target / depth_name), metres if metric else millimetres)
        rows.append(f"{stamp} {color_name} {depth_stamp} {depth_name}")

    (target / "associations.txt").write_text("\n".join(rows) + "\n")
    lines = [f"{key}: {camera[key]}" for key in ("model", "width", "height", "fx", "fy", "cx", "cy", "distortion")
             if key in camera]
    lines += ["depth_scale: 1000", f"fps: {camera.get('fps', '30')}"]
    if unaligned:  # the same pixels, as if of a camera 25 mm beside, turned by 2 degrees about y
        c, s = np.cos(np.radians(2.0)), np.sin(np.radians(2.0))
        lines += ["color_from_depth:", f"  - [{c}, 0, {s}, 0.025]", "  - [0, 1, 0, 0]", f"  - [{-s}, 0, {c}, 0]",
                  "  - [0, 0, 0, 1]",
                  f"depth: {{width: {camera['width']}, height: {camera['height']}, fx: {camera['fx']}, "
                  f"fy: {camera['fy']}, cx: {camera['cx']}, cy: {camera['cy']}}}"]
    (target / "camera.yaml").write_text("\n".join(lines) + "\n")
    transform = {"x": 0.025, "y": 0.0, "z": 0.0, "qx": 0.0, "qy": float(np.sin(np.radians(1.0))), "qz": 0.0,
                 "qw": float(np.cos(np.radians(1.0)))} if unaligned else None
    (out / "frames.json").write_text(json.dumps(
        {"messages": messages, "k": k, "d": d, "width": int(camera["width"]), "height": int(camera["height"]),
         "color_from_depth": transform}))


main()
