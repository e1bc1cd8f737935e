#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""What positions of all images cost a solve: survey.py SHEAF [--only TEXT] [--pairs N]

Each scene is made by `sheaf generate`; its positions are the true centres with noise, and `sheaf
align` moves it to them. It is then solved without and with them in turns (the order changes from pair to pair), one thread, the same number of
steps. Seconds are those of set-up and solve, the clock's or with --cpu the processor's; the ratio is
the median of the pairs, and its spread their quartiles. "all" is the processor's time of the whole
command, reading and the survey's own work included.
"""
import argparse
import json
import os
import random
import resource
import statistics
import subprocess
import sys
import tempfile

FAMILY = ["--points", "60000", "--mean-track", "6", "--drift", "0.1"]
SCENES = {
    "lakeside, one OPENCV lens": ["--camera", "OPENCV", "--shared", "--points", "60000",
                                  "--mean-track", "6"],
    "lakeside, a RADIAL lens each": ["--camera", "RADIAL", "--points", "60000", "--mean-track", "6"],
    "collection": ["--family", "collection"] + FAMILY,
    "street": ["--family", "street"] + FAMILY,
}


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sheaf", help="the command")
    parser.add_argument("--only", default="", help="scenes whose name has this text")
    parser.add_argument("--images", type=int, default=500)
    parser.add_argument("--pairs", type=int, default=9)
    parser.add_argument("--steps", type=int, default=8)
    parser.add_argument("--solver", default="auto", help="as --solver of the command")
    parser.add_argument("--sigma", type=float, default=0.02, help="of positions, scene units")
    parser.add_argument("--cpu", action="store_true", help="processor seconds in place of the clock's")
    return parser.parse_args()


def run(words):
    """Runs a command and returns the processor's seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(words, capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    # 130: the steps were used up before the solve had converged.
    if done.returncode not in (0, 130):
        sys.exit(f"{' '.join(words)}: {done.stderr}")
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def turned_back(q, t):
    """-R^T t of a unit quaternion w, x, y, z."""
    w, x, y, z = q[0], -q[1], -q[2], -q[3]
    u = [y * t[2] - z * t[1], z * t[0] - x * t[2], x * t[1] - y * t[0]]
    v = [y * u[2] - z * u[1], z * u[0] - x * u[2], x * u[1] - y * u[0]]
    return [-(t[k] + 2 * (w * u[k] + v[k])) for k in range(3)]


def true_centres(a, folder, truth):
    text = os.path.join(folder, "text")
    run([a.sheaf, "convert", truth, text, "--format", "colmap-text", "--quiet"])
    with open(os.path.join(text, "images.txt")) as file:
        lines = [line for line in file if not line.startswith("#")]
    out = []
    for line in lines[::2]:
        words = line.split()
        out.append((words[9], turned_back([float(x) for x in words[1:5]],
                                          [float(x) for x in words[5:8]])))
    return out


def make_scene(a, folder, words):
    lenses = "--camera" in words
    model = os.path.join(folder, "model" if lenses else "model.txt")
    truth = os.path.join(folder, "truth" if lenses else "truth.txt")
    run([a.sheaf, "generate", model, "--truth", truth, "--cameras", str(a.images), "--quiet"] + words)
    draw = random.Random(1)
    positions = [{"image": name if lenses else str(i),
                  "xyz": [x + draw.gauss(0, a.sigma) for x in centre], "sigma": a.sigma}
                 for i, (name, centre) in enumerate(true_centres(a, folder, truth))]
    survey = os.path.join(folder, "survey.json")
    with open(survey, "w") as file:
        json.dump({"positions": positions}, file)
    # Both begin where the survey would have moved the model.
    placed = os.path.join(folder, "placed" if lenses else "placed.txt")
    run([a.sheaf, "align", model, "-o", placed, "--constraints", survey, "--quiet"])
    return placed, survey


def solved(a, folder, model, survey):
    record = os.path.join(folder, "solve.json")
    words = [a.sheaf, "solve", model, "--json", record, "--threads", "1", "--quiet", "--tolerance",
             "0", "--max-iterations", str(a.steps), "--solver", a.solver]
    cpu = run(words + (["--constraints", survey] if survey else []))
    with open(record) as file:
        document = json.load(file)
    steps = document["iterations"]
    times = document["time"]
    return {"s": times["cpu_s"] if a.cpu else times["setup_s"] + times["solve_s"], "all": cpu,
            "steps": len(steps) - 1, "solver": document["solver"]["name"],
            "inner": sum(step["linear_iterations"] for step in steps)}


def row_of(a, folder, name, words):
    model, survey = make_scene(a, folder, words)
    without, with_positions = [], []
    for pair in range(a.pairs):
        for turn in range(2):
            if (pair + turn) % 2:
                with_positions.append(solved(a, folder, model, survey))
            else:
                without.append(solved(a, folder, model, None))
    ratios = [b["s"] / c["s"] for b, c in zip(with_positions, without)]
    low, middle, high = statistics.quantiles(ratios, n=4)
    of = lambda runs, key: statistics.median(run[key] for run in runs)
    both = lambda key: " / ".join(str(runs[0][key]) for runs in (without, with_positions))
    more = of(with_positions, "all") / of(without, "all")
    return [name, without[0]["solver"], both("steps"), both("inner"), f"{of(without, 's'):.3f}",
            f"{of(with_positions, 's'):.3f}", f"{100 * (middle - 1):+.1f} %",
            f"{100 * (low - 1):+.1f} to {100 * (high - 1):+.1f}", f"{100 * (more - 1):+.1f} %"]


def print_row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def main():
    a = parse_arguments()
    print_row(["scene", "solver", "steps without / with", "conjugate gradients", "s without", "s with",
               "positions cost", "quartiles, %", "all"])
    print_row(["---", "---"] + ["--:"] * 7)
    for name, words in SCENES.items():
        if a.only not in name:
            continue
        with tempfile.TemporaryDirectory() as folder:
            print_row(row_of(a, folder, name, words))


if __name__ == "__main__":
    main()
