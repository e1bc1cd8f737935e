# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Arrays in and views out."""

import copy
import gc
import pickle
import unittest
import weakref

import numpy

import scenes
import sheaf


class Construction(unittest.TestCase):
    def setUp(self):
        self.start = scenes.small()[0]
        self.arrays = scenes.arrays(self.start)

    def build(self, **changes):
        return sheaf.Problem(**{**self.arrays, **changes})

    def test_is_the_problem_again(self):
        built = self.build()
        self.assertEqual(
            sheaf.solve(built).final_cost, sheaf.solve(self.start.copy()).final_cost
        )

    def test_takes_integers_of_all_types_and_any_strides(self):
        for dtype in ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", ">i4"]:
            built = self.build(image_camera=self.arrays["image_camera"].astype(dtype))
            self.assertEqual(built.image_camera.tolist(), self.start.image_camera.tolist())
        wide = numpy.zeros((len(self.arrays["points"]), 6))
        wide[:, ::2] = self.arrays["points"]
        built = self.build(
            points=wide[:, ::2],
            observation_xy=numpy.asfortranarray(self.arrays["observation_xy"]),
            observation_image=self.arrays["observation_image"].tolist(),
        )
        self.assertTrue((built.points == self.start.points).all())
        self.assertTrue((built.observation_xy == self.start.observation_xy).all())

    def test_copies(self):
        built = self.build()
        self.arrays["points"][:] = 0
        self.assertTrue((built.points == self.start.points).all())

    def test_refuses_other_types_with_the_conversion_to_write(self):
        for name, dtype, words in [
            ("points", "f4", r"points: found an array of float32, expected float64: write "
                             r"points.astype\(numpy.float64\)"),
            ("observation_xy", "f2", "float16"),
            ("observation_image", "f8", r"observation_image.astype\(numpy.uint32\)"),
            ("poses", "c16", "complex128"),
            ("observation_point", "?", "bool"),
        ]:
            with self.subTest(name), self.assertRaisesRegex(TypeError, words):
                self.build(**{name: self.arrays[name].astype(dtype)})

    def test_refuses_what_is_out_of_range_or_does_not_fit(self):
        first = self.arrays["observation_image"].astype("i8")
        first[3] = -1
        huge = self.arrays["observation_point"].astype("u8")
        huge[5] = 2**32
        nan = self.arrays["points"].copy()
        nan[7, 1] = numpy.nan
        for changes, words in [
            ({"observation_image": first}, r"observation_image\[3\]: found -1, expected an index"),
            ({"observation_point": huge}, r"observation_point\[5\]: found 4294967296"),
            ({"points": nan}, "point 7: a coordinate is not finite"),
            ({"points": nan[:, :2]}, r"points: found the shape \(300, 2\), expected \(n, 3\)"),
            ({"poses": 2 * self.arrays["poses"]}, "pose 0: the rotation is not a unit quaternion"),
            ({"observation_image": first[4:]}, "observation arrays disagree in length"),
            ({"cameras": [("PINHOLE", [1, 2, 3])]}, "found 3 parameters, expected the 4 of PINHOLE"),
            ({"cameras": [("FISH", [1.0])]}, "found the model 'FISH', expected one of BAL"),
            ({"names": ["a"]}, "names: found 1 for 8 images"),
            ({"observation_sigma": numpy.zeros(len(first))}, "sigma is not a number above"),
            ({"rigs": {}}, "rigs: sensor_from_rig is missing"),
        ]:
            with self.subTest(words), self.assertRaisesRegex(sheaf.Error, words) as caught:
                self.build(**changes)
            self.assertEqual(caught.exception.code, 2)

    def test_cameras_by_name(self):
        lens = sheaf.Camera("PINHOLE", numpy.array([500.0, 510.0, 320.0, 240.0]), 640, 480)
        built = self.build(
            cameras=[lens, ("SIMPLE_RADIAL", [500, 320, 240, 0.01])],
            image_camera=[0, 1] * 4,
        )
        self.assertEqual(built.camera(0).model, "PINHOLE")
        self.assertEqual(built.camera(0).parameters.tolist(), [500, 510, 320, 240])
        self.assertEqual(built.camera(1).parameters.tolist(), [500, 320, 240, 0.01])
        self.assertEqual(built.cameras["width_px"].tolist(), [640, 0])
        self.assertEqual(
            [sheaf.CAMERA_MODELS[m] for m in built.cameras["model"]], ["PINHOLE", "SIMPLE_RADIAL"]
        )

    def test_rigs_and_names_go_through(self):
        start = scenes.street()[0]
        built = sheaf.Problem(**scenes.arrays(start), rigs=start.rigs, names=start.names)
        self.assertEqual(built.names, start.names)
        self.assertTrue((built.rigs.image_frame == start.rigs.image_frame).all())
        self.assertEqual(sheaf.solve(built).final_cost, sheaf.solve(start).final_cost)

    def test_sigmas_weigh(self):
        sigma = numpy.full(self.start.num_observations, 2.0)
        built = self.build(observation_sigma=sigma)
        self.assertAlmostEqual(built.evaluate().cost * 4 / self.start.evaluate().cost, 1, places=12)


