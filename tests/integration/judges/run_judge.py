#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Has programs that others wrote judge what plumbline exports: run_judge.py PROGRAM WORK MAP CASE [OCTREE_PROBE]

MAP is room, office (generated worlds) or kitchen (7-Scenes' of PLUMBLINE_DATA). The cases share their maps, which the
first one makes in WORK. Exit code 77: the judge is not installed (scripts/install-deps --judges), or there is no
recording.
"""
import fcntl
import json
import math
import os
import re
import shutil
import struct
import subprocess
import sys
import urllib.request
from pathlib import Path

HERE = Path(__file__).resolve().parent
JUDGES = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "plumbline/judges/node_modules"
SCENES = HERE.parents[2] / "pipelines/scenes"
SYSTEM_PYTHON = "/usr/bin/python3"  # Debian's modules are its
OFFICE = {"fps": 10, "seed": 1}
RECORDINGS = {
    "room": "synth:room?frames=200&width=320&height=240",
    "office": "synth:office?" + "&".join(f"{key}={value}" for key, value in OFFICE.items()),
}


class Absent(Exception):
    """A judge is not installed, or a recording is not there."""


def need(program):
    if shutil.which(program) is None:
        raise Absent(f"{program} is not installed; scripts/install-deps --judges installs it")
    return program


def need_npm(package):
    if not (JUDGES / package).is_dir():
        raise Absent(f"npm's {package} is not in {JUDGES}; scripts/install-deps --judges installs it")


def run(*command, **more):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, **more)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(map(str, command))}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def node(script, *arguments, within=()):
    need("node")
    return run(*within, "node", HERE / script, *arguments, env={**os.environ, "JUDGES": str(JUDGES)})


def check(condition, message):
    if not condition:
        raise AssertionError(message)


def recording_of(name):
    if name in RECORDINGS:
        return RECORDINGS[name]
    kitchen = Path(os.environ.get("PLUMBLINE_DATA", "")) / "7scenes_redkitchen_a"
    if not os.environ.get("PLUMBLINE_DATA") or not kitchen.is_dir():
        raise Absent("PLUMBLINE_DATA holds no 7scenes_redkitchen_a")
    return kitchen


class Case:
    def __init__(self, program, work, name):
        self.program = program
        self.name = name
        self.work = work / name
        self.work.mkdir(parents=True, exist_ok=True)
        self.map = self.work / "map"
        recording = recording_of(name)
        with open(self.work / "lock", "w") as lock:  # cases may run side by side
            fcntl.flock(lock, fcntl.LOCK_EX)
            made = self.map / "summary.json"
            if not made.is_file() or made.stat().st_mtime < Path(program).stat().st_mtime:  # by an older program
                shutil.rmtree(self.map, ignore_errors=True)
                run(program, "map", recording, "-o", self.map, "-q")

    def export(self, name, *options):
        """The file or folder, made anew."""
        out = self.work / name
        if out.is_dir():
            shutil.rmtree(out)
        elif out.exists():
            out.unlink()
        run(self.program, "export", self.map, "-o", out, *options)
        return out


def read_colmap(folder):
    """The model as the format's page tells, sharing nothing with the exporter: cameras, images, points."""
    def unpacker(file):
        data = (folder / file).read_bytes()
        at = 0

        def take(form):
            nonlocal at
            values = struct.unpack_from("<" + form, data, at)
            at += struct.calcsize("<" + form)
            return values if len(values) > 1 else values[0]

        def text():
            nonlocal at
            end = data.index(b"\0", at)
            value = data[at:end].decode()
            at = end + 1
            return value
        return take, text
    take, _ = unpacker("cameras.bin")
    cameras = {}
    for _ in range(take("Q")):
        number, model, width, height = take("IiQQ")
        check(model == 1, "the camera is no PINHOLE")
        cameras[number] = (width, height, take("4d"))
    take, text = unpacker("images.bin")
    images = {}
    for _ in range(take("Q")):
        number = take("I")
        pose = take("7d")
        camera = take("I")
        name = text()
        spots = [take("ddQ") for _ in range(take("Q"))]
        images[number] = (pose, camera, name, spots)
    take, _ = unpacker("points3D.bin")
    points = {}
    for _ in range(take("Q")):
        number = take("Q")
        place = take("ddd")
        color = take("BBB")
        error = take("d")
        track = [take("II") for _ in range(take("Q"))]
        points[number] = (place, color, error, track)
    return cameras, images, points


def rotate(q, p):
    w, x, y, z = q
    return (
        (1 - 2 * (y * y + z * z)) * p[0] + 2 * (x * y - w * z) * p[1] + 2 * (x * z + w * y) * p[2],
        2 * (x * y + w * z) * p[0] + (1 - 2 * (x * x + z * z)) * p[1] + 2 * (y * z - w * x) * p[2],
        2 * (x * z - w * y) * p[0] + 2 * (y * z + w * x) * p[1] + (1 - 2 * (x * x + y * y)) * p[2],
    )


def residuals(cameras, images, points):
    for place, _, _, track in points.values():
        for image, index in track:
            pose, camera, _, spots = images[image]
            at = [a + b for a, b in zip(rotate(pose[:4], place), pose[4:])]
            fx, fy, cx, cy = cameras[camera][2]
            x, y, point = spots[index]
            yield fx * at[0] / at[2] + cx - x, fy * at[1] / at[2] + cy - y


def case_colmap(case):
    need("colmap")
    model = case.export("colmap", "--force")
    cameras, images, points = read_colmap(model / "sparse/0")
    check(len(images) >= 3 and len(points) > 100, f"{len(images)} images, {len(points)} points")
    for image, (_, _, name, spots) in images.items():
        check((model / "images" / name).is_file(), f"there is no picture {name}")
        for index, (_, _, point) in enumerate(spots):
            check(point == 2**64 - 1 or (image, index) in [tuple(t) for t in points[point][3]], "a track is not whole")
    rest = list(residuals(cameras, images, points))
    mean = [sum(r[k] for r in rest) / len(rest) for k in range(2)]
    rms = math.sqrt(sum(x * x + y * y for x, y in rest) / len(rest))
    print(f"{len(images)} images, {len(points)} points, {len(rest)} sights: mean residual "
          f"{mean[0]:+.4f} {mean[1]:+.4f} px, RMS {rms:.4f} px")
    # A generated world's camera is known exactly; the principal point of a real one is known less well.
    bound = 0.02 if case.name in RECORDINGS else 0.05
    check(abs(mean[0]) < bound and abs(mean[1]) < bound, "residuals are not around 0: half a pixel?")
    check(rms < 3.0, "the points are not where the pictures show them")
    out = case.work / "adjusted"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    said = run("colmap", "bundle_adjuster", "--input_path", model / "sparse/0", "--output_path", out,
               "--BundleAdjustment.refine_focal_length", 0, "--BundleAdjustment.refine_principal_point", 0,
               "--BundleAdjustment.refine_extra_params", 0, "--BundleAdjustment.refine_extrinsics", 0,
               "--BundleAdjustment.max_num_iterations", 1, env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})
    initial = float(re.search(r"Initial cost\s*:\s*([0-9.]+)", said).group(1))
    print(f"colmap begins at {initial} px")
    # It tells sqrt(cost / residuals); the cost is half the sum of squares, and a sight has two residuals.
    expected = math.sqrt(sum(x * x + y * y for x, y in rest) / (4.0 * len(rest)))
    check(abs(initial - expected) < 0.02, f"colmap begins at {initial} px, we recompute {expected:.4f} px")


