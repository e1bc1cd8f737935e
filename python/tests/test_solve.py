# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
import inspect
import json
import pathlib
import re
import tempfile
import unittest

import numpy

import scenes
import sheaf


class AgainstTheCommand(unittest.TestCase):
    def check_same(self, path, *words, **options):
        """Costs to the last digit, and the bytes of the refined problem."""
        with tempfile.TemporaryDirectory() as folder:
            theirs, ours = pathlib.Path(folder) / "theirs.txt", pathlib.Path(folder) / "ours.txt"
            document = pathlib.Path(folder) / "summary.json"
            scenes.run_command("solve", path, "-o", theirs, "--json", document, *words)
            problem = sheaf.read(path)
            summary = sheaf.solve(problem, **options)
            problem.write(ours)
            told = json.loads(document.read_text())
            self.assertEqual(summary.initial_cost, told["initial_cost"])
            self.assertEqual(summary.final_cost, told["final_cost"])
            self.assertEqual(summary.termination, told["termination"]["code"])
            self.assertEqual(
                summary.iterations["cost"].tolist(), [i["cost"] for i in told["iterations"]]
            )
            self.assertEqual(ours.read_bytes(), theirs.read_bytes())

    @scenes.needs_command
    @unittest.skipUnless(scenes.DUBROVNIK.exists(), "dubrovnik-16 is not there")
    def test_dubrovnik(self):
        self.check_same(scenes.DUBROVNIK)

    @scenes.needs_command
    def test_generated_with_options(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "scene.txt"
            scenes.small()[0].write(path)
            self.check_same(path)
            self.check_same(
                path,
                *("--loss", "cauchy:1.5", "--fix", "k,pose=0", "--max-iterations", "7"),
                *("--solver", "sparse", "--memory-limit", "2G"),
                loss="cauchy:1.5",
                fix=["k", "pose=0"],
                max_iterations=7,
                solver="sparse",
                memory_limit="2G",
            )


class Options(unittest.TestCase):
    def test_all_of_the_table_are_keywords(self):
        page = (scenes.ROOT / "docs/options.md").read_text()
        solve = re.search(r"^## solve\n(.*?)^## photometric", page, re.M | re.S).group(1)
        names = re.findall(r"^\| `--([a-z-]+)", solve, re.M)
        self.assertGreater(len(names), 15)
        signature = sheaf.solve.__doc__.splitlines()[0]
        for name in names:
            self.assertIn(f" {name.replace('-', '_')}: ", signature)

    def test_refusals_name_the_option(self):
        problem = scenes.small()[0]
        for options, words in [
            ({"max_iterations": -1}, "max_iterations: expected a whole number from 0 up, not '-1'"),
            ({"time_limit": 0.0}, "time_limit: expected a number of seconds above 0"),
            ({"solver": "quick"}, "solver: expected"),
            ({"loss": "hubris"}, "loss: expected none, or huber"),
            ({"fix": "pose=99"}, "pose=99"),
            ({"trust_region": "dogleg", "points": "homogeneous"}, "dogleg"),
        ]:
            with self.subTest(options), self.assertRaises(sheaf.Error) as caught:
                sheaf.solve(problem, **options)
            self.assertIn(words, str(caught.exception))
            self.assertIs(caught.exception.code, sheaf.ErrorCode.usage)
        for options, words in [
            ({"max_iterations": 1.5}, "max_iterations: expected a whole number, not float"),
            ({"tolerance": "small"}, "tolerance: expected a number, not str"),
            ({"fix": 3}, "fix: expected a list of texts"),
            ({"iterations": 3}, "unexpected keyword argument 'iterations'"),
            ({"callback": 3}, "callback: expected a function"),
            ({"constraints": 3}, "constraints: expected a path"),
        ]:
            with self.subTest(options), self.assertRaisesRegex(TypeError, words):
                sheaf.solve(problem, **options)

    def test_numpy_numbers_are_numbers(self):
        problem = scenes.small()[0]
        summary = sheaf.solve(
            problem,
            max_iterations=numpy.int32(2),
            tolerance=numpy.float64(1e-9),
            time_limit=None,
            fix=("points",),
        )
        self.assertLessEqual(len(summary.iterations), 3)

    def test_what_is_fixed_keeps_its_bits(self):
        problem = scenes.small()[0]
        points, poses = problem.points.copy(), problem.poses.copy()
        sheaf.solve(problem, fix="points")
        self.assertTrue((problem.points == points).all())
        self.assertFalse((problem.poses == poses).all())

    def test_memory_limit_is_an_error_of_its_own(self):
        with self.assertRaises(sheaf.Error) as caught:
            sheaf.solve(scenes.small()[0], memory_limit=1000)
        self.assertIs(caught.exception.code, sheaf.ErrorCode.memory_limit)


class Summaries(unittest.TestCase):
    def setUp(self):
        self.problem = scenes.small()[0]
        self.summary = sheaf.solve(self.problem)

    def test_fields(self):
        s = self.summary
        self.assertTrue(s.usable)
        self.assertEqual(s.termination, "cost_converged")
        self.assertEqual(s.iterations["cost"][-1], s.final_cost)
        self.assertEqual(s.iterations["index"].tolist(), list(range(len(s.iterations))))
        self.assertAlmostEqual(self.problem.evaluate().cost / s.final_cost, 1, places=12)
        self.assertIn("cost", repr(s))

    def test_to_dict_is_plain(self):
        told = json.loads(json.dumps(self.summary.to_dict()))
        self.assertEqual(told["final_cost"], self.summary.final_cost)
        self.assertEqual(len(told["iterations"]), len(self.summary.iterations))
        self.assertEqual(told["iterations"][1]["cost"], self.summary.iterations["cost"][1])

    def test_html_has_costs_words_and_a_curve(self):
        page = self.summary._repr_html_()
        self.assertIn(f"{self.summary.final_cost:.9e}", page)
        self.assertIn(self.summary.words.split(":")[0], page)
        self.assertEqual(page.count("<circle"), len(self.summary.iterations))

    def test_signature_is_that_of_the_stub(self):
        self.assertIn("callback", sheaf.solve.__doc__)
        self.assertFalse(inspect.isclass(sheaf.solve))


if __name__ == "__main__":
    unittest.main()
