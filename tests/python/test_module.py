#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The module as its users have it: python3 -m unittest, with PYTHONPATH at the built module and PLUMBLINE_PROGRAM set."""
import csv
import gc
import filecmp
import logging
import multiprocessing
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import numpy as np

import plumbline

PROGRAM = os.environ["PLUMBLINE_PROGRAM"]
SAME = ["map.ply", "map.pcd", "trajectory.txt", "keyframes.txt", "keyframes.csv", "lines.ply", "frames.csv", "camera.yaml"]
SCENE = "synth:room?frames=60&width=320&height=240"


def program(*words):
    return subprocess.run([PROGRAM, *map(str, words)], check=True, capture_output=True, text=True).stdout


class Folder(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        logging.getLogger("plumbline").setLevel(logging.ERROR)
        cls.work = Path(tempfile.mkdtemp(prefix="plumbline-test-"))
        program("synth", "room", "-o", cls.work / "world", "--frames", 60, "--width", 320, "--height", 240, "-q")
        cls.recording = cls.work / "world" / "robot0" if (cls.work / "world" / "robot0").is_dir() else cls.work / "world"

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.work)


class Recordings(Folder):
    def test_frames_are_arrays_of_the_recording(self):
        recording = plumbline.open(self.recording)
        self.assertEqual(len(recording), 60)
        frames = list(recording)
        self.assertEqual([frame.index for frame in frames], list(range(60)))
        np.testing.assert_array_equal([frame.stamp for frame in frames], recording.stamps)
        frame = frames[7]
        self.assertEqual((frame.color.shape, frame.color.dtype), ((240, 320, 3), np.uint8))
        self.assertEqual((frame.depth.shape, frame.depth.dtype), ((240, 320), np.float32))
        self.assertFalse(frame.color.flags.owndata)  # shared with the library
        self.assertGreater(np.median(frame.depth[frame.depth > 0]), 0.3)

    def test_arrays_outlive_the_recording(self):
        recording = plumbline.open(self.recording)
        color = recording[3].color
        copy = color.copy()
        del recording
        gc.collect()
        np.testing.assert_array_equal(color, copy)

    def test_raw_frames_are_those_of_the_camera(self):
        raw = plumbline.open(self.recording, raw=True)[5]
        shown = plumbline.open(self.recording)[5]
        self.assertEqual(raw.depth.dtype, np.uint16)
        np.testing.assert_allclose(raw.depth / raw.camera.depth_scale, shown.depth, atol=1e-4)

    def test_part_of_a_recording(self):
        part = plumbline.open(self.recording, start=0.5, every=2)
        self.assertGreaterEqual(part.stamps[0] - plumbline.open(self.recording).stamps[0], 0.5)
        self.assertAlmostEqual(part[-1].stamp, part.stamps[-1])
        with self.assertRaises(IndexError):
            part[len(part)]

    def test_errors_say_what_the_program_says(self):
        with self.assertRaisesRegex(plumbline.InputError, "nowhere"):
            plumbline.open(self.work / "nowhere")
        with self.assertRaisesRegex(plumbline.ConfigError, "tum_fr1"):
            plumbline.camera("tum_fr9")
        with self.assertRaisesRegex(plumbline.ConfigError, "allowed: color"):
            plumbline.open(self.recording, topics={"colour": "/a"})
        self.assertTrue(issubclass(plumbline.InputError, plumbline.Error))