def case_colmap_text(case):
    need("colmap")
    binary = case.export("colmap_binary", "--format", "colmap")
    text = case.export("colmap_text", "--format", "colmap", "--text", "on")
    out = case.work / "converted"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    run("colmap", "model_converter", "--input_path", text / "sparse/0", "--output_path", out, "--output_type", "BIN",
        env={**os.environ, "QT_QPA_PLATFORM": "offscreen"})
    a, b = read_colmap(binary / "sparse/0"), read_colmap(out)
    check(sorted(a[2]) == sorted(b[2]) and sorted(a[1]) == sorted(b[1]), "text and binary model differ")
    for number, (place, color, _, track) in a[2].items():
        check(color == b[2][number][1] and sorted(track) == sorted(b[2][number][3]), "a point differs")
        check(max(abs(x - y) for x, y in zip(place, b[2][number][0])) < 1e-6, "a point lies elsewhere")


def case_triangulate(case):
    """COLMAP's own features triangulate at our poses."""
    need("colmap")
    few = case.name == "room"  # too few keyframes for the triangulation
    model = case.export("colmap_triangulate", "--format", "colmap", *(("--every", "12") if few else ()))
    env = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    database = model / "database.db"
    _, images, _ = read_colmap(model / "sparse/0")
    cameras = read_colmap(model / "sparse/0")[0]
    fx, fy, cx, cy = cameras[1][2]
    run("colmap", "feature_extractor", "--database_path", database, "--image_path", model / "images",
        "--ImageReader.camera_model", "PINHOLE", "--ImageReader.single_camera", 1,
        "--ImageReader.camera_params", f"{fx},{fy},{cx},{cy}", "--SiftExtraction.use_gpu", 0, env=env)
    run("colmap", "exhaustive_matcher", "--database_path", database, "--SiftMatching.use_gpu", 0, env=env)
    out = case.work / "triangulated"
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir()
    run("colmap", "point_triangulator", "--database_path", database, "--image_path", model / "images",
        "--input_path", model / "sparse/0", "--output_path", out, "--clear_points", 1, env=env)
    cameras, images, points = read_colmap(out)
    rest = list(residuals(cameras, images, points))
    rms = math.sqrt(sum(x * x + y * y for x, y in rest) / max(1, len(rest)))
    print(f"{len(images)} images, {len(points)} points triangulated, RMS {rms:.3f} px")
    check(len(points) > 100 and rms < 1.5, "COLMAP cannot triangulate at these poses")


