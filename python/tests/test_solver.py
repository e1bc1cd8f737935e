# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
import threading
import unittest

import numpy

import scenes
import sheaf


class Solver(unittest.TestCase):
    def changed(self, problem, seed):
        rng = numpy.random.default_rng(seed)
        problem.observation_xy[:] += 0.1 * rng.normal(size=problem.observation_xy.shape)
        problem.points[:] += 1e-3 * rng.normal(size=problem.points.shape)
        problem.observation_sigma[:] = rng.uniform(0.5, 2, problem.num_observations)
        problem.observation_sigma[rng.random(problem.num_observations) < 0.1] = numpy.inf
        return problem

    def test_has_the_bits_of_solve(self):
        start = scenes.small()[0]
        start.observation_sigma = numpy.ones(start.num_observations)
        options = {"loss": "huber:auto", "fix": ["k", "pose=0"], "max_iterations": 12}
        solver = sheaf.Solver(**options)
        for seed in range(4):
            expected = self.changed(start.copy(), seed)
            found = expected.copy()
            told = sheaf.solve(expected, **options)
            summary = solver.solve(found)
            self.assertEqual(solver.was_kept, seed > 0)
            self.assertEqual(summary.final_cost, told.final_cost)
            self.assertEqual(summary.final_rms_px, told.final_rms_px)
            numpy.testing.assert_array_equal(found.points, expected.points)
            numpy.testing.assert_array_equal(found.poses, expected.poses)
        solver.forget()
        solver.solve(start)
        self.assertFalse(solver.was_kept)

    def test_callbacks_end_a_run_and_no_more(self):
        solver = sheaf.Solver()
        seen = []
        problem = scenes.small()[0]
        summary = solver.solve(problem.copy(), callback=lambda it: seen.append(it.index) or it.index < 2)
        self.assertEqual(summary.termination, "stopped")
        self.assertEqual(seen, [0, 1, 2])
        self.assertEqual(solver.solve(problem.copy()).termination, "cost_converged")
        self.assertTrue(solver.was_kept)
        with self.assertRaisesRegex(ZeroDivisionError, "division"):
            solver.solve(problem.copy(), callback=lambda it: 1 / 0)
        self.assertEqual(solver.solve(problem.copy()).termination, "cost_converged")

    def test_what_is_wrong(self):
        with self.assertRaisesRegex(TypeError, "iterations"):
            sheaf.Solver(iterations=3)
        with self.assertRaisesRegex(sheaf.Error, "tolerance: expected"):
            sheaf.Solver(tolerance=-1.0)
        solver = sheaf.Solver(fix="camera=99")
        with self.assertRaises(sheaf.Error):
            solver.solve(scenes.small()[0])

    def test_one_problem_at_a_time(self):
        solver = sheaf.Solver()
        begun, ended = threading.Event(), threading.Event()

        def wait(_):
            begun.set()
            ended.wait(10)

        other = threading.Thread(target=lambda: solver.solve(scenes.small()[0], callback=wait))
        other.start()
        begun.wait(10)
        try:
            with self.assertRaisesRegex(sheaf.Error, "at work"):
                solver.solve(scenes.small()[0])
        finally:
            ended.set()
            other.join()


class Windows(unittest.TestCase):
    def test_slide_is_marginalise_in_place(self):
        problem = scenes.small()[0]
        points = numpy.unique(problem.observation_point[problem.observation_image == 0])
        prior = sheaf.marginalise(problem, [0], points, loss="huber:2", fix="intrinsics")
        kinds = {kind for kind, _, _ in prior["blocks"]}
        self.assertEqual(kinds, {"pose"})
        self.assertEqual(prior["square_root"].shape[1], 6 * len(prior["blocks"]))
        self.assertEqual(prior["mean"].shape, (6 * len(prior["blocks"]),))
        images, left = problem.num_images, problem.num_points - len(points)
        to = sheaf.slide(problem, [0], points, loss="huber:2", fix="intrinsics")
        self.assertEqual((problem.num_images, problem.num_points), (images - 1, left))
        self.assertEqual(to["image"].tolist(), [2**32 - 1, *range(images - 1)])
        self.assertEqual((to["point"] == 2**32 - 1).sum(), len(points))
        self.assertEqual(problem.priors["gaussians"], 1)
        again = problem.copy()
        again.clear_priors()
        prior["blocks"] = [(kind, i - 1, state) for kind, i, state in prior["blocks"]]
        again.add_gaussian_prior(**prior)
        one = sheaf.solve(problem, loss="huber:2", fix="intrinsics")
        two = sheaf.solve(again, loss="huber:2", fix="intrinsics")
        self.assertEqual(one.final_cost, two.final_cost)
        numpy.testing.assert_array_equal(problem.poses, again.poses)

    def test_what_is_wrong(self):
        problem = scenes.small()[0]
        with self.assertRaisesRegex(sheaf.Error, "image 99 is to leave"):
            sheaf.marginalise(problem, [99], [])
        with self.assertRaisesRegex(sheaf.Error, "scale above 0"):
            sheaf.slide(problem, [0], [], loss="huber:auto")
        view = problem.points
        with self.assertRaises(sheaf.Error):
            sheaf.slide(problem, [0], [])
        del view


if __name__ == "__main__":
    unittest.main()
