# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""The other verbs as functions."""

import json
import pathlib
import tempfile
import unittest

import numpy

import scenes
import sheaf


class Scenes(unittest.TestCase):
    @scenes.needs_command
    def test_generate_and_perturb_are_the_command(self):
        with tempfile.TemporaryDirectory() as folder:
            theirs, ours = pathlib.Path(folder) / "theirs.txt", pathlib.Path(folder) / "ours.txt"
            scenes.run_command("generate", theirs, "--cameras", 8, "--points", 300, "--seed", 4)
            start = scenes.small()[0]
            start.write(ours)
            self.assertEqual(ours.read_bytes(), theirs.read_bytes())
            scenes.run_command("perturb", ours, theirs, "--protocol", "rootba", "--seed", 9)
            record = sheaf.perturb(start, protocol="rootba", seed=9)
            start.write(ours)
            self.assertEqual(ours.read_bytes(), theirs.read_bytes())
            self.assertNotEqual(record.scale, 1)

    def test_kinds_and_company(self):
        start, truth = sheaf.generate(camera="OPENCV_FISHEYE", shared=True, cameras=6, points=200)
        self.assertEqual(start.camera(0).model, "OPENCV_FISHEYE")
        self.assertLess(truth.evaluate().cost, start.evaluate().cost)
        with self.assertRaisesRegex(sheaf.Error, "rig_sensors needs rigs"):
            sheaf.generate(rig_sensors=3)


class Reports(unittest.TestCase):
    def test_report_is_one_page(self):
        start, truth = scenes.small()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "report.html"
            truth.report(path, before=start, title="<b>A title</b>")
            page = path.read_text(encoding="utf-8")
            self.assertIn("<h1>&lt;b&gt;A title", page)
            self.assertIn('>before <span>', page)
            truth.report(path)
            self.assertNotIn("<h1>&lt;b&gt;A title", path.read_text(encoding="utf-8"))
            with self.assertRaisesRegex(sheaf.Error, "nothing.json"):
                truth.report(path, summary=pathlib.Path(folder) / "nothing.json")

    def test_evaluate_align_and_check(self):
        start, truth = scenes.small()
        sheaf.solve(start)
        errors = sheaf.evaluate(start, truth)
        self.assertEqual(errors.center.shape, (8,))
        self.assertAlmostEqual(
            errors.statistics["center_error"]["rms"], numpy.sqrt((errors.center**2).mean())
        )
        raw = sheaf.evaluate(start, truth, no_align=True)
        self.assertIsNone(raw.similarity)
        alignment = sheaf.align(start, truth, least_squares=True)
        self.assertAlmostEqual(alignment.similarity.scale, errors.similarity.scale, places=9)
        moved = sheaf.evaluate(start, truth, no_align=True)
        self.assertTrue(numpy.allclose(moved.center, errors.center, atol=1e-9))
        with self.assertRaisesRegex(sheaf.Error, "onto what"):
            sheaf.align(start)
        self.assertAlmostEqual(sheaf.align(start, start).similarity.scale, 1, places=12)
        self.assertEqual([f.code for f in sheaf.check(start) if f.grave], [])
        weak, _ = scenes.small()
        weak.observation_image[:] = weak.observation_image % 4
        self.assertTrue(any(f.grave and f.words for f in sheaf.check(weak)))

    def test_covariance_is_of_the_problem(self):
        start, _ = scenes.small()
        sheaf.solve(start)
        told = sheaf.covariance(start, observations=True, gauge="first-two")
        self.assertEqual(told.gauge, "first-two")
        self.assertEqual(told.poses.shape, (8, 6, 6))
        self.assertEqual(told.points.shape, (300, 3, 3))
        self.assertEqual(told.lenses[0].shape, (3, 3))
        self.assertEqual(told.observation_redundancy.shape, (start.num_observations, 2))
        self.assertAlmostEqual(told.observation_redundancy.sum() / told.redundancy, 1, places=6)
        self.assertGreater(numpy.linalg.eigvalsh(told.points[0])[0], 0)
        some = sheaf.covariance(start, points=[7, 3], gauge="first-two", fix=["k"])
        self.assertEqual(some.points.shape, (2, 3, 3))
        self.assertEqual(sheaf.covariance(start, points=False).points.shape, (0, 3, 3))
        two = sheaf.covariance(
            start, images=[5, 2], pairs=[[5, 2]], points=False, solver="conjugate-gradients",
            gauge="first-two",
        )
        self.assertEqual((two.poses.shape, two.pairs.shape), ((2, 6, 6), (1, 6, 6)))
        self.assertTrue(numpy.allclose(two.poses[0], told.poses[5], rtol=1e-4, atol=1e-12))
        value, sigma = two.distances[0]
        self.assertTrue(0 < sigma < value)

    @scenes.needs_command
    def test_covariance_is_the_commands(self):
        start, _ = scenes.small()
        sheaf.solve(start)
        with tempfile.TemporaryDirectory() as folder:
            start.write(f"{folder}/end.txt")
            scenes.run_command("covariance", f"{folder}/end.txt", "--json", f"{folder}/c.json")
            told = json.loads(pathlib.Path(f"{folder}/c.json").read_text())
            ours = sheaf.covariance(sheaf.read(f"{folder}/end.txt"))
        self.assertEqual(ours.sigma, told["sigma"]["value"])
        self.assertEqual(ours.unknowns, told["unknowns"])


