#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Holds the README against the program.

  check-readme.py --extract FILE                     write the README's C++ program to FILE
  check-readme.py --command SHEAF --program PROGRAM  run its shell commands and the compiled program

Shell blocks (```sh) are read line by line: scripts must exist and be executable; lines that start
with `sheaf` are run in a scratch folder that holds a small generated scene under each of the input
names the README uses. Other documents are held to the same: their `sheaf` lines are run, too.
"""

import argparse
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SCENE = "problem-16-22106-pre.txt"  # the name the README uses for the input


def blocks(path, language):
    text = path.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def program():
    found = [b for b in blocks(ROOT / "README.md", "cpp") if "int main" in b]
    if len(found) != 1:
        sys.exit(f"README.md: {len(found)} C++ programs with a main, expected one")
    return found[0]


def run(words, where):
    result = subprocess.run(words, cwd=where, capture_output=True, text=True, timeout=120)
    if result.returncode != 0:
        sys.exit(f"{shlex.join(map(str, words))}: exit {result.returncode}\n"
                 f"{result.stdout}\n{result.stderr}")
    return result.stdout


def check_shell(path, command, scratch):
    """Runs one document's `sheaf` lines in order, and looks for the scripts the others name."""
    ran = 0
    for block in blocks(path, "sh"):
        for line in block.replace("\\\n", " ").splitlines():
            words = shlex.split(line, comments=True)
            if not words:
                continue
            if words[0] == "sheaf":
                run([command, *words[1:]], scratch)
                ran += 1
            elif words[0].startswith("scripts/"):
                script = ROOT / words[0]
                if not script.is_file() or not script.stat().st_mode & 0o100:
                    sys.exit(f"{path.name}: {words[0]} is not an executable script")
    return ran


def check_links(path):
    """Every relative link of a document points to a file that is there."""
    for target in re.findall(r"\]\(([^)#\s]+)", path.read_text(encoding="utf-8")):
        if "://" not in target and not (path.parent / target).exists():
            sys.exit(f"{path.name}: links to {target}, which is not there")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--extract")
    parser.add_argument("--command")
    parser.add_argument("--program")
    arguments = parser.parse_args()
    if arguments.extract:
        target = pathlib.Path(arguments.extract)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text(program(), encoding="utf-8")
        return

    lines = len([line for line in program().splitlines() if line.strip()])
    if lines > 15:
        sys.exit(f"README.md: the program has {lines} lines, more than 15")
    documents = [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md")), *sorted(ROOT.glob("*/README.md"))]
    for document in documents:
        check_links(document)
    scratch = pathlib.Path(tempfile.mkdtemp(prefix="sheaf-readme."))
    try:
        scene = scratch / SCENE
        run([arguments.command, "generate", scene, "--cameras", "8", "--points", "400"], scratch)
        ran = sum(check_shell(d, arguments.command, scratch) for d in documents)
        if ran == 0:
            sys.exit("no `sheaf` line was found in any document")
        output = run([arguments.program], scratch)
        print(f"{ran} commands and the program ran; the program said:\n{output}")
    finally:
        shutil.rmtree(scratch)


if __name__ == "__main__":
    main()
