#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""A window of ten keyframes, again and again, beside g2o and Ceres: window.py BENCH_WINDOW [--peers FOLDER]

10 images, 1500 points, 6000 observations, intrinsics held, Huber's loss at one pixel, six steps. The
program of this bench solves it in turns as fresh solves and by a Solver that stays, from changed
arrays to the end. Peers run it in processes of their own, one thread; what they need is told apart:
*all* from arrays in memory to the end of the sixth step, as systems pay it that build their graph for
each window, and *steps* alone, as if the graph stayed. All take turns; figures are medians of the
runs, --cpu: of the processor's seconds, for machines that have other work. *to 1e-4*, ...: steps to
within that of the best cost that any of them has after --more steps.
"""
import argparse
import json
import os
import statistics
import subprocess
import tempfile

PEERS = [("g2o", "eigen-huber=1"), ("ceres", "dense_schur-analytic-huber=1")]


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="bench-window")
    parser.add_argument("--peers", help="where peer-g2o and peer-ceres are")
    parser.add_argument("--runs", type=int, default=9)
    parser.add_argument("--pairs", type=int, default=51, help="solves of each way in a run")
    parser.add_argument("--more", type=int, default=25, help="steps that find the best cost")
    parser.add_argument("--cpu", action="store_true", help="processor seconds")
    return parser.parse_args()


def of_sheaf(a, steps=6, pairs=None):
    """Medians by (way, threads), and costs after each step."""
    found = json.loads(subprocess.run(
        [a.program, "--steps", str(steps), "--pairs", str(pairs or a.pairs)],
        stdout=subprocess.PIPE, check=True).stdout)
    return {(way["way"], way["threads"]): way for way in found["ways"]}


def of_peer(a, name, config, window, steps=6):
    """Milliseconds of all and of the steps, and costs after each step."""
    found = json.loads(subprocess.run(
        [os.path.join(a.peers, "peer-" + name), window, "--config", config, "--fix", "intrinsics",
         "--threads", "1", "--max-iterations", str(steps), "--tolerance", "0"],
        stdout=subprocess.PIPE, check=True).stdout)
    busy = found["cpu_percent"] / 100 if a.cpu else 1
    return {"all": 1e3 * found["total_s"] * busy,
            "steps": 1e3 * (found["total_s"] - found["setup_s"]) * busy,
            "costs": [cost for _, cost in found["trace"]]}


def steps_to(costs, target):
    return next((str(k) for k, cost in enumerate(costs) if cost <= target), f"> {len(costs) - 1}")


def main():
    a = parse_arguments()
    key = "cpu_ms" if a.cpu else "ms"
    with tempfile.TemporaryDirectory() as folder:
        window = os.path.join(folder, "window.txt")
        subprocess.run([a.program, "--write", window], check=True)
        ours, theirs = [], {name: [] for name, _ in PEERS}
        for _ in range(a.runs):
            ours.append(of_sheaf(a))
            for name, config in PEERS if a.peers else []:
                theirs[name].append(of_peer(a, name, config, window))
        costs = {"sheaf": of_sheaf(a, a.more, 1)[("kept", 1)]["costs"]}
        for name, config in PEERS if a.peers else []:
            costs[name] = of_peer(a, name, config, window, a.more)["costs"]

    ms = {way: statistics.median(run[way][key] for run in ours) for way in ours[0]}
    kept = ms[("kept", 1)]
    print("Processor milliseconds" if a.cpu else "Milliseconds", f"of six steps, {a.runs} runs\n")
    print("| | threads | ms | beside kept, one thread |\n|---|--:|--:|--:|")
    for (way, threads), value in ms.items():
        print(f"| sheaf, {way} | {threads} | {value:.2f} | {value / kept:.2f} |")
    for name, runs in theirs.items():
        for part in ("all", "steps") if runs else ():
            value = statistics.median(run[part] for run in runs)
            print(f"| {name}, {part} | 1 | {value:.2f} | {value / kept:.2f} |")
    best = min(min(of) for of in costs.values())
    print("\n| steps to the best cost within | 1e-3 | 1e-4 | 1e-5 | 1e-6 |\n|---|--:|--:|--:|--:|")
    for name, of in costs.items():
        print(f"| {name} |", " | ".join(steps_to(of, best * (1 + 10.0 ** -d)) for d in (3, 4, 5, 6)),
              "|")


if __name__ == "__main__":
    main()
