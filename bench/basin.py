#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""From how bad a start does a solver still come home? Small scenes under disturbances of each kind.

  basin.py make build/basin --seed 7
  basin.py run build/basin --solvers sheaf,sheaf:recoveries=0,ceres:dense_schur-analytic

`make` writes 14 scenes under each of 15 disturbances (and with --mixed under five that disturb
everything at once), and best.csv with the cost from the undisturbed start, its column
`from_the_truth`. `run` solves each file with each solver that `sheaf compare` knows, and counts
those that end within 1 % of that cost, by disturbance; its list of failures goes to --failures. A
run whose final cost independent code does not confirm counts as a failure. The sheaf command is
$SHEAF_COMMAND.
"""
import argparse
import collections
import concurrent.futures
import csv
import json
import math
import os
import random
import subprocess
import sys
import tempfile

SCENES = 14
WITHIN = 1.01
COMMAND = os.environ.get("SHEAF_COMMAND", "sheaf")

# NAME -> what is done to a scene, in the order of the tables.
ALONE = collections.OrderedDict([
    *((f"rot_{s}", {"rotation": s}) for s in (0.05, 0.2, 0.5)),
    *((f"points_{s}", {"points": s}) for s in (0.5, 2)),
    *((f"focal_{s}", {"focal": s}) for s in (0.3, 1)),
    *((f"k1_{s}", {"k1": s}) for s in (1, 10)),
    *((f"k1one_{s}", {"k1_of_one": s}) for s in (100, 100000)),
    *((f"flat_{s}", {"depth": s}) for s in (2, 8, 40)),
    ("all0_0", {"together": True})])
MIXED = collections.OrderedDict([
    ("mixed_mild", {"rotation": 0.05, "centre": 0.2, "points": 0.3, "focal": 0.1}),
    ("mixed_turned", {"rotation": 0.3, "centre": 0.2, "points": 0.3}),
    ("mixed_apart", {"rotation": 0.1, "centre": 1, "points": 1}),
    ("mixed_zoomed", {"rotation": 0.1, "points": 0.5, "focal": 0.5, "k1": 0.3}),
    ("mixed_wild", {"rotation": 0.3, "centre": 1, "points": 1, "focal": 0.3})])


class Scene:
    """A BAL file as lists: its counts, its observations as text, cameras of nine, points of three."""

    def __init__(self, text):
        words = text.split()
        self.counts = [int(word) for word in words[:3]]
        images, points, observations = self.counts
        at = 3 + 4 * observations
        self.observations = [words[k:k + 4] for k in range(3, at, 4)]
        numbers = [float(word) for word in words[at:]]
        self.cameras = [numbers[9 * i:9 * i + 9] for i in range(images)]
        self.points = [numbers[9 * images + 3 * j:][:3] for j in range(points)]

    def text(self):
        lines = [" ".join(map(str, self.counts)), *(" ".join(o) for o in self.observations)]
        lines += [repr(x) for block in (*self.cameras, *self.points) for x in block]
        return "\n".join(lines) + "\n"


def matrix(w):
    """Row-major rotation of an angle-axis."""
    a = math.sqrt(sum(x * x for x in w))
    x, y, z = (c / a for c in w) if a else (0, 0, 0)
    c, s, v = math.cos(a), math.sin(a), 1 - math.cos(a)
    return [[c + x * x * v, x * y * v - z * s, x * z * v + y * s],
            [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
            [z * x * v - y * s, z * y * v + x * s, c + z * z * v]]


def quaternion(w):
    a = math.sqrt(sum(x * x for x in w))
    k = math.sin(a / 2) / a if a else 0.5
    return [math.cos(a / 2), *(k * x for x in w)]


def angle_axis(q):
    length = math.sqrt(sum(x * x for x in q[1:]))
    k = 2 * math.atan2(length, q[0]) / length if length else 2
    return [k * x for x in q[1:]]


def product(a, b):
    return [a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]]


def times(m, v):
    return [sum(a * b for a, b in zip(row, v)) for row in m]


def back(m, v):
    return [sum(m[k][i] * v[k] for k in range(3)) for i in range(3)]


def move_camera(camera, rng, rotation, centre):
    """Turns a camera about its centre and moves that."""
    place = [-x + centre * rng.gauss(0, 1) for x in back(matrix(camera[:3]), camera[3:6])]
    turn = [rotation * rng.gauss(0, 1) for _ in range(3)]
    camera[:3] = angle_axis(product(quaternion(turn), quaternion(camera[:3])))
    camera[3:6] = [-x for x in times(matrix(camera[:3]), place)]


def put_at_depth(scene, depth):
    """Each point on the ray of its first observation, by a lens without distortion."""
    seen = {}
    for image, point, x, y in scene.observations:
        seen.setdefault(int(point), (int(image), float(x), float(y)))
    for point, (image, x, y) in seen.items():
        camera = scene.cameras[image]
        local = [x / camera[6] * depth, y / camera[6] * depth, -depth]
        scene.points[point] = back(matrix(camera[:3]),
                                   [a - t for a, t in zip(local, camera[3:6])])


def disturb(scene, rng, rotation=0, centre=0, points=0, focal=0, k1=0, k1_of_one=0, depth=0,
            together=False):
    if rotation or centre:
        for camera in scene.cameras:
            move_camera(camera, rng, rotation, centre)
    for camera in scene.cameras:
        camera[6] *= math.exp(focal * rng.gauss(0, 1))
        camera[7] += k1 * rng.gauss(0, 1)
    if k1_of_one:
        rng.choice(scene.cameras)[7] += k1_of_one
    if depth:
        put_at_depth(scene, depth)
    scene.points = [[x + points * rng.gauss(0, 1) for x in X] for X in scene.points]
    if together:
        mean = [sum(X[k] for X in scene.points) / len(scene.points) for k in range(3)]
        scene.points = [list(mean) for _ in scene.points]


def run_quietly(*command):
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def undisturbed(path, rng, seed):
    """A scene at its true state with measured pixels, and the cost that it ends at."""
    run_quietly(COMMAND, "generate", path, "--cameras", str(rng.randint(5, 9)), "--points",
                str(rng.randint(60, 120)), "--mean-track", "4", "--rotation-noise", "0",
                "--center-noise", "0", "--point-noise", "0", "--focal-noise", "0", "--seed",
                str(seed), "--quiet")
    run_quietly(COMMAND, "solve", path, "--max-iterations", "100", "--tolerance", "1e-12",
                "--threads", "1", "--quiet", "--json", path + ".json")
    with open(path + ".json", encoding="utf-8") as file:
        cost = json.load(file)["final_cost"]
    os.remove(path + ".json")
    with open(path, encoding="utf-8") as file:
        return Scene(file.read()), cost


def make(arguments):
    os.makedirs(arguments.folder, exist_ok=True)
    rows = []
    for k in range(SCENES):
        rng = random.Random(f"{arguments.seed}/{k}")
        path = os.path.join(arguments.folder, "scene.tmp")
        scene, cost = undisturbed(path, rng, 1000 * arguments.seed + k)
        text = scene.text()
        for name, what in {**ALONE, **(MIXED if arguments.mixed else {})}.items():
            copy = Scene(text)
            disturb(copy, random.Random(f"{arguments.seed}/{k}/{name}"), **what)
            with open(os.path.join(arguments.folder, f"{name}_{k}.txt"), "w",
                      encoding="utf-8") as file:
                file.write(copy.text())
            rows.append((f"{name}_{k}.txt", repr(cost)))
        os.remove(path)
    with open(os.path.join(arguments.folder, "best.csv"), "w", encoding="utf-8") as file:
        file.write("file,from_the_truth\n" + "".join(f"{a},{b}\n" for a, b in rows))
    print(f"{len(rows)} files in {arguments.folder}")


def solve_all(path, arguments):
    """For each run of `sheaf compare` on a file: (solver, final cost or infinite)."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "compare.json")
        command = [COMMAND, "compare", path, "--solvers", arguments.solvers, "--max-iterations",
                   str(arguments.max_iterations), "--tolerance", "1e-12", "--time-limit",
                   str(arguments.time_limit), "--threads", "1", "--quiet", "--json", out]
        if arguments.peers:
            command += ["--peers", arguments.peers]
        subprocess.run(command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        with open(out, encoding="utf-8") as file:
            runs = json.load(file)["runs"]
    return [(f"{r['solver']}:{r['config']}" if r["config"] else r["solver"],
             r["final_cost_independent"] if r.get("agrees") and not r["failed"] else math.inf)
            for r in runs]


def run(arguments):
    with open(os.path.join(arguments.folder, "best.csv"), encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    paths = [os.path.join(arguments.folder, row["file"]) for row in rows]
    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        results = list(pool.map(lambda path: solve_all(path, arguments), paths))
    solvers = [name for name, _ in results[0]]
    home = collections.OrderedDict()
    failures = []
    for row, result in zip(rows, results):
        kind = row["file"].rsplit("_", 1)[0]
        for (solver, cost) in result:
            counts = home.setdefault(kind, collections.Counter())
            if cost is not None and cost <= WITHIN * float(row["from_the_truth"]):
                counts[solver] += 1
            else:
                failures.append((row["file"], solver, cost, row["from_the_truth"]))
    print("| of " + str(SCENES) + " | " + " | ".join(solvers) + " |")
    print("|---|" + "--:|" * len(solvers))
    for kind, counts in home.items():
        print(f"| {kind} | " + " | ".join(str(counts[s]) for s in solvers) + " |")
    print(f"| all {len(rows)} | " +
          " | ".join(str(sum(c[s] for c in home.values())) for s in solvers) + " |")
    if arguments.failures:
        with open(arguments.failures, "w", encoding="utf-8") as file:
            csv.writer(file).writerows([("file", "solver", "cost", "from_the_truth"), *failures])


def parse_arguments(words):
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(required=True)
    maker = verbs.add_parser("make")
    maker.add_argument("folder")
    maker.add_argument("--seed", type=int, default=1)
    maker.add_argument("--mixed", action="store_true", help="also disturb everything at once")
    maker.set_defaults(verb=make)
    runner = verbs.add_parser("run")
    runner.add_argument("folder")
    runner.add_argument("--solvers", default="sheaf", help="as for `sheaf compare`")
    runner.add_argument("--peers", default=os.environ.get("SHEAF_PEERS", ""))
    runner.add_argument("--max-iterations", type=int, default=100)
    runner.add_argument("--time-limit", type=float, default=20)
    runner.add_argument("--jobs", type=int, default=2)
    runner.add_argument("--failures", metavar="CSV")
    runner.set_defaults(verb=run)
    return parser.parse_args(words)


def main():
    arguments = parse_arguments(sys.argv[1:])
    arguments.verb(arguments)


if __name__ == "__main__":
    main()