class Surveys(unittest.TestCase):
    def setUp(self):
        self.start, truth = scenes.street()
        R = truth.poses[:, :4]
        self.centres = [self.centre(q, t) for q, t in zip(R, truth.poses[:, 4:])]
        self.constraints = {
            "frame": {"kind": "projected", "name": "EPSG:32633"},
            "positions": [
                {"image": name, "xyz": c + [500000, 4650000, 300], "sigma": 0.01}
                for name, c in zip(truth.names, self.centres)
            ],
        }

    @staticmethod
    def centre(q, t):
        w, v = q[0], q[1:]
        # -R^T t: R^T turns about -v.
        return -(t + 2 * numpy.cross(-v, numpy.cross(-v, t) + w * t))

    def test_a_dict_is_a_survey(self):
        view = self.start.points
        summary = sheaf.solve(self.start, constraints=self.constraints)
        self.assertEqual(summary.survey["positions"], len(self.centres))
        rmse = numpy.array(summary.survey["residuals"]["positions_rmse"])
        self.assertLess(rmse.max(), 0.1)
        self.assertEqual(self.start.num_points, len(view))
        again = scenes.street()[0]
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "survey.json"
            path.write_text(json.dumps(self.constraints, default=lambda a: a.tolist()))
            by_file = sheaf.solve(again, constraints=[path])
        self.assertEqual(by_file.final_cost, summary.final_cost)
        self.assertTrue((again.points == view).all())

    def test_motion_alone_and_errors(self):
        alignment = sheaf.align(self.start, constraints=self.constraints, to="positions")
        self.assertEqual(alignment.survey["positions"], len(self.centres))
        with self.assertRaisesRegex(sheaf.Error, "constraints:"):
            sheaf.solve(self.start, constraints={"postions": []})


class Priors(unittest.TestCase):
    def test_each_kind_costs_and_is_kept(self):
        start, _ = scenes.small()
        plain = start.evaluate().cost
        start.add_centre_prior(0, [5, 5, 5], sigma=0.5)
        start.add_rotation_prior(1, [1, 0, 0, 0], covariance=0.01 * numpy.eye(3))
        start.add_gravity_prior(2, [0, 1, 0], 0.01, loss="huber:2")
        start.add_relative_pose_prior(0, 1, [1, 0, 0, 0, 0, 0, 1], numpy.eye(6))
        start.add_parameter_prior(3, "f", 900.0, 1.0)
        start.add_point_prior(4, [0, 0, 0], sigma=1.0)
        start.add_distance_prior(1, 2, 100.0, 0.1)
        start.add_gaussian_prior(
            [("pose", 5, start.poses[6]), ("point", 9, [0, 0, 0])], numpy.eye(9), numpy.zeros(9)
        )
        start.add_parameter_bound(0, "k1", lower=-1, upper=1)
        self.assertEqual(
            start.priors,
            {"centres": 1, "rotations": 1, "gravities": 1, "relative_poses": 1, "parameters": 1,
             "points": 1, "distances": 1, "gaussians": 1, "bounds": 1},
        )
        self.assertGreater(start.evaluate().cost, plain)
        summary = sheaf.solve(start, max_iterations=30)
        self.assertTrue(all(cost > 0 for cost in summary.initial_terms.values()))
        self.assertLess(summary.final_terms["distances"], summary.initial_terms["distances"])
        self.assertAlmostEqual(start.evaluate().cost / summary.final_cost, 1, places=9)
        start.clear_priors()
        self.assertEqual(sum(start.priors.values()), 0)

    def test_refusals(self):
        start, _ = scenes.small()
        for call, words in [
            (lambda: start.add_centre_prior(99, [0, 0, 0], sigma=1.0), "image"),
            (lambda: start.add_centre_prior(0, [0, 0], sigma=1.0), "found 2 numbers, expected 3"),
            (lambda: start.add_centre_prior(0, [0, 0, 0]), "either covariance or sigma"),
            (lambda: start.add_parameter_prior(0, "fx", 1.0, 1.0), "BAL has no fx"),
        ]:
            with self.subTest(words), self.assertRaisesRegex(sheaf.Error, words):
                call()
        self.assertEqual(sum(start.priors.values()), 0)


class Photometric(unittest.TestCase):
    def test_refines_and_writes(self):
        start, truth = sheaf.generate_photometric(cameras=3, points=300, seed=3)
        seen, refused = [], []

        def callback(iteration):
            seen.append(iteration)
            try:
                start.poses
            except sheaf.Error as error:
                refused.append(str(error))

        summary = sheaf.photometric(start, max_iterations=20, callback=callback)
        self.assertEqual(set(refused), {"the folder is in use by another call"})
        self.assertLess(summary.final_rms_grey, 0.2 * summary.initial_rms_grey)
        self.assertEqual(len(seen), len(summary.solve.iterations))
        self.assertEqual(summary.details.sigma.shape[0], start.num_points)
        self.assertEqual((start.poses.shape, truth.points.shape), ((3, 7), (300, 3)))
        with tempfile.TemporaryDirectory() as folder:
            start.write(folder)
            read = sheaf.read_photometric(folder)
            self.assertEqual((read.format, read.num_images), ("direct", 3))
        with self.assertRaisesRegex(sheaf.Error, "levels"):
            sheaf.photometric(start, levels=0)

    def test_arrays_are_the_folder(self):
        start, _ = sheaf.generate_photometric(cameras=3, points=300, seed=3)
        built = sheaf.PhotometricFolder(
            [start.image(i).astype("f4") for i in range(3)],
            start.camera, start.poses, start.points, start.host, start.host_xy,
        )
        ends = [sheaf.photometric(f, max_iterations=5).solve.final_cost for f in (start, built)]
        self.assertEqual(*ends)
        with self.assertRaisesRegex(sheaf.Error, "expected fx, fy, cx, cy"):
            sheaf.PhotometricFolder(
                [start.image(0)], [1.0], start.poses, start.points, start.host, start.host_xy
            )


if __name__ == "__main__":
    unittest.main()