def case_nerfstudio(case):
    folder = case.export("nerf", "--format", "nerfstudio")
    data = json.loads((folder / "transforms.json").read_text())
    cameras, images, points = read_colmap(case.export("colmap_for_nerf", "--format", "colmap") / "sparse/0")
    by_name = {name: (pose, spots) for pose, _, name, spots in images.values()}
    check(len(data["frames"]) == len(images), "not as many frames as COLMAP's model has")
    worst = 0.0
    for frame in data["frames"]:
        check((folder / frame["file_path"]).is_file() and (folder / frame["depth_file_path"]).is_file(), "no picture")
        m = frame["transform_matrix"]
        _, spots = by_name[Path(frame["file_path"]).name]
        pose = by_name[Path(frame["file_path"]).name][0]
        for x, y, point in spots:
            if point == 2**64 - 1:
                continue
            place = points[point][0]
            way = [place[k] - m[k][3] for k in range(3)]
            local = [sum(m[r][c] * way[r] for r in range(3)) for c in range(3)]  # x right, y up, z backwards
            u = data["fl_x"] * local[0] / -local[2] + data["cx"]
            v = data["fl_y"] * -local[1] / -local[2] + data["cy"]
            at = [a + b for a, b in zip(rotate(pose[:4], place), pose[4:])]
            fx, fy, cx, cy = cameras[1][2]
            worst = max(worst, abs(u - (fx * at[0] / at[2] + cx)), abs(v - (fy * at[1] / at[2] + cy)))
    print(f"{len(data['frames'])} frames; projections differ from COLMAP's by {worst:.2e} px at most")
    check(worst < 0.1, "axes or pixels are not OpenGL's")
    check(data["applied_transform"] == [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]], "applied_transform")


