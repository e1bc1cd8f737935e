#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""The sheaf command on a file, in the peers' terms.

The words of --config, joined by '-': auto | dense | sparse | explicit | implicit (camera solver; the
last two iterative), fix=k2, simd=avx2, damping=0.001, and a loss with its scale in pixels: huber=1.5 |
soft_l1=1.5 | cauchy=1.5 | tukey=1.5.
The command is $SHEAF_COMMAND, or `sheaf` on the PATH. CPU use is the whole process's, reading and
writing included; times are those of set-up and solving, as for the peers.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile
import time


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("input")
    parser.add_argument("--config", default="auto")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--max-iterations", type=int, default=50)
    parser.add_argument("--time-limit", type=float, default=0)
    parser.add_argument("--fix", default="")
    parser.add_argument("--tolerance", type=float, default=1e-12, help="the peers' stopping rule")
    parser.add_argument("--cost-target", type=float, help="not used: the run ends by itself")
    parser.add_argument("--out")
    return parser.parse_args()


def command_line(a, json_path):
    line = [os.environ.get("SHEAF_COMMAND", "sheaf"), "solve", a.input, "--json", json_path,
            "--quiet", "--threads", str(a.threads), "--max-iterations", str(a.max_iterations),
            "--tolerance", str(a.tolerance)]
    if a.fix:
        line += ["--fix", a.fix]
    if a.time_limit > 0:
        line += ["--time-limit", str(a.time_limit)]
    if a.out:
        line += ["-o", a.out]
    for word in a.config.split("-"):
        name, _, value = word.partition("=")
        if name in ("auto", "dense", "sparse", "iterative"):
            line += ["--solver", name]
        elif name in ("explicit", "implicit"):
            line += ["--solver", "iterative-" + name]
        elif name == "fix":
            line += ["--fix", value]
        elif name == "simd":
            line += ["--simd", value]
        elif name == "damping":
            line += ["--initial-damping", value]
        elif name in ("huber", "soft_l1", "cauchy", "tukey"):
            line += ["--loss", name.replace("_", "-") + ":" + value]
        else:
            sys.exit(f"unknown configuration '{a.config}'")
    return line


def run_document(document, config, threads, cpu_percent):
    """The peers' JSON from that of `sheaf solve`. The trace has every step that was tried; after one
    that was refused, the cost is that of the state held before."""
    setup = document["time"]["setup_s"]
    steps = document["iterations"]
    trace = [[setup + s["time_s"], s["cost"]] for s in steps]
    tried = len(steps) - 1
    last = steps[-1]["time_s"] - steps[0]["time_s"]
    return {"solver": "sheaf", "config": config, "threads": threads, "setup_s": setup,
            "trace": trace, "seconds_per_iteration": last / tried if tried else 0,
            "total_s": setup + document["time"]["solve_s"], "cpu_percent": cpu_percent,
            "peak_bytes": document["memory"]["peak_bytes"], "iterations": tried,
            "final_cost": document["final_cost"], "sheaf": own_words(document)}


def own_words(document):
    """What only sheaf says: its choice, its forecast, why it stopped, and its inner steps."""
    steps = document["iterations"]
    return {"solver": document["solver"], "precision": document["precision"],
            "forecast_bytes": document["memory"]["forecast_bytes"],
            "termination": document["termination"],
            "gradient": [steps[0]["gradient_max"], steps[-1]["gradient_max"]],
            "linear_iterations": [s["linear_iterations"] for s in steps[1:]]}


def main():
    a = parse_arguments()
    with tempfile.TemporaryDirectory() as folder:
        json_path = os.path.join(folder, "run.json")
        start = time.perf_counter()
        child = subprocess.Popen(command_line(a, json_path), stdout=subprocess.DEVNULL)
        _, status, usage = os.wait4(child.pid, 0)
        wall = time.perf_counter() - start
        code = os.waitstatus_to_exitcode(status)
        if code not in (0, 7):  # 7: the time limit, with the best state written
            sys.exit(code if code > 0 else 1)
        with open(json_path) as file:
            document = json.load(file)
    cpu = 100 * (usage.ru_utime + usage.ru_stime) / wall
    json.dump(run_document(document, a.config, a.threads, cpu), sys.stdout)
    print()


if __name__ == "__main__":
    main()
