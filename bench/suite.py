#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""The whole ladder, from 16 to 1778 cameras, with every solver that is here.

  suite.py --ladder FOLDER --peers FOLDER --out build/suite        # what is missing is generated
  suite.py --problems ladybug-49,ladybug-138 --solvers sheaf:auto,rootba:schur-double --runs 1
  suite.py --render --out build/suite --pages .                    # only the pages, from results.json

Real problems are read from $SHEAF_DATA/bal, the others are synthetic ones of the same size and kind,
made by `sheaf generate --like`. A peer whose camera has no k2 runs beside `sheaf --fix k2` on a copy
with k2 = 0 ("-k2zero"): another problem, with its own best cost. Results are written after each
problem; --resume goes on where they end.
"""
import argparse
import copy
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
import time

import run_table
import side_by_side
import suite_report

# Name, and the real file where there is one.
LADDER = {"dubrovnik-16": "dubrovnik-16-22106-pre.txt", "trafalgar-21": "trafalgar-21-11315-pre.txt",
          "ladybug-49": "ladybug-49-7776-pre.txt", "ladybug-138": None, "trafalgar-257": None,
          "dubrovnik-356": None, "ladybug-1723": None, "venice-1778": None}
# Beyond the peers' reach in any bounded time: for the growth of our own step, when asked for.
OURS_ALONE = {"final-4585": None, "final-13682": None}

OURS = ("sheaf:auto", "sheaf:dense", "sheaf:sparse", "sheaf:explicit", "sheaf:implicit")
PEERS = ("ceres-head:dense_schur-analytic", "ceres-head:sparse_schur-analytic",
         "ceres-head:iterative_explicit-analytic", "ceres-head:iterative_implicit-analytic",
         "g2o:eigen-lambda=1e-2", "g2o:cholmod-lambda=1e-2", "g2o:cholmod", "rootba:schur-double",
         "rootba:schur-float", "rootba:sqrt-double", "rootba:sqrt-float", "rootba:power-double",
         "gtsam:cholesky-metis-ceres")
WITHOUT_K2 = ("sheaf:auto-fix=k2", "pba:float", "pba:float-schur", "pba:double",
              "ceres-head:sparse_schur-analytic-nok2")  # the last as a referee of the model
# More cameras than this and the solver is not tried: dense matrices, and what needs minutes a step.
MOST_CAMERAS = {"ceres-head:dense_schur-analytic": 400, "gtsam:cholesky-metis-ceres": 150}


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", default=",".join(LADDER), help="comma-separated; also " +
                        ", ".join(OURS_ALONE))
    parser.add_argument("--solvers", help="comma-separated NAME:CONFIG instead of all")
    parser.add_argument("--without-k2", default=",".join(WITHOUT_K2),
                        help="NAME:CONFIG for the k2 = 0 copies; empty: no copies")
    parser.add_argument("--peers", default="", metavar="FOLDERS", help="colon-separated")
    parser.add_argument("--ladder", default="build/ladder", help="where generated scenes are kept")
    parser.add_argument("--threads", default="1,all", help="comma-separated counts")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--retries", type=int, default=1, help="of a run that was disturbed")
    parser.add_argument("--max-iterations", type=int, default=50)
    parser.add_argument("--time-limit", type=float, help="seconds a run, instead of the size's own")
    parser.add_argument("--budget-minutes", type=float, default=math.inf,
                        help="after this nothing new is started")
    parser.add_argument("--memory-gb", type=float, default=0.8e-9 * physical_memory(),
                        help="of address space for each run")
    parser.add_argument("--machine", help="JSON of bench-machine, to be kept with the results")
    parser.add_argument("--out", default="build/suite")
    parser.add_argument("--resume", action="store_true", help="keep the problems of results.json")
    parser.add_argument("--render", action="store_true", help="run nothing, write the pages again")
    parser.add_argument("--pages", metavar="ROOT", help="repository whose BENCHMARKS.md to update")
    return parser.parse_args()


def physical_memory():
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def time_limit(observations):
    """Seconds a run may take, about a hundred of our own."""
    return round(max(20, min(240, 6e-5 * observations)))


def scene(name, folder):
    """The file of a problem; a synthetic one is made when nobody has made it yet."""
    real = LADDER.get(name)
    if real:
        return os.path.join(os.environ.get("SHEAF_DATA", "data"), "bal", real)
    path = os.path.join(folder, name + ".txt")
    if not os.path.exists(path):
        def generate(beside):
            subprocess.run([os.environ.get("SHEAF_COMMAND", "sheaf"), "generate", beside, "--like",
                            name, "--quiet"], check=True, stdout=subprocess.DEVNULL)
        write_beside(path, generate)
    return path


def write_beside(path, write):
    """`write` makes another file first, so that nobody ever sees half of this one."""
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    with tempfile.TemporaryDirectory(dir=os.path.dirname(path) or ".") as folder:
        beside = os.path.join(folder, os.path.basename(path))
        write(beside)
        os.replace(beside, path)


def without_k2(name, source, folder):
    """A copy of the file with k2 = 0 in every camera."""
    path = os.path.join(folder, name + "-k2zero.txt")

    def write(beside):
        with open(source) as file, open(beside, "w") as out:
            counts = file.readline()
            out.write(counts)
            cameras, _, observations = (int(n) for n in counts.split())
            for _ in range(observations):
                out.write(file.readline())
            values = file.read().split()
            values[8:9 * cameras:9] = ["0"] * cameras
            out.write("\n".join(values) + "\n")

    if not os.path.exists(path):
        write_beside(path, write)
    return path


def solvers_for(text, cameras, options):
    fitting = [s for s in text.split(",") if cameras <= MOST_CAMERAS.get(s, math.inf)]
    return side_by_side.find_solvers(",".join(fitting), options.peers)


def measure(name, path, text, threads, options):
    """One document of the results: a problem at one count of threads."""
    header = side_by_side.header(path)
    solvers, missing = solvers_for(text, header["cameras"], options)
    mine = copy.copy(options)
    mine.time_limit = options.time_limit or time_limit(header["observations"])
    document = side_by_side.compare(path, solvers, threads, mine)
    document.update(problem=name, missing=missing, synthetic=LADDER.get(name.removesuffix("-k2zero"))
                    is None, time_limit_s=mine.time_limit, turns=options.runs)
    return document


def tasks(options):
    """(name, file, solvers) of each problem, a k2 = 0 copy after its original."""
    for name in options.problems.split(","):
        if name not in LADDER and name not in OURS_ALONE:
            sys.exit(f"no problem '{name}' on the ladder: {', '.join((*LADDER, *OURS_ALONE))}")
        path = scene(name, options.ladder)
        if not os.path.exists(path):
            print(f"{path} is not here: {name} left out", file=sys.stderr)
            continue
        alone = name in OURS_ALONE
        yield name, path, options.solvers or ("sheaf:auto" if alone else ",".join(OURS + PEERS))
        if options.without_k2 and not alone:
            present = side_by_side.find_solvers(options.without_k2, options.peers)[0]
            if any(solver != "sheaf" for solver, _, _ in present):
                yield (name + "-k2zero", without_k2(name, path, options.ladder),
                       options.without_k2)


def run(options, results, path):
    counts = [os.cpu_count() if n == "all" else int(n) for n in options.threads.split(",")]
    done = {(d["problem"], d["threads"]) for d in results["problems"]}
    for name, file, text in tasks(options):
        for threads in dict.fromkeys(counts):
            if (name, threads) in done or time.time() > options.deadline:
                continue
            results["problems"].append(measure(name, file, text, threads, options))
            results["problems"].sort(key=place)
            share_best_cost([d for d in results["problems"] if d["problem"] == name])
            write_beside(path, lambda beside: dump(results, beside))


def share_best_cost(documents):
    """f* is the best anyone found with any count of threads."""
    best = min((d["best_cost"] for d in documents if math.isfinite(d["best_cost"])),
               default=math.nan)
    for document in documents:
        document["best_cost"] = best
        document["summary"] = run_table.summarise(document["runs"], best)


def place(document):
    """On the ladder: by size, the k2 = 0 copy after its original, then by threads."""
    name = document["problem"].removesuffix("-k2zero")
    return ([*LADDER, *OURS_ALONE].index(name), document["problem"], document["threads"])


def dump(results, path):
    with open(path, "w") as file:
        json.dump(results, file, indent=1)


def write_pages(results, options):
    """suite.md and its plots beside the results and, when asked, in the repository."""
    plots = suite_report.plots(results)
    for name, svg in plots.items():
        with open(os.path.join(options.out, name), "w") as file:
            file.write(svg)
    with open(os.path.join(options.out, "suite.md"), "w") as file:
        file.write(suite_report.markdown(results, "."))
    if options.pages:
        folder = os.path.join(options.pages, "docs", "bench")
        os.makedirs(folder, exist_ok=True)
        for name in plots:
            shutil.copy(os.path.join(options.out, name), folder)
        suite_report.put(os.path.join(options.pages, "BENCHMARKS.md"),
                         suite_report.markdown(results, "docs/bench"))


def main():
    options = parse_arguments()
    options.optimum, options.cost_target = math.inf, None
    options.deadline = time.time() + 60 * options.budget_minutes
    path = os.path.join(options.out, "results.json")
    results = {"version": 1, "date": time.strftime("%Y-%m-%d"),
               "machine": side_by_side.machine(options.machine), "problems": []}
    if (options.resume or options.render) and os.path.exists(path):
        with open(path) as file:
            results = json.load(file)
    if not options.render:
        run(options, results, path)
    if not results["problems"]:
        sys.exit("nothing was run")
    write_pages(results, options)
    print(os.path.join(options.out, "suite.md"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
