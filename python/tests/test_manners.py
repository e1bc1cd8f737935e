# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Signals, callbacks, threads, forks and memory."""

import gc
import os
import resource
import signal
import sys
import threading
import time
import unittest

import scenes
import sheaf


class Callbacks(unittest.TestCase):
    def test_sees_every_step_and_may_stop(self):
        problem, seen = scenes.small()[0], []
        summary = sheaf.solve(problem, callback=seen.append)
        self.assertEqual([i.cost for i in seen], summary.iterations["cost"].tolist())
        again = scenes.small()[0]
        stopped = sheaf.solve(again, callback=lambda i: i.index < 2)
        self.assertEqual(stopped.termination, "stopped")
        self.assertEqual(stopped.final_cost, seen[2].cost)

    def test_runs_where_it_was_called(self):
        places = set()
        sheaf.solve(scenes.small()[0], callback=lambda i: places.add(threading.get_ident()))
        self.assertEqual(places, {threading.get_ident()})

    def test_exception_comes_out_unchanged_with_the_best_state_stored(self):
        class Enough(Exception):
            pass

        thrown = Enough("that will do")

        def callback(iteration):
            if iteration.index == 2:
                raise thrown

        problem, whole = scenes.small()[0], sheaf.solve(scenes.small()[0])
        with self.assertRaises(Enough) as caught:
            sheaf.solve(problem, callback=callback)
        self.assertIs(caught.exception, thrown)
        self.assertAlmostEqual(problem.evaluate().cost / whole.iterations["cost"][2], 1, places=9)

    def test_may_look_at_the_problem_and_not_change_it(self):
        problem, refusals = scenes.small()[0], []
        start = problem.points.copy()

        def callback(iteration):
            if not (problem.points == start).all():
                raise AssertionError("the state moved before the end")
            try:
                sheaf.solve(problem)
            except sheaf.Error as error:
                refusals.append(str(error))

        sheaf.solve(problem, callback=callback)
        self.assertEqual(set(refusals), {"the problem is in use by another call"})


class Signals(unittest.TestCase):
    def interrupted(self, problem):
        """Solves it until a signal comes that is sent once the solve has begun."""

        def interrupt():
            try:
                while True:
                    problem.num_observations
                    time.sleep(0.001)
            except sheaf.Error:  # The arrays are the solve's.
                os.kill(os.getpid(), signal.SIGINT)

        sender = threading.Thread(target=interrupt)
        sender.start()
        with self.assertRaises(KeyboardInterrupt):
            sheaf.solve(problem, **scenes.slow)
            time.sleep(60)  # Not reached: the signal is on its way.
        sender.join()

    def test_interrupt_ends_a_solve_with_the_best_state_stored(self):
        best = sheaf.solve(scenes.long(), tolerance=1e-3).final_cost
        costs = []
        while not costs or (costs[-1] < 1.01 * best and len(costs) < 3):
            problem = scenes.long()
            before = problem.evaluate().cost
            self.interrupted(problem)
            costs.append(problem.evaluate().cost)
            self.assertLessEqual(costs[-1], before)
            self.assertEqual(problem.num_observations, len(problem.observation_xy))
        self.assertGreater(costs[-1], 1.01 * best, "it went on to the end")

    def test_a_handler_that_raises_nothing_ends_nothing(self):
        problem, heard = scenes.small()[0], []
        old = signal.signal(signal.SIGUSR1, lambda *_: heard.append(1))
        try:
            summary = sheaf.solve(
                problem, callback=lambda i: os.kill(os.getpid(), signal.SIGUSR1)
            )
        finally:
            signal.signal(signal.SIGUSR1, old)
        self.assertTrue(heard)
        self.assertEqual(summary.termination, "cost_converged")


class Threads(unittest.TestCase):
    def test_two_solves_at_once(self):
        expected = sheaf.solve(scenes.small()[0]).final_cost
        found = []

        def work():
            for _ in range(5):
                found.append(sheaf.solve(scenes.small()[0]).final_cost)

        both = [threading.Thread(target=work) for _ in range(2)]
        for thread in both:
            thread.start()
        for thread in both:
            thread.join()
        self.assertEqual(found, [expected] * 10)

    def test_a_solve_leaves_the_lock_to_others(self):
        problem, seen = scenes.long(), []
        options = {**scenes.slow, "max_iterations": 1}
        thread = threading.Thread(target=lambda: sheaf.solve(problem, **options))
        thread.start()
        while thread.is_alive():
            try:
                problem.num_observations
            except sheaf.Error as error:
                seen.append(str(error))
                break
        thread.join()
        self.assertEqual(len(seen), 1)
        self.assertIn("has its arrays for itself", seen[0])


@unittest.skipUnless(hasattr(os, "fork"), "no fork here")
class Forks(unittest.TestCase):
    def test_child_solves_as_its_parent_did(self):
        expected = sheaf.solve(scenes.small()[0], threads=2).final_cost
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                found = sheaf.solve(scenes.small()[0], threads=2).final_cost
                os.write(writer, repr(found).encode())
            finally:
                os._exit(0)
        os.close(writer)
        with os.fdopen(reader) as pipe:
            self.assertEqual(float(pipe.read()), expected)
        self.assertEqual(os.waitpid(child, 0)[1], 0)


def resident_kib():
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS"))


class Memory(unittest.TestCase):
    @unittest.skipUnless(os.path.exists("/proc/self/status"), "no /proc here")
    def test_no_growth_over_many_solves(self):
        problem = sheaf.generate(cameras=4, points=40)[0]
        start = problem.copy()

        def solve_some(count):
            for _ in range(count):
                problem.poses[:] = start.poses
                problem.points = start.points
                problem.cameras = start.cameras
                sheaf.solve(problem, max_iterations=3, callback=lambda i: None)
                problem.copy().evaluate()
            gc.collect()

        solve_some(100)
        before = resident_kib()
        solve_some(int(os.environ.get("SHEAF_MANY_SOLVES", "300")))
        self.assertLess(resident_kib() - before, 4096)

    def test_nothing_is_left_of_what_is_let_go(self):
        problem = scenes.small()[0]
        count = sys.getrefcount(problem)
        view = problem.points
        self.assertGreater(sys.getrefcount(problem), count)
        del view
        sheaf.solve(problem, callback=lambda i: None)
        self.assertEqual(sys.getrefcount(problem), count)
        self.assertGreater(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, 0)


if __name__ == "__main__":
    unittest.main()