class Mapping(Folder):
    def fed(self, **options):
        recording = plumbline.open(self.recording, raw=True)
        with plumbline.Mapper(recording.camera, name=Path(self.recording).name, **options) as mapper:
            tracked = [mapper.feed(f.color, f.depth, f.stamp, depth_stamp=f.depth_stamp) for f in recording]
            return tracked, mapper.finish()

    def test_a_fed_mapper_gives_the_bytes_of_the_program(self):
        program("map", self.recording, "-o", self.work / "by_program", "-q")
        tracked, result = self.fed(output=self.work / "by_mapper", threads=3)
        _, _, differing = filecmp.cmpfiles(self.work / "by_program", self.work / "by_mapper", SAME, shallow=False)
        self.assertEqual(differing, [])
        match, differ, absent = filecmp.cmpfiles(self.work / "by_program", self.work / "by_mapper", SAME, shallow=False)
        self.assertEqual((sorted(match), differ, absent), (sorted(SAME), [], []))
        self.assertTrue(result.trustworthy, result.reason)
        self.assertEqual({t.state for t in tracked}, {"tracked"})
        self.assertTrue(tracked[0].keyframe)
        np.testing.assert_allclose(tracked[0].pose, np.eye(4), atol=1e-9)

    def test_pictures_that_a_live_run_does_not_keep_are_not_read_from_a_recording_either(self):
        wrong = self.work / "wrong"
        program("synth", "room", "-o", wrong, "--frames", 90, "--width", 320, "--height", 240, "--camera-error", "fx=3%", "-q")
        recording = plumbline.open(wrong / "robot0", raw=True)
        few, all_of_them = {"track.camera.pictures": 2}, {}
        kept, maps = [], []
        for name, options in (("few", few), ("all", all_of_them)):
            settings = [f"--set={key}={value}" for key, value in options.items()]
            program("map", wrong / "robot0", "-o", self.work / f"{name}_by_program", "-q", *settings)
            with plumbline.Mapper(recording.camera, name="robot0", output=self.work / f"{name}_live", **options) as mapper:
                for f in recording:
                    mapper.feed(f.color, f.depth, f.stamp, depth_stamp=f.depth_stamp)
                result = mapper.finish()
            _, differ, absent = filecmp.cmpfiles(result.folder, self.work / f"{name}_by_program", SAME, shallow=False)
            self.assertEqual((differ, absent), ([], []))
            kept.append(result.summary["live"]["kept_frames"])
            maps.append((result.folder / "map.ply").read_bytes())
        self.assertLess(kept[0], kept[1])
        self.assertNotEqual(maps[0], maps[1])

    def test_a_camera_is_located_in_a_map_that_stays_as_it_is(self):
        result = plumbline.map(self.recording, self.work / "known", end=1.5)
        before = {file: file.read_bytes() for file in result.folder.rglob("*") if file.is_file()}
        found = plumbline.localize(result, self.recording, self.work / "found", threads=1)
        self.assertEqual(len(found.located), 60)
        self.assertGreater(found.located.sum(), 45)
        self.assertEqual(len(found.trajectory.stamps), found.located.sum())
        self.assertTrue(np.all(np.isfinite(found.sigma_position) == found.located))
        self.assertTrue(all((reason == "") == located for reason, located in zip(found.reasons, found.located)))
        self.assertEqual(found.reason, "")
        common = np.isin(found.trajectory.stamps, result.trajectory.stamps)
        apart = found.trajectory.poses[common][:, :3, 3] - result.trajectory.poses[: common.sum()][:, :3, 3]
        self.assertLess(np.abs(apart).max(), 0.02)
        self.assertEqual(before, {file: file.read_bytes() for file in result.folder.rglob("*") if file.is_file()})
        with self.assertRaisesRegex(plumbline.InputError, "nowhere"):
            plumbline.localize(self.work / "nowhere", self.recording, self.work / "lost")

    def test_one_after_the_other_gives_the_same(self):
        """Whoever waits for each pose before the next frame, with one thread."""
        recording = plumbline.open(self.recording, raw=True)
        with plumbline.Mapper(
            recording.camera, name=Path(self.recording).name, threads=1, output=self.work / "slowly"
        ) as mapper:
            for f in recording:
                pose = mapper.feed(f.color, f.depth, f.stamp, depth_stamp=f.depth_stamp).pose
                self.assertEqual(pose.shape, (4, 4))
            mapper.finish()
        result = plumbline.map(self.recording, self.work / "at_once", threads=2)
        match, differ, absent = filecmp.cmpfiles(result.folder, self.work / "slowly", SAME, shallow=False)
        self.assertEqual((differ, absent), ([], []))

    def test_options_reach_the_stages(self):
        _, result = self.fed(fuse={"voxel": "4 cm"}, **{"track.loops": False})
        config = (result.folder / "config.yaml").read_text()
        self.assertRegex(config, r"voxel: 0\.04 m")
        self.assertRegex(config, r"loops: (off|false)")
        with self.assertRaisesRegex(plumbline.InputError, "frames that were fed"):
            result.image(0)
        with self.assertRaisesRegex(plumbline.ConfigError, "did you mean"):
            mapper = plumbline.Mapper("tum_fr1", fuse={"voxle": 1})
            mapper.finish()

    def test_bad_arrays_are_refused_by_name(self):
        recording = plumbline.open(self.recording, raw=True)
        f = recording[0]
        mapper = plumbline.Mapper(recording.camera)
        nan = np.full(f.depth.shape, np.nan, np.float32)
        cases = [
            ((f.color.astype(np.float32), f.depth, 1.0), "color: an array of float32"),
            ((f.color[:, :, :2], f.depth, 1.0), r"color: .* \(240, 320, 2\)"),
            ((f.color[:, ::-1], f.depth, 1.0), "color: .*contiguous"),
            ((f.color[:100].copy(), f.depth, 1.0), "colour is 320 x 100"),
            ((f.color, f.depth.astype(np.int32), 1.0), "depth: an array of int32"),
            ((f.color, f.depth[:, :, None], 1.0), "depth: "),
            ((f.color, f.depth[:50].copy(), 1.0), "depth is 320 x 50"),
            ((f.color, nan, 1.0), "depth is NaN"),
            ((f.color, f.depth, float("nan")), "stamps are finite"),
        ]
        for arguments, message in cases:
            with self.subTest(message), self.assertRaisesRegex(plumbline.InputError, message):
                mapper.feed(*arguments)
        with self.assertRaisesRegex(TypeError, r"feed\(color, depth, stamp\) .* not float, ndarray, ndarray"):
            mapper.feed(1.0, f.color, f.depth)
        with self.assertRaisesRegex(plumbline.InputError, "odometry: the matrix is not a rigid motion"):
            mapper.feed(f.color, f.depth, 1.0, odometry=np.ones((4, 4)))
        mapper.feed(f.color, f.depth, 1.0)
        with self.assertRaisesRegex(plumbline.InputError, "stamp 1 s is not after"):
            mapper.feed(f.color, f.depth, 1.0)
        mapper.cancel()

    def test_late_frames_are_left_out_and_counted(self):
        recording = plumbline.open(self.recording, raw=True)
        frames = list(recording)
        with plumbline.Mapper(recording.camera, drop_late=True, queue=2, threads=1) as mapper:
            tracked = [mapper.feed(f.color, f.depth, f.stamp, depth_stamp=f.depth_stamp) for f in frames]
            result = mapper.finish()
        left_out = sum(t.dropped for t in tracked)
        self.assertEqual(mapper.dropped, left_out)
        self.assertGreater(left_out, 0)
        self.assertEqual(mapper.fed + left_out, len(frames))
        self.assertEqual(result.summary["frames"]["read"], mapper.fed)
        self.assertEqual([t.state for t in tracked if t.dropped], ["dropped"] * left_out)

    def test_nothing_is_left_of_a_mapper_that_is_given_up(self):
        recording = plumbline.open(self.recording, raw=True)
        with plumbline.Mapper(recording.camera, output=self.work / "given_up") as mapper:
            mapper.feed(recording[0].color, recording[0].depth, 1.0).pose
        del mapper
        gc.collect()
        self.assertEqual(list(self.work.glob("given_up*")), [])

    def test_a_mapper_belongs_to_its_process(self):
        mapper = plumbline.Mapper("tum_fr1")
        child = os.fork()
        if child == 0:
            code = 1
            try:
                mapper.feed(np.zeros((480, 640, 3), np.uint8), np.ones((480, 640), np.uint16), 1.0)
            except plumbline.ConfigError:
                code = 0
            os._exit(code)
        self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), 0)
        mapper.cancel()

    def test_processes_side_by_side(self):
        with multiprocessing.get_context("spawn").Pool(2) as pool:
            self.assertEqual(pool.map(length_of, [str(self.recording)] * 2), [60, 60])

    def test_the_interpreter_is_free_and_progress_comes(self):
        ticks = []
        over = threading.Event()

        def tick():
            while not over.wait(0.01):
                ticks.append(1)

        thread = threading.Thread(target=tick)
        thread.start()
        seen = []
        result = plumbline.map(self.recording, self.work / "with_progress", progress=lambda *now: seen.append(now))
        over.set()
        thread.join()
        self.assertGreater(len(ticks), 10)
        self.assertEqual(seen[-1], (60, 60))
        self.assertEqual(seen, sorted(seen))
        self.assertEqual(len(result.trajectory), 60)

    def test_interrupt_writes_what_there_is(self):
        long = "synth:room?frames=3000&width=320&height=240"

        def interrupt():
            while not any(self.work.glob("interrupted*/map.db")):
                time.sleep(0.05)
            time.sleep(2.0)
            os.kill(os.getpid(), signal.SIGINT)

        threading.Thread(target=interrupt, daemon=True).start()
        with self.assertRaises(KeyboardInterrupt):
            plumbline.map(long, self.work / "interrupted")
        result = plumbline.load(self.work / "interrupted")
        self.assertLess(result.summary["frames"]["read"], 3000)
        self.assertGreater(len(result.trajectory), 0)

    def test_progress_that_raises_ends_the_run(self):
        def refuse(done, total):
            raise ValueError("enough")

        with self.assertRaisesRegex(ValueError, "enough"):
            plumbline.map(self.recording, self.work / "enough", progress=refuse)