def case_las(case):
    need_npm("copc")
    las = case.export("room.las", "--datum", "52.5,13.4,30")
    ply = case.export("for_las.ply", "--datum", "52.5,13.4,30")
    print(node("judge_las.mjs", las, ply).strip())
    check((case.work / "room.las.georeference.json").is_file(), "what was applied stands nowhere")


def case_glb(case):
    need_npm("gltf-validator")
    for name, options in (("points.glb", ()), ("mesh.glb", ("--mesh", "--resolution", "0.05"))):
        print(name, node("judge_glb.mjs", case.export(name, *options)).strip())


def case_f3d(case):
    need("f3d")
    glb = case.export("f3d.glb", "--mesh", "--resolution", "0.05")
    png = case.work / "f3d.png"
    png.unlink(missing_ok=True)
    run(need("xvfb-run"), "-a", "f3d", glb, "--output", png, "--resolution", "320,240")  # it wants a display
    check(png.is_file() and png.stat().st_size > 8000, "f3d's picture is empty")


def case_octomap(case, probe):
    need("convert_octree")
    tree = case.export("room.bt")
    colored = case.export("room.ot")
    for source, target in ((tree, "again.ot"), (case.work / "again.ot", "again.bt"), (colored, "colored.bt")):
        run("convert_octree", source, case.work / target)
    check((case.work / "again.bt").read_bytes().split(b"data\n", 1)[1] == tree.read_bytes().split(b"data\n", 1)[1],
          "convert_octree gives other bytes back")
    rows = [line.split() for line in (case.map / "trajectory.txt").read_text().splitlines() if line[0] != "#"]
    camera = [float(v) for v in rows[len(rows) // 2][1:4]]
    ply = case.export("for_octomap.xyz").read_text().splitlines()
    wall = [float(v) for v in ply[len(ply) // 2].split()[:3]]
    for file in (tree, colored):
        print(run(probe, file, *camera, *wall).strip())


def case_grid(case):
    yaml = case.export("room.yaml")
    keys = dict(line.split(": ", 1) for line in yaml.read_text().splitlines() if not line.startswith("#"))
    check(keys["negate"] == "0" and keys["occupied_thresh"] == "0.65" and keys["free_thresh"] == "0.196", "thresholds")
    data = (case.work / keys["image"]).read_bytes()
    head = re.match(rb"P5\n(?:#[^\n]*\n)*(\d+) (\d+)\n255\n", data)
    width, height = int(head.group(1)), int(head.group(2))
    pixels = data[head.end():]
    check(len(pixels) == width * height, "the image is cut off")
    resolution = float(keys["resolution"])
    x0, y0 = [float(v) for v in keys["origin"].strip("[]").split(",")][:2]

    def cell(x, y):  # as map_server reads it
        column, row = int((x - x0) // resolution), height - 1 - int((y - y0) // resolution)
        if not (0 <= column < width and 0 <= row < height):
            return "outside"
        occupancy = (255 - pixels[row * width + column]) / 255.0
        return "occupied" if occupancy > 0.65 else "free" if occupancy < 0.196 else "unknown"
    counts = {}
    for p in pixels:
        counts[p] = counts.get(p, 0) + 1
    check(set(counts) == {0, 205, 254}, f"grey values {counts}")
    rows = [line.split() for line in (case.map / "trajectory.txt").read_text().splitlines() if line[0] != "#"]
    path = {cell(float(r[1]), float(r[2])): 0 for r in rows}
    free = sum(cell(float(r[1]), float(r[2])) == "free" for r in rows)
    print(f"{width} x {height} cells: {counts}; {free} of {len(rows)} places of the path are free ({sorted(path)})")
    check(free >= 0.9 * len(rows), "the camera went through cells that are not free")


def dxf_walls(file):
    """Ends of the lines of the layer A-WALL, from the pairs of group code and value."""
    lines = file.read_text().splitlines()
    pairs = [(int(code), value) for code, value in zip(lines[::2], lines[1::2])]
    walls, entity = [], None
    for code, value in pairs:
        if code == 0:
            if entity and entity.get("type") == "LINE" and entity.get(8) == "A-WALL":
                walls.append(((float(entity[10]), float(entity[20])), (float(entity[11]), float(entity[21]))))
            entity = {"type": value}
        elif entity is not None:
            entity[code] = value
    return walls


def case_frame(case):
    """Cloud, plan, grid, GLB and COLMAP of one map lie on one another."""
    cloud = [[float(v) for v in line.split()[:3]] for line in case.export("frame.xyz").read_text().splitlines()]
    # GLB: the same points in the same order, y up.
    glb = case.export("frame.glb").read_bytes()
    length = struct.unpack_from("<I", glb, 12)[0]
    count = json.loads(glb[20:20 + length])["accessors"][0]["count"]
    check(count == len(cloud), "GLB and cloud have not as many points")
    for i in range(0, count, 997):
        x, y, z = struct.unpack_from("<3f", glb, 28 + length + 12 * i)
        check(math.dist((x, -z, y), cloud[i]) < 1e-4, f"point {i} of the GLB lies elsewhere")
    # Plan: the points beside each of its walls lie on it.
    walls = [w for w in dxf_walls(case.export("frame.dxf")) if math.dist(*w) > 0.5]
    check(len(walls) >= (3 if case.name == "room" else 2), f"{len(walls)} walls in the plan")
    for a, b in walls:
        way = math.dist(a, b)
        t = ((b[0] - a[0]) / way, (b[1] - a[1]) / way)
        off = sorted((p[1] - a[1]) * t[0] - (p[0] - a[0]) * t[1] for p in cloud
                     if 0.3 < p[2] < 2.2 and 0.05 < (p[0] - a[0]) * t[0] + (p[1] - a[1]) * t[1] < way - 0.05
                     and abs((p[1] - a[1]) * t[0] - (p[0] - a[0]) * t[1]) < 0.02)
        if len(off) > 200:
            check(abs(off[len(off) // 2]) < 0.005, f"the wall {a} {b} is {off[len(off) // 2]} m beside the cloud's")
    # Grid: where the plan has a wall, so has the grid, within a cell.
    yaml = case.export("frame.yaml")
    keys = dict(line.split(": ", 1) for line in yaml.read_text().splitlines() if not line.startswith("#"))
    data = (case.work / keys["image"]).read_bytes()
    head = re.match(rb"P5\n(?:#[^\n]*\n)*(\d+) (\d+)\n255\n", data)
    width, height = int(head.group(1)), int(head.group(2))
    x0, y0 = [float(v) for v in keys["origin"].strip("[]").split(",")][:2]

    def occupied(x, y):
        column, row = int((x - x0) / 0.05), height - 1 - int((y - y0) / 0.05)
        return any(data[head.end() + (row + i) * width + column + j] == 0
                   for i in (-1, 0, 1) for j in (-1, 0, 1) if 0 <= row + i < height and 0 <= column + j < width)
    along = [(a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])) for a, b in walls for s in (0.1, 0.3, 0.5, 0.7, 0.9)]
    share = sum(occupied(*p) for p in along) / len(along)
    # COLMAP: its points lie on the cloud's surfaces, but for some beyond the reach of depth.
    cells = {tuple(math.floor(v / 0.05) for v in p) for p in cloud}
    points = read_colmap(case.export("frame_colmap", "--format", "colmap") / "sparse/0")[2]
    near = sum(any((x + i, y + j, z + k) in cells for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1))
               for x, y, z in (tuple(math.floor(v / 0.05) for v in p[0]) for p in points.values())) / len(points)
    print(f"{len(walls)} walls within 5 mm of the cloud; {100 * share:.0f} % of their places occupied in the grid; "
          f"{100 * near:.0f} % of COLMAP's points within a cell of the cloud")
    check(share > 0.9 and near > 0.8, "they do not lie on one another")


def case_plan(case):
    need("rsvg-convert")
    svg = case.export("room.svg")
    png = case.work / "room.png"
    run("rsvg-convert", "-w", 800, svg, "-o", png)
    check(png.stat().st_size > 3000, "librsvg draws nothing")
    check(svg.read_text().count("<path") > 5, "the plan is empty")
    need("pdftotext")
    pdf = case.export("room.pdf")
    check("m2" in run("pdftotext", pdf, "-") or "." in run("pdftotext", pdf, "-"), "the PDF has no text")
    cloud = [[float(v) for v in line.split()[:3]] for line in case.export("for_plan.xyz").read_text().splitlines()]
    low, high = (pick(p[0] for p in cloud) for pick in (min, max))
    middle = sorted(p[1] for p in cloud)[len(cloud) // 2]
    section = case.export("section.svg", "--section", f"{low - 0.1},{middle} {high + 0.1},{middle}")
    check(section.read_text().count("<path") > 50, "the section is empty")
    run("rsvg-convert", "-w", 400, section, "-o", case.work / "section.png")


def case_dxf(case):
    need_ezdxf()
    sides = [] if case.name == "office" else ["one-sided"]
    print(run(SYSTEM_PYTHON, HERE / "judge_dxf.py", case.export("room.dxf"), *sides).strip())
    print(run(SYSTEM_PYTHON, HERE / "judge_dxf.py", case.export("world.dxf", "--datum", "52.5,13.4,30"), "grid", *sides).strip())


def need_ezdxf():
    if subprocess.run([SYSTEM_PYTHON, "-c", "import ezdxf, numpy, yaml"], capture_output=True).returncode != 0:
        raise Absent("python3-ezdxf is not installed; scripts/install-deps --judges installs it")


def case_truth(case):
    """Plan and grid of the generated office against its scene file: walls, their lengths, doors; what is free."""
    need_ezdxf()
    start = case.work / "start"  # where the camera began, in the scene's frame
    shutil.rmtree(start, ignore_errors=True)
    run(case.program, "synth", "office", "-o", start, "--frames", 2, "--width", 64, "--height", 48,
        "--fps", OFFICE["fps"], "--seed", OFFICE["seed"], "--reference-spacing", "0.5", "-q")
    for judge, file in (("judge_plan.py", "truth.dxf"), ("judge_grid.py", "truth.yaml")):
        print(run(SYSTEM_PYTHON, HERE / judge, case.export(file), SCENES / "office.yaml", start / "scene.json",
                  case.map / "trajectory.txt").strip())


def case_clouds(case):
    """CloudCompare and PCL read every form of the cloud, and the mesh, and count what is in the PLY."""
    cloudcompare = need("CloudCompare")
    need("pcl_pcd2ply")
    env = {**os.environ, "QT_QPA_PLATFORM": "offscreen"}
    opened = [cloudcompare, "-SILENT", "-AUTO_SAVE", "OFF", "-O"]
    count = int(re.search(rb"element vertex (\d+)", case.export("count.ply").read_bytes()[:2000]).group(1))
    for name, options in (("count.ply", ()), ("ascii.ply", ("--ascii", "on")), ("count.xyz", ()), ("count.csv", ())):
        said = run(*opened, case.export(name, *options), env=env)
        loaded = int(re.search(r"Found one cloud with (\d+) points", said).group(1))
        print(f"{name}: CloudCompare loads {loaded} points")
        check(loaded == count, f"{name}: CloudCompare loads {loaded} of {count} points")
    for name, options in (("count.pcd", ()), ("ascii.pcd", ("--ascii", "on"))):
        again = case.work / "again.ply"
        run("pcl_pcd2ply", case.export(name, *options), again)
        loaded = int(re.search(rb"element vertex (\d+)", again.read_bytes()[:2000]).group(1))
        print(f"{name}: PCL reads {loaded} points")
        check(loaded == count, f"{name}: PCL reads {loaded} of {count} points")
        check(b"\n# frame: " in (case.work / name).read_bytes()[:300], f"{name}: says no frame")
    for name in ("mesh.obj", "mesh.ply"):
        said = run(*opened, case.export(name, "--mesh", "--resolution", "0.05"), env=env)
        faces, corners = map(int, re.search(r"Found one mesh with (\d+) faces and (\d+) vertices", said).groups())
        print(f"{name}: CloudCompare loads {faces} faces, {corners} vertices")
        check(faces > 1000 and corners > 500, f"{name}: the mesh is almost empty")


def viewer(what, page, *numbers, browser="chromium", within=()):
    """A browser of Debian uses a page as a person does."""
    need(browser)
    need_npm("puppeteer-core")
    work = page.with_suffix("")
    work.mkdir(exist_ok=True)
    print(node("judge_viewer.mjs", what, page, work, *numbers, within=within).strip())


def case_viewer(case):
    viewer("whole", case.export("room.html"))
    viewer("without", case.work / "room.html")


def office_truth(case, spacing):
    """Exact points of the generated office, in its own frame."""
    world = case.work / f"office_{spacing}"
    if not (world / "reference.ply").is_file():
        shutil.rmtree(world, ignore_errors=True)
        run(case.program, "synth", "office", "-o", world, "--frames", 2, "--width", 64, "--height", 48,
            "--reference-spacing", spacing, "-q")
    return world / "reference.ply"


def case_viewer_width(case):
    """The clear width of a door: its opening of 0.95 m begins at 5.45 m of the wall from (14, 1.86) to (0, 1.86), and its
    frame covers 1 cm of it on each side."""
    page = case.work / "office.html"
    page.unlink(missing_ok=True)
    # Pages thin clouds of millions of points, whose voxels would average the frame with the wall 1 cm behind it.
    chain, door = case.work / "door.yaml", case.work / "door.ply"
    chain.write_text("chain: door\nfilters:\n  - {type: crop_box, min: [6 m, 0.5 m, -0.1 m], max: [10 m, 3.5 m, 3 m]}\n")
    run(case.program, "filter", chain, office_truth(case, "1cm"), door, "-q")
    run(case.program, "export", door, "-o", page, "--points", 0)
    near, far = 14.0 - 5.45 - 0.01, 14.0 - 5.45 - 0.95 + 0.01
    # At the frame's farther edge: elsewhere a view that grazes the frame meets the wall behind it at the same pixel.
    viewer("width", page, far, 1.91, 1.005, near, 1.91, 1.005, near - far)


def case_viewer_two(case):
    """The room over what half of its frames give, from disk and as it is served."""
    other = case.work / "half"
    run(case.program, "map", recording_of(case.name), "--every", 2, "-o", other, "-q", "--force")
    run(case.program, "report", case.map, other, "-o", case.work / "two.html", "--force", "-q")
    viewer("two", case.work / "two.html")
    with subprocess.Popen([case.program, "view", case.map, other, "--http", "127.0.0.1:0", "-q"], stdout=subprocess.PIPE,
                          text=True) as server:
        try:
            served = case.work / "served.html"
            with urllib.request.urlopen(server.stdout.readline().strip(), timeout=60) as answer:
                served.write_bytes(answer.read())
        finally:
            server.terminate()
    viewer("two", served)


def ink_of(pdf, work):
    """Of each page: the dark share of all, and of the margin at the right, of 10 mm."""
    need("pdftoppm")
    for old in work.glob("page-*.pgm"):
        old.unlink()
    run("pdftoppm", "-r", "50", "-gray", pdf, work / "page")
    pages = []
    for picture in sorted(work.glob("page-*.pgm")):
        head = re.match(rb"P5\s+(\d+)\s+(\d+)\s+255\s", picture.read_bytes())
        width, height = int(head.group(1)), int(head.group(2))
        dots = picture.read_bytes()[head.end():]
        margin = int(width * 10 / 210)
        dark = [sum(1 for d in dots[y * width + x0:(y + 1) * width] if d < 200) for y in range(height) for x0 in (0, width - margin)]
        pages.append((sum(dark[0::2]) / (width * height), sum(dark[1::2]) / (margin * height)))
    return pages


def case_report_print(case):
    """A report with a plan fits its page, on the screen and on A4."""
    need("pdftotext")
    result = case.work / "printed"
    shutil.rmtree(result, ignore_errors=True)
    shutil.copytree(case.map, result)
    run(case.program, "export", result, "-o", result / "plan.svg")
    page = case.work / "report.html"
    run(case.program, "report", result, "-o", page, "--force", "-q")
    viewer("print", page)

    pdf = page.with_suffix("") / "report.pdf"
    pages = ink_of(pdf, pdf.parent)
    print("dark share of the pages in percent: " + " ".join(f"{100 * all_:.1f}" for all_, _ in pages))
    check(3 <= len(pages) <= 25, f"{len(pages)} pages")
    for number, (all_, margin) in enumerate(pages, 1):
        check(all_ > 0.004, f"page {number} is nearly empty")
        check(margin == 0.0, f"page {number} is cut off at the right")
    text = run("pdftotext", pdf, "-")
    for word in ("The map to walk through", "plan.svg", "Trustworthy"):
        check(word in text, f"'{word}' is not on paper")
    check("Drag to turn" not in text, "paper cannot be dragged")


def case_viewer_firefox(case):
    """Firefox needs a display for WebGL, which xvfb is."""
    display = [need("xvfb-run"), "-a", "-s", "-screen 0 1400x1100x24"]
    viewer("firefox", case.export("firefox.html"), browser="firefox-esr", within=display)


def case_viewer_large(case):
    page = case.work / "large.html"
    page.unlink(missing_ok=True)
    said = run(case.program, "export", office_truth(case, "7mm"), "-o", page, "--points", 5000000, "-v")
    viewer("large", page, re.search(r"(\d+) points", said).group(1))


def case_proj(case):
    need("cs2cs")
    las = case.export("proj.las", "--datum", "52.5,13.4,30")
    applied = json.loads((case.work / "proj.las.georeference.json").read_text())
    said = subprocess.run(["cs2cs", "-f", "%.4f", "EPSG:4326", f"EPSG:{applied['epsg']}"], input="52.5 13.4 0\n",
                          capture_output=True, text=True).stdout.split()
    off = max(abs(float(said[k]) - applied["origin"][k]) for k in range(2))
    print(f"EPSG:{applied['epsg']}: the origin is {off:.4f} m from where cs2cs puts it; scale {applied['scale']:.6f}")
    check(off < 0.001, "the origin is elsewhere")
    # A point 100 m along x, which heads 30 degrees east of north.
    a = math.radians(30)
    lat = 52.5 + math.cos(a) * 100 / 111267.0
    lon = 13.4 + math.sin(a) * 100 / (111320.0 * math.cos(math.radians(52.5)) * 1.00205)
    there = subprocess.run(["cs2cs", "-f", "%.4f", "EPSG:4326", f"EPSG:{applied['epsg']}"], input=f"{lat} {lon} 0\n",
                           capture_output=True, text=True).stdout.split()
    ours = [applied["origin"][k] + 100 * applied["linear"][k][0] for k in range(2)]
    off = math.dist(ours, [float(there[0]), float(there[1])])
    print(f"100 m along x: {off:.3f} m off (the sphere's degree here is good to that)")
    check(off < 0.5, "the heading is wrong")
    check(las.stat().st_size > 1000, "the LAS is empty")


def main():
    program, work, room, name = sys.argv[1], Path(sys.argv[2]), sys.argv[3], sys.argv[4]
    try:
        globals()["case_" + name](Case(program, work, room), *sys.argv[5:])
    except Absent as absent:
        print(f"skipped: {absent}")
        return 77
    except AssertionError as wrong:
        print(f"wrong: {wrong}")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
