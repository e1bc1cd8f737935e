# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""What surrounds the functions: types, the command, the page."""

import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest

import scenes
import sheaf

PACKAGE = pathlib.Path(sheaf.__file__).parent


def run_python(*words, **options):
    return subprocess.run(
        [sys.executable, *map(str, words)], capture_output=True, text=True, timeout=300, **options
    )


class Package(unittest.TestCase):
    def test_all_is_there_and_documented(self):
        for name in sheaf.__all__:
            thing = getattr(sheaf, name)
            if callable(thing):
                self.assertTrue(thing.__doc__, name)
        self.assertRegex(sheaf.__version__, r"^\d+\.\d+\.\d+$")

    def test_the_command(self):
        version = run_python("-m", "sheaf", "--version")
        self.assertEqual(version.stdout, f"sheaf {sheaf.__version__}\n")
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder) / "scene.txt"
            self.assertEqual(
                run_python("-m", "sheaf", "generate", scene, "--cameras", 6).returncode, 0
            )
            self.assertEqual(sheaf.read(scene).num_images, 6)
        missing = run_python("-m", "sheaf", "solve", "/no/such/file")
        self.assertEqual(missing.returncode, 3)
        self.assertIn("sheaf solve: /no/such/file: found", missing.stderr)

    def test_the_command_is_interrupted_as_a_command(self):
        with tempfile.TemporaryDirectory() as folder:
            scene, out = pathlib.Path(folder) / "scene.txt", pathlib.Path(folder) / "out.txt"
            scenes.long().write(scene)
            words = ["solve", scene, "-o", out, "--simd", "scalar", "--threads", "1"]
            words += ["--tolerance", "0", "--inner-iterations", "60"]
            running = subprocess.Popen(
                [sys.executable, "-m", "sheaf", *map(str, words)],
                stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            )
            with running, running.stderr:
                running.stderr.readline()  # What it is solved by: the solve has begun.
                running.send_signal(signal.SIGINT)
                rest = running.stderr.read()
            self.assertEqual(running.returncode, 130, rest)
            self.assertEqual(sheaf.read(out).num_images, 60)

    def test_version_is_that_of_the_build(self):
        project = (scenes.ROOT / "pyproject.toml").read_text()
        self.assertEqual(re.search(r'^version = "(.*)"', project, re.M).group(1), sheaf.__version__)

    def test_types(self):
        if run_python("-c", "import mypy").returncode != 0:
            self.skipTest("mypy is not installed")
        program = pathlib.Path(__file__).parent / "typed_program.py"
        with tempfile.TemporaryDirectory() as cache:
            checked = run_python(
                "-m", "mypy", "--strict", "--cache-dir", cache, PACKAGE, program,
                env={**os.environ, "MYPYPATH": str(PACKAGE.parent)},
            )
        self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)

    def test_pages_run(self):
        """The Python of a page is one program, in the order of the page."""
        for page in ["docs/python.md", "README.md"]:
            text = (scenes.ROOT / page).read_text()
            blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
            self.assertTrue(blocks, page)
            with tempfile.TemporaryDirectory() as folder:
                scenes.small(cameras=16)[0].write(f"{folder}/problem.txt")
                scenes.street()[0].write(f"{folder}/model", format="colmap")
                program = pathlib.Path(folder) / "program.py"
                program.write_text("\n".join(blocks))
                env = {**os.environ, "PYTHONPATH": str(PACKAGE.parent)}
                ran = run_python(program, cwd=folder, env=env)
                self.assertEqual(ran.returncode, 0, f"{page}\n{ran.stdout}{ran.stderr}")


if __name__ == "__main__":
    unittest.main()