def length_of(recording):
    return len(plumbline.open(recording))


class Results(Folder):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.result = plumbline.map(cls.recording, cls.work / "out")

    def test_a_result_as_arrays(self):
        result = plumbline.load(self.work / "out")
        self.assertEqual(result.summary["frames"]["tracked"], 60)
        self.assertEqual(result.trajectory.poses.shape, (60, 4, 4))
        np.testing.assert_allclose(np.linalg.det(result.trajectory.poses[:, :3, :3]), 1.0, atol=1e-6)
        keyframes = result.keyframes
        self.assertEqual(keyframes.poses.shape, (len(keyframes.stamps), 4, 4))
        stamps = plumbline.open(self.recording).stamps
        np.testing.assert_allclose(stamps[keyframes.frames], keyframes.stamps, atol=1e-5)
        self.assertEqual(set(keyframes.robots), {Path(self.recording).name})
        path = plumbline.Trajectory.read(self.work / "out" / "keyframes.txt")
        np.testing.assert_allclose(keyframes.poses, path.poses, atol=1e-7)
        self.assertEqual(result.lines.shape[1:], (2, 3))
        self.assertEqual((result.camera.width, result.camera.height), (320, 240))
        self.assertEqual(result.image(int(keyframes.frames[-1])).color.shape, (240, 320, 3))

    def test_an_image_is_of_the_part_of_the_recording_that_was_mapped(self):
        result = plumbline.map(self.recording, self.work / "part", start=0.3, every=2, format="tum")
        number = int(result.keyframes.frames[-1])
        self.assertAlmostEqual(result.image(number).stamp, result.keyframes.stamps[-1], places=5)

    def test_covariances_are_those_of_the_export(self):
        plumbline.export(self.result, self.work / "poses.csv", what="trajectory")
        with open(self.work / "poses.csv", encoding="utf-8") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        axes = ["x", "y", "z", "rx", "ry", "rz"]
        covariance = self.result.trajectory.covariance
        self.assertEqual(covariance.shape, (60, 6, 6))
        for row, column in ((0, 0), (1, 2), (2, 4), (5, 5)):
            exported = [float(line[f"cov_{axes[row]}_{axes[column]}"]) for line in rows]
            np.testing.assert_allclose(covariance[:, row, column], exported, rtol=1e-4, atol=1e-13)
            np.testing.assert_allclose(covariance[:, row, column], covariance[:, column, row], rtol=1e-9, atol=1e-18)
        keyframes = self.result.keyframes
        at = np.searchsorted(self.result.trajectory.stamps, keyframes.stamps - 1e-5)
        sigmas = np.sqrt(np.trace(covariance[at, :3, :3], axis1=1, axis2=2))
        np.testing.assert_allclose(sigmas, keyframes.sigma_position, atol=1e-6)
        self.assertGreater(sigmas.max(), 0.0)
        self.assertIsNone(plumbline.open(self.recording).truth.covariance)

    def test_lengths_come_with_what_the_poses_errors_can_change(self):
        keyframes, samples = self.result.keyframes, self.result.pose_samples
        last = len(keyframes.stamps) - 1
        self.assertEqual(samples.shape, (last + 1, 32, 6))
        ends = (keyframes.poses[[0, last]] @ [0.1, 0.0, 1.5, 1.0])[:, :3]
        length = self.result.length(ends, seen=[0, last])
        self.assertAlmostEqual(length.metres, float(np.linalg.norm(ends[1] - ends[0])))
        self.assertTrue(1e-5 < length.within < 0.3, length)
        self.assertGreater(self.result.length(ends).metres, 0.0)

        # The points' own noise counts; both points move with one camera; a result without samples says so.
        self.assertAlmostEqual(self.result.length(ends, seen=[0, 0], sigma=0.1).within, 2.04 * 0.1 * 2**0.5, places=4)
        self.assertLess(self.result.length(ends, seen=[0, 0]).within, 0.1 * length.within)
        (self.work / "bare").mkdir()
        for name in ("summary.json", "config.yaml", "trajectory.txt"):
            shutil.copy(self.result.folder / name, self.work / "bare" / name)
        with self.assertRaisesRegex(plumbline.InputError, "pose_samples.npy"):
            plumbline.load(self.work / "bare").pose_samples

    def test_landmarks_lie_where_their_keyframes_saw_them(self):
        landmarks, keyframes, camera = self.result.landmarks, self.result.keyframes, self.result.camera
        self.assertEqual(len(landmarks.point), len(landmarks.pixel))
        world_from_camera = dict(zip(keyframes.numbers, keyframes.poses))
        errors = []
        for point, keyframe, pixel in zip(landmarks.point, landmarks.keyframe, landmarks.pixel):
            p = np.linalg.inv(world_from_camera[keyframe]) @ np.append(landmarks.points[point], 1.0)
            errors.append(np.hypot(*(camera.matrix @ p[:3] / p[2])[:2] - pixel))
        self.assertLess(np.median(errors), 1.5)

    def test_cloud_shares_its_memory(self):
        cloud = plumbline.Cloud.read(self.work / "out" / "map.ply")
        self.assertEqual(cloud.points.shape, (len(cloud), 3))
        for array in (cloud.points, cloud.normals, cloud.colors, cloud.array, *cloud.columns.values()):
            self.assertFalse(array.flags.owndata)
            self.assertEqual(len(array), len(cloud))
        cloud.points[4] = (1.0, 2.0, 3.0)
        self.assertEqual(cloud.array["y"][4], 2.0)
        self.assertEqual(cloud.array["r"][9], cloud.colors[9, 0])
        self.assertIn("confidence", cloud.columns)
        points = cloud.points
        del cloud
        gc.collect()
        self.assertEqual(points[4, 2], 3.0)

    def test_cloud_written_and_read_is_the_same(self):
        cloud = self.result.cloud
        cloud.to_ply(self.work / "copy.ply")
        self.assertTrue(filecmp.cmp(self.work / "copy.ply", self.work / "out" / "map.ply", shallow=False) or
                        np.array_equal(plumbline.Cloud.read(self.work / "copy.ply").points, cloud.points))
        made = plumbline.Cloud.of(cloud.points, colors=cloud.colors, normals=cloud.normals, columns=cloud.columns)
        np.testing.assert_array_equal(made.array, cloud.array)
        np.testing.assert_array_equal(made["confidence"], cloud["confidence"])
        with self.assertRaisesRegex(plumbline.InputError, r"colors: .* \(2, 3\)"):
            plumbline.Cloud.of(np.zeros((2, 3)), colors=np.zeros((3, 3)))
        with self.assertRaisesRegex(plumbline.InputError, "'a' must have one number"):
            plumbline.Cloud.of(np.zeros((2, 3)), columns={"a": [1.0]})

    def test_filters_as_the_program_runs_them(self):
        program("filter", "map", self.work / "out" / "map.ply", self.work / "filtered.ply", "-q")
        filtered = plumbline.filter(self.result, "map")
        filtered.write(self.work / "by_module.ply")
        self.assertTrue(filecmp.cmp(self.work / "filtered.ply", self.work / "by_module.ply", shallow=False))
        coarse = plumbline.filter(self.result.cloud, [{"type": "voxel_grid", "leaf": "20 cm"},
                                                      {"type": "pass_through", "field": "z", "max": 1.0}])
        self.assertEqual([report.type for report in coarse.reports], ["voxel_grid", "pass_through"])
        self.assertLessEqual(coarse.points[:, 2].max(), 1.0)
        with self.assertRaisesRegex(plumbline.ConfigError, "voxel_grid"):
            plumbline.filter(self.result, [{"type": "voxelgrid"}])

    def test_measures_are_those_of_the_program(self):
        import json
        printed = json.loads(program("evaluate", "trajectory", self.work / "out", self.recording, "--json"))
        report = plumbline.evaluate_trajectory(self.result, self.recording)
        self.assertEqual(report["ate_m"], printed["ate_m"])
        self.assertAlmostEqual(float(np.sqrt(np.mean(report.errors**2))), printed["ate_m"]["rmse"], places=6)
        self.assertEqual(len(report.stamps), printed["matched"])
        same = plumbline.evaluate_trajectory(self.result.trajectory, plumbline.open(self.recording).truth)
        self.assertEqual(same["ate_m"], printed["ate_m"])
        cloud = plumbline.evaluate_cloud(self.result, wall_patch="30 cm")
        self.assertIn("wall_thickness_mm", cloud)
        (self.work / "utm.xyz").write_text("701362.56 4485513.72 100\n701362.57 4485513.72 100\n")
        far = plumbline.evaluate_cloud(plumbline.Cloud.read(self.work / "utm.xyz"), self.work / "utm.xyz")
        self.assertAlmostEqual(far["density"]["spacing_mm"], 10.0, places=3)
        self.assertEqual(far["accuracy_mm"]["max"], 0.0)
        with self.assertRaisesRegex(plumbline.ConfigError, "aline"):
            plumbline.evaluate_trajectory(self.result, self.recording, aline="se3")

    def test_exports_and_pictures(self):
        written = plumbline.export(self.result, self.work / "path.txt", what="trajectory")
        self.assertTrue(written[0].exists())
        with self.assertRaisesRegex(plumbline.ConfigError, "nothing.xyz9"):
            plumbline.export(self.result, self.work / "nothing.xyz9")
        image = plumbline.render(self.result, "top", size=(320, 240), annotations=False, file=self.work / "top.png")
        self.assertEqual((image.shape, image.dtype), ((240, 320, 3), np.uint8))
        self.assertGreater(image.std(), 10.0)
        program("render", self.work / "out", "-o", self.work / "by_program.png", "--view", "top", "--size", "320x240",
                "--annotations", "off")
        self.assertTrue(filecmp.cmp(self.work / "top.png", self.work / "by_program.png", shallow=False))
        self.assertEqual(plumbline.render(self.result.cloud, size=(96, 64)).shape, (64, 96, 3))

    def test_maps_are_fused(self):
        other = plumbline.map(self.recording, self.work / "other", start=0.4)
        both = plumbline.fuse([self.result, other], self.work / "both")
        self.assertEqual(len(both.robots), 2)
        self.assertEqual({path.covariance.shape[1:] for path in both.robots.values()}, {(6, 6)})
        with self.assertRaisesRegex(plumbline.InputError, "several robots"):
            both.trajectory
        self.assertEqual(set(both.keyframes.robots), set(both.robots))
        self.assertLessEqual(set(both.landmarks.robot), set(both.robots))
        self.assertGreaterEqual(both.keyframes.frames.min(), 0)
        with self.assertRaisesRegex(plumbline.InputError, "no robot 'typo'; give one of them: "):
            both.image(0, robot="typo")
        self.assertTrue(both.trustworthy, both.reason)

    def test_names_that_are_not_plain(self):
        for name, told in (('a, "b"', 'a, "b"'), ("=1+1", "=1+1"), ("two\nlines", "two\\nlines"), (b"caf\xe9", "caf\ufffd")):
            folder = Path(os.fsdecode(os.fsencode(self.work) + b"/" + os.fsencode(name)))
            shutil.copytree(self.recording, folder)
            mapped = subprocess.run([PROGRAM, "map", folder, "-o", self.work / "named", "--to", "0.4", "--force", "-q", "--set", "output.views="])
            self.assertIn(mapped.returncode, (0, 4))
            result = plumbline.load(self.work / "named")
            self.assertEqual(set(result.keyframes.robots), {told})
            self.assertEqual(os.path.basename(result.summary["input"]), told.replace("\\n", "\n"))

    def test_a_damaged_table_is_an_input_error(self):
        folder = self.work / "damaged"
        shutil.copytree(self.work / "out", folder)
        for text in ("robot,keyframe\na,b\n", "robot,keyframe,stamp\nr,0,x\n", "", "robot\nr,1,2\n"):
            (folder / "keyframes.csv").write_text(text)
            if text:
                with self.assertRaisesRegex(plumbline.InputError, "keyframes.csv"):
                    plumbline.load(folder).keyframes
        os.remove(folder / "keyframes.csv")
        with self.assertRaisesRegex(plumbline.InputError, "keyframes.csv: cannot be read"):
            plumbline.load(folder).keyframes
        (folder / "summary.json").write_text("[" * 100000)
        with self.assertRaisesRegex(plumbline.InputError, "summary.json:1:65: .*nested deeper than 64 levels"):
            plumbline.load(folder).summary

    def test_one_robot_of_several_in_the_map(self):
        folder = self.work / "left_out"
        shutil.copytree(self.work / "out", folder)
        name = Path(self.recording).name
        for robot in (name, "other"):
            (folder / "robots" / robot).mkdir(parents=True)
            shutil.copy(folder / "camera.yaml", folder / "robots" / robot)
        for file in ("trajectory.txt", "keyframes.txt"):
            (folder / file).rename(folder / "robots" / name / file)
        result = plumbline.load(folder)
        np.testing.assert_array_equal(result.trajectory.poses, self.result.trajectory.poses)
        self.assertEqual(list(result.robots), [name])
        self.assertEqual(result.trajectory.covariance.shape, (60, 6, 6))

    def test_empty_paths_are_usage_errors(self):
        calls = {
            "map": [lambda: plumbline.render("", "top"), lambda: plumbline.export("", "x.ply")],
            "folder": [lambda: plumbline.load("")],
            "recording": [lambda: plumbline.map("", "x"), lambda: plumbline.map(["", ""], "x")],
            "output": [lambda: plumbline.map(self.recording, ""), lambda: plumbline.export(self.result, ""),
                       lambda: plumbline.fuse([self.result], "")],
            "maps": [lambda: plumbline.fuse(["", self.result], "x")],
            "input": [lambda: plumbline.open("")],
            "file": [lambda: plumbline.Cloud.read(""), lambda: plumbline.Trajectory.read(""),
                     lambda: self.result.trajectory.write("")],
            "name_or_file": [lambda: plumbline.camera("")],
            "truth": [lambda: plumbline.evaluate_trajectory(self.result, "")],
            "cloud": [lambda: plumbline.evaluate_cloud("")],
            "chain": [lambda: plumbline.filter(self.result.cloud, "")],
        }
        for argument, made in calls.items():
            for call in made:
                with self.assertRaisesRegex(plumbline.ConfigError, f"^{argument}: is empty"):
                    call()

    def test_no_result_is_an_input_error(self):
        with self.assertRaisesRegex(plumbline.InputError, "world"):
            plumbline.load(self.work / "world")


if __name__ == "__main__":
    unittest.main(verbosity=2)
