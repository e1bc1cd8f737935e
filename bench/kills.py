#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Kills runs that write checkpoints, and goes on with each.

  kills.py SHEAF [--kills 300] [--seed 1]

Each run is killed (SIGKILL) after a random time, taken up again by another process from what it left,
perhaps killed again, and has to end with the bytes of the run that nobody touched. Four runs take
turns: a street by conjugate gradients under an automatic loss, a lakeside by a factor, an OPENCV lens
that all images share, and a rig. A run that was killed before its first checkpoint begins anew. The
last line has the counts; the exit code is 1 where bytes differ. --kills counts those that found a
checkpoint.
"""
import argparse
import collections
import os
import random
import subprocess
import sys
import tempfile
import time

RUNS = {
    "street": (["--family", "street", "--cameras", "120", "--points", "5000"], "in.txt",
               ["--tolerance", "1e-12", "--loss", "huber:auto", "--max-iterations", "30"]),
    "lakeside": (["--cameras", "60", "--points", "3000"], "in.txt",
                 ["--solver", "sparse", "--tolerance", "1e-12", "--loss", "cauchy:1"]),
    "opencv": (["--camera", "OPENCV", "--shared", "--cameras", "40", "--points", "2500"], "in",
               ["--tolerance", "1e-13", "--loss", "tukey:auto:gnc"]),
    "rigs": (["--camera", "RADIAL", "--rigs", "stereo", "--frames", "30", "--points", "2500"], "in",
             ["--tolerance", "1e-13", "--loss", "huber:0.5"]),
}


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sheaf", help="the command")
    parser.add_argument("--kills", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


def run(words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)}: {done.stderr}")


def contents(path):
    names = sorted(os.listdir(path)) if os.path.isdir(path) else [""]
    out = []
    for name in names:
        with open(os.path.join(path, name) if name else path, "rb") as file:
            out.append((name, file.read()))
    return out


def kill_once(words, seconds):
    """Whether it was killed, and not quicker."""
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    time.sleep(seconds)
    process.kill()
    return process.wait() != 0


def main():
    a = parse_arguments()
    sheaf = os.path.abspath(a.sheaf)
    draw = random.Random(a.seed)
    counts = collections.Counter()
    with tempfile.TemporaryDirectory() as folder:
        scenes = {}
        for name, (scene, start, options) in RUNS.items():
            place = os.path.join(folder, name)
            os.mkdir(place)
            start, whole = os.path.join(place, start), os.path.join(place, "whole")
            run([sheaf, "generate", start, "--quiet"] + scene)
            words = [sheaf, "solve", start, "--quiet"] + options
            began = time.perf_counter()
            run(words + ["-o", whole + os.path.splitext(start)[1]])
            took = time.perf_counter() - began
            scenes[name] = (words, place, took, contents(whole + os.path.splitext(start)[1]),
                            os.path.splitext(start)[1])
        while counts["kills with a checkpoint"] < a.kills:
            name = list(RUNS)[counts["runs"] % len(RUNS)]
            words, place, took, whole, extension = scenes[name]
            left, out = os.path.join(place, "left"), os.path.join(place, "out" + extension)
            if os.path.exists(left):
                os.remove(left)
            while draw.random() < 0.7:
                again = ["--resume", left] if os.path.exists(left) else []
                killed = kill_once(
                    words + ["-o", out, "--checkpoint", left, "--checkpoint-every", "0",
                             "--threads", str(draw.randint(1, 2))] + again,
                    draw.uniform(0, 1.2 * took))
                counts["kills"] += killed
                counts["kills with a checkpoint"] += killed and os.path.exists(left)
            run(words + ["-o", out] + (["--resume", left] if os.path.exists(left) else []))
            counts["runs"] += 1
            counts["ends that differ"] += contents(out) != whole
    print(", ".join(f"{value} {key}" for key, value in counts.items()))
    sys.exit(1 if counts["ends that differ"] else 0)


if __name__ == "__main__":
    main()
