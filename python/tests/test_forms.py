# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Files, and the arrays and objects of other libraries."""

import pathlib
import tempfile
import types
import unittest

import numpy

import scenes
import sheaf


class Bal(unittest.TestCase):
    def test_arrays_of_the_cookbook_and_back(self):
        start = scenes.small()[0]
        arrays = start.to_bal()
        self.assertEqual(arrays[0].shape, (8, 9))
        again = sheaf.Problem.from_bal(*arrays)
        for one, two in zip(arrays, again.to_bal()):
            self.assertTrue((one == two).all())
        with tempfile.TemporaryDirectory() as folder:
            start.write(f"{folder}/a.txt")
            again.write(f"{folder}/b.txt")
            self.assertEqual(
                pathlib.Path(f"{folder}/a.txt").read_bytes(),
                pathlib.Path(f"{folder}/b.txt").read_bytes(),
            )
        with self.assertRaisesRegex(TypeError, "camera_params.astype"):
            sheaf.Problem.from_bal(arrays[0].astype("f4"), *arrays[1:])

    def test_lenses_that_are_no_such(self):
        with self.assertRaises(sheaf.Error):
            scenes.street()[0].to_bal()


class Files(unittest.TestCase):
    def test_errors_are_those_of_the_command(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "broken.txt"
            path.write_text("1 1 1\n0 0 x 1\n" + 12 * "0\n")
            with self.assertRaisesRegex(sheaf.Error, r"broken.txt:2: found") as caught:
                sheaf.read(path)
            self.assertIs(caught.exception.code, sheaf.ErrorCode.unreadable_input)
            with self.assertRaises(sheaf.Error) as caught:
                scenes.small()[0].write(f"{folder}/no/such/place.txt")
            self.assertIs(caught.exception.code, sheaf.ErrorCode.unwritable_output)

    def test_formats_and_conversion(self):
        start = scenes.street()[0]
        with tempfile.TemporaryDirectory() as folder:
            start.write(f"{folder}/model", format="colmap-text")
            read = sheaf.read(f"{folder}/model")
            self.assertEqual((read.format, read.names), ("colmap-text", start.names))
            lost = sheaf.convert(f"{folder}/model", f"{folder}/cloud.ply", max_error=1000.0)
            self.assertTrue(lost)
            self.assertTrue(pathlib.Path(f"{folder}/cloud.ply").exists())
        self.assertTrue(start.lost_in("nvm"))


class Stand:
    """As much of GTSAM's interface as sheaf uses, in the form of its older releases."""

    class Rot3(types.SimpleNamespace):
        def __init__(self, R):
            self.R = numpy.array(R)

        def matrix(self):
            return self.R

    class Pose3:
        def __init__(self, R, t):
            self.R, self.t = R, numpy.array(t)

        def rotation(self):
            return self.R

        def translation(self):
            return self.t

    class Cal3Bundler:
        def __init__(self, f, k1, k2, u0, v0):
            self.numbers = {"fx": f, "k1": k1, "k2": k2, "px": u0, "py": v0}

        def __getattr__(self, name):
            return lambda: self.numbers[name]

    class PinholeCameraCal3Bundler:
        def __init__(self, pose, K):
            self.parts = pose, K

        def pose(self):
            return self.parts[0]

        def calibration(self):
            return self.parts[1]

    class SfmTrack:
        def __init__(self, point):
            self.point, self.list = numpy.array(point), []

        def point3(self):
            return self.point

        def addMeasurement(self, image, uv):
            self.list.append((image, numpy.array(uv)))

        def numberMeasurements(self):
            return len(self.list)

        def measurement(self, k):
            return self.list[k]

    class SfmData:
        def __init__(self):
            self.cameras, self.tracks = [], []

        def addCamera(self, camera):
            self.cameras.append(camera)

        def addTrack(self, track):
            self.tracks.append(track)

        def numberCameras(self):
            return len(self.cameras)

        def numberTracks(self):
            return len(self.tracks)

        def camera(self, i):
            return self.cameras[i]

        def track(self, j):
            return self.tracks[j]


class Gtsam(unittest.TestCase):
    def check_both_ways(self, gtsam):
        start = scenes.small()[0]
        data = start.to_gtsam(gtsam)
        again = sheaf.Problem.from_gtsam(data)
        self.assertEqual(again.num_observations, start.num_observations)
        self.assertAlmostEqual(again.evaluate().cost / start.evaluate().cost, 1, places=10)
        # GTSAM looks along +z with y down, and so do RADIAL lenses.
        radial = start.without_bal_cameras()
        image, xy = data.track(0).measurement(0)
        of_point = radial.observation_point == 0
        self.assertIn(int(image), radial.observation_image[of_point].tolist())
        self.assertIn(numpy.asarray(xy).tolist(), radial.observation_xy[of_point].tolist())

    def test_with_a_stand_in(self):
        self.check_both_ways(Stand)
        with self.assertRaisesRegex(sheaf.Error, "Cal3Bundler is not OPENCV"):
            scenes.street()[0].to_gtsam(Stand)

    def test_with_gtsam_itself(self):
        try:
            import gtsam
        except ImportError:
            self.skipTest("gtsam is not installed")
        self.check_both_ways(gtsam)


class Pycolmap(unittest.TestCase):
    def test_is_not_something_else(self):
        with self.assertRaisesRegex(TypeError, "expected a pycolmap.Reconstruction, not int"):
            sheaf.Problem.from_pycolmap(3)

    def test_both_ways(self):
        try:
            import pycolmap
        except ImportError:
            self.skipTest("pycolmap is not installed")
        start = scenes.street()[0]
        rec = start.to_pycolmap()
        self.assertIsInstance(rec, pycolmap.Reconstruction)
        self.assertEqual(rec.num_points3D(), start.num_points)
        again = sheaf.Problem.from_pycolmap(rec)
        self.assertEqual(again.names, start.names)
        sheaf.solve(again)
        self.assertIs(again.to_pycolmap(rec), rec)
        again_cost = sheaf.Problem.from_pycolmap(rec).evaluate().cost
        self.assertAlmostEqual(again_cost / again.evaluate().cost, 1, places=9)


if __name__ == "__main__":
    unittest.main()