class Views(unittest.TestCase):
    def test_are_the_memory_of_the_problem(self):
        problem = scenes.small()[0]
        for name in ["poses", "points", "cameras", "image_camera", "observation_image",
                     "observation_point", "observation_xy", "observation_sigma"]:
            one, two = getattr(problem, name), getattr(problem, name)
            self.assertTrue(one.flags.c_contiguous and one.flags.writeable, name)
            if one.size:
                self.assertTrue(numpy.shares_memory(one, two), name)
        problem.points[5] = [1, 2, 3]
        problem.cameras["parameters"][2, 0] = 777
        self.assertEqual(problem.points[5].tolist(), [1, 2, 3])
        self.assertEqual(problem.camera(2).parameters[0], 777)

    def test_see_what_a_solve_did(self):
        problem = scenes.small()[0]
        poses, points = problem.poses, problem.points[10:20]
        start = poses.copy(), points.copy()
        sheaf.solve(problem)
        self.assertFalse((poses == start[0]).all() or (points == start[1]).all())
        self.assertTrue((poses == problem.poses).all())

    def test_keep_their_problem_alive(self):
        problem = scenes.small()[0]
        expected = problem.points.sum()
        alive = weakref.ref(problem)
        part = problem.points[::2]
        whole = part.base
        del problem
        gc.collect()
        self.assertIsNotNone(alive())
        self.assertEqual(whole.sum(), expected)
        del part, whole
        gc.collect()
        self.assertIsNone(alive())

    def test_resizing_while_one_lives_is_an_error(self):
        problem = scenes.small()[0]
        view = problem.observation_xy[3:]
        for resize in [
            lambda: problem.clean(max_error=5),
            lambda: sheaf.perturb(problem, min_depth=1.0),
            lambda: setattr(problem, "points", numpy.zeros((3, 3))),
        ]:
            with self.assertRaisesRegex(sheaf.Error, "would resize a problem that 1 array is"):
                resize()
        del view
        self.assertGreater(problem.clean(max_error=5).observations, 0)

    def test_what_is_written_into_them_is_checked_by_each_call(self):
        def image(problem):
            problem.observation_image[7] = 99

        def lens(problem):
            problem.image_camera[2] = 50

        def model(problem):
            problem.cameras["model"][1] = 200

        other = scenes.small()[0]
        calls = [
            sheaf.solve, sheaf.check, sheaf.covariance, sheaf.perturb, sheaf.Problem.evaluate,
            sheaf.Problem.to_bal, sheaf.Problem.clean, sheaf.Problem.without_bal_cameras,
            lambda p: sheaf.align(p, other), lambda p: sheaf.align(other, p),
            lambda p: sheaf.evaluate(p, other), lambda p: p.lost_in("nvm"),
            lambda p: p.write("nowhere"),
        ]
        for spoil, words in [
            (image, "observation 7.*99"),
            (lens, "image 2.*50"),
            (model, "camera 1 has the model number 200"),
        ]:
            problem = scenes.small()[0]
            spoil(problem)
            for call in calls:
                with self.subTest(words), self.assertRaisesRegex(sheaf.Error, words):
                    call(problem)
            self.assertEqual(problem.copy().num_points, problem.num_points)
            pickle.dumps(problem)
        with self.assertRaisesRegex(sheaf.Error, "found the model number 200"):
            problem.camera(1)
        with self.assertRaisesRegex(sheaf.Error, "camera 1 has the model number 200"):
            problem.add_parameter_prior(1, "f", 1.0, 1.0)

    def test_setting_one_of_the_same_size_is_in_place(self):
        problem = scenes.small()[0]
        view = problem.points
        problem.points = numpy.ones_like(view)
        self.assertTrue((view == 1).all())


class Copies(unittest.TestCase):
    def test_are_apart(self):
        problem = scenes.small()[0]
        for other in [problem.copy(), copy.copy(problem), copy.deepcopy(problem)]:
            other.points[0] = 0
            self.assertFalse((problem.points[0] == 0).all())

    def test_pickles_hold_everything(self):
        problem = scenes.street()[0]
        problem.observation_sigma = numpy.full(problem.num_observations, 1.5)
        problem.add_centre_prior(0, [0, 0, 0.5], sigma=[0.1, 0.1, 0.2], loss="cauchy:3")
        problem.add_parameter_bound(0, "k1", lower=-1)
        again = pickle.loads(pickle.dumps(problem))
        self.assertEqual(pickle.dumps(again), pickle.dumps(problem))
        self.assertEqual(again.names, problem.names)
        self.assertEqual(again.priors, problem.priors)
        self.assertEqual(sheaf.solve(again).final_cost, sheaf.solve(problem).final_cost)
        cut = bytearray(problem.__getstate__())[:-9]
        with self.assertRaisesRegex(sheaf.Error, "ends too early"):
            sheaf.Problem.__new__(sheaf.Problem).__setstate__(bytes(cut))

    def test_summaries_and_errors_pickle(self):
        summary = sheaf.solve(scenes.small()[0])
        again = pickle.loads(pickle.dumps(summary))
        self.assertEqual(again.to_dict(), summary.to_dict())
        self.assertEqual(copy.deepcopy(summary).final_cost, summary.final_cost)
        error = pickle.loads(pickle.dumps(sheaf.Error("no", 5)))
        self.assertEqual((str(error), error.code), ("no", sheaf.ErrorCode.memory_limit))


if __name__ == "__main__":
    unittest.main()
