#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Robust bundle adjustment side by side: time to 1e-3 and 1e-6 of the best robust cost, by loss.

  losses.py --choose --scenes dubrovnik-16=FILE@0.2335 ... --peers FOLDER --out build/losses
  losses.py --scenes ... --peers FOLDER --runs 3 --picture dubrovnik-16:huber --out build/losses

A scene is NAME=FILE@SIGMA; the scale of a loss is its constant for 95 % efficiency times SIGMA.
Huber starts from the file, Cauchy from Huber's end, which `sheaf solve` writes once for everybody:
all are in one valley then. The first command runs every configuration once, to its own end or the
limit, and writes choice.json: f*, and for each solver the configurations that come near to its
quickest one in seconds of the processor, which other programs disturb least. The second measures
those, interleaved, and ends the peers' runs at f* (1 + 1e-6); it writes results.json, table.md and,
of one scene and loss whose runs go on to their own ends, losses.svg. The rest is as in
side_by_side.py. The sheaf command is $SHEAF_COMMAND.
"""
import argparse
import json
import math
import os
import statistics
import subprocess
import sys
import time

import cost_plot
import run_table
import side_by_side

CONSTANTS = {"huber": 1.501141083526, "cauchy": 2.548637623950}
TAUS = (1e-3, 1e-6)
CERES = ("dense_schur-analytic", "dense_schur-analytic-inner", "dense_schur-analytic-nonmonotonic",
         "dense_schur-analytic-inner-nonmonotonic", "dense_schur-analytic-radius=1e6")
G2O = ("eigen", "eigen-lambda=1e-4", "eigen-lambda=1e-2", "eigen-lambda=1", "cholmod-lambda=1e-2")
SOLVERS = ",".join(["sheaf:auto", *(f"ceres:{c}" for c in CERES), *(f"g2o:{c}" for c in G2O)])
PEERS = (("ceres", "Ceres"), ("g2o", "g2o"))
NEAR = 1.3  # how many times a solver's quickest a configuration may take to be measured with it


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", nargs="+", required=True, metavar="NAME=FILE@SIGMA")
    parser.add_argument("--losses", default="huber,cauchy", help="comma-separated")
    parser.add_argument("--solvers", default=SOLVERS, help="comma-separated NAME:CONFIG")
    parser.add_argument("--peers", default=os.environ.get("SHEAF_PEERS", ""), metavar="FOLDERS",
                        help="where the peer programs are, colon-separated [$SHEAF_PEERS]")
    parser.add_argument("--choose", action="store_true", help="every configuration, once")
    parser.add_argument("--picture", metavar="NAME:LOSS", help="what losses.svg shows")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--retries", type=int, default=2, help="of a run that was disturbed")
    parser.add_argument("--max-iterations", type=int, default=2000)
    parser.add_argument("--time-limit", type=float, default=120.0, help="seconds per run")
    parser.add_argument("--machine", help="JSON of bench-machine, to be kept with the results")
    parser.add_argument("--out", default="build/losses")
    return parser.parse_args()


def read_scene(text):
    """(name, file, sigma) of NAME=FILE@SIGMA."""
    name, _, rest = text.partition("=")
    path, _, sigma = rest.rpartition("@")
    return name, path, float(sigma)


def scale(loss, sigma):
    return CONSTANTS[loss] * sigma


def start_of(name, path, loss, sigma, folder):
    """The file that a loss starts from; Huber's end is written unless it is there."""
    if loss == "huber":
        return path
    start = os.path.join(folder, f"{name}-start.txt")
    if not os.path.exists(start):
        command = os.environ.get("SHEAF_COMMAND", "sheaf")
        subprocess.run([command, "solve", path, "--loss", f"huber:{scale('huber', sigma)!r}",
                        "--tolerance", "1e-12", "--max-iterations", "200", "--threads", "1",
                        "--quiet", "-o", start], check=True, stdout=subprocess.DEVNULL)
    return start


def with_loss(solvers, loss, sigma):
    return [(name, f"{config}-{loss}={scale(loss, sigma)!r}", program)
            for name, config, program in solvers]


def without_loss(config):
    """The configuration's words but for its last, the loss."""
    return config.rpartition("-")[0]


def effort(run, cost):
    """Processor's seconds until the cost is at or below `cost`."""
    return run_table.time_to(run["trace"], cost) * run["cpu_percent"] / 100


def near_best(runs, name, optimum):
    """Configurations of solver `name` to be measured: those near its quickest to each target, and
    where none gets to one, the one that got lowest."""
    good = [r for r in runs if r["name"] == name and not r.get("failed") and r["agrees"]]
    if not good:
        return []
    chosen = []
    for tau in TAUS:
        efforts = [(effort(r, optimum * (1 + tau)), r["config"]) for r in good]
        least = min(e for e, _ in efforts)
        if math.isinf(least):
            chosen.append(min(good, key=lambda r: r["final_cost_independent"])["config"])
        else:
            chosen += [config for e, config in efforts if e <= NEAR * least]
    return list(dict.fromkeys(chosen))


def jobs(options):
    """(scene, loss, start, solvers) of each comparison."""
    solvers, _ = side_by_side.find_solvers(options.solvers, options.peers)
    for text in options.scenes:
        name, path, sigma = read_scene(text)
        for loss in options.losses.split(","):
            yield (name, loss, start_of(name, path, loss, sigma, options.out),
                   with_loss(solvers, loss, sigma))


def key(scene, loss):
    return f"{scene}:{loss}"


def choose(options):
    """Every configuration once: {scene:loss: {f*, what is to be measured, what each one did}}."""
    path = os.path.join(options.out, "choice.json")
    choice = read_json(path) if os.path.exists(path) else {}  # what is there is not run again
    options.runs, options.retries, options.cost_target = 1, 0, None
    for scene, loss, start, solvers in jobs(options):
        if key(scene, loss) in choice:
            continue
        document = side_by_side.compare(start, solvers, 1, options)
        best = document["best_cost"]
        names = dict.fromkeys(name for name, _, _ in solvers)
        choice[key(scene, loss)] = {
            "best_cost": best,
            "measured": [[n, c] for n in names for c in near_best(document["runs"], n, best)],
            "tried": [tried(run, best) for run in document["runs"]]}
        write_json(choice, path)
    print(tried_tables(choice), end="")


def tried(run, best):
    """What --choose says of a run; its times are of a machine that may have had other work."""
    row = {"name": run["name"], "config": without_loss(run["config"])}
    if run.get("failed"):
        return {**row, "failed": run["failed"]}
    return {**row, "excess": run["final_cost_independent"] / best - 1, "cut": run["cut"],
            "agrees": run["agrees"], "disagreement": run["disagreement"],
            "iterations": run["iterations"],
            "start_cost": run["trace"][0][1],
            "steps": [steps_to(run["trace"], best * (1 + tau)) for tau in TAUS],
            "cpu_s": [finite(effort(run, best * (1 + tau))) for tau in TAUS]}


def finite(value):
    return value if math.isfinite(value) else None


def tried_tables(choice):
    """What each configuration did in its one run, as Markdown."""
    lines = []
    for name, entry in choice.items():
        lines += [f"### {name}, f* = {entry['best_cost']:.9g}", "",
                  "| solver | configuration | CPU s to 1e-3 | steps | to 1e-6 | steps | all steps "
                  "| end above f* |", "|---|---|--:|--:|--:|--:|--:|--:|"]
        for row in entry["tried"]:
            if "failed" in row:
                lines.append(f"| {row['name']} | {row['config']} | {row['failed']} |")
                continue
            cells = [f(value) for pair in zip(row["cpu_s"], row["steps"])
                     for f, value in zip((run_table.seconds, count), pair)]
            end = f"{row['excess']:.1e}" + (" (cut)" if row["cut"] else "")
            lines.append(f"| {row['name']} | {row['config']} | " + " | ".join(cells) +
                         f" | {row['iterations']} | {end} |")
        lines.append("")
    return "\n".join(lines)


def count(value):
    return "" if value is None else f"{value:g}"


def steps_to(trace, cost):
    """How many steps, those refused included, until the cost is at or below `cost`; None: never."""
    return next((i for i, (_, c) in enumerate(trace) if c <= cost), None)


def measure(options):
    choice = read_json(os.path.join(options.out, "choice.json"))
    path = os.path.join(options.out, "results.json")
    results = {"version": 1, "date": time.strftime("%Y-%m-%d"), "runs": options.runs,
               "time_limit_s": options.time_limit,
               "machine": side_by_side.machine(options.machine), "problems": []}
    for scene, loss, start, solvers in jobs(options):
        chosen = choice[key(scene, loss)]
        options.optimum = chosen["best_cost"]
        drawn = key(scene, loss) == options.picture
        options.cost_target = None if drawn else options.optimum * (1 + 0.99 * min(TAUS))
        contenders = [s for s in solvers if [s[0], s[1]] in chosen["measured"]]
        document = side_by_side.compare(start, contenders, 1, options)
        results["problems"].append({**document, "scene": scene, "loss": loss})
        write_json(results, path)
        if drawn:
            write_text(picture(results["problems"][-1]), os.path.join(options.out, "losses.svg"))
    text = tables(results)
    write_text(text, os.path.join(options.out, "table.md"))
    print(text, end="")


def median_steps(document, row, tau):
    """Of a row's runs, as a number; None where the median one never gets there."""
    target = document["best_cost"] * (1 + tau)
    steps = [steps_to(r["trace"], target) for r in document["runs"]
             if not r.get("failed") and (r["name"], r["config"]) == (row["name"], row["config"])]
    middle = statistics.median(math.inf if s is None else s for s in steps)
    return finite(middle)


def cells_of(document, name, tau):
    """(seconds or None, limit or None, "0.123 (9)", configuration) of a solver's quickest row."""
    rows = [r for r in document["summary"] if r["name"] == name]
    if not rows:
        return None, None, "", ""
    best = run_table.strongest(rows, name, f"{tau:g}")
    if best is None:
        limits = [r["limit_s"] for r in rows if r.get("limit_s")]
        return (None, max(limits), f"> {max(limits):g}", "") if limits else (None, None, "miss", "")
    value = best["time_to"][f"{tau:g}"]
    words = f"{run_table.seconds(value)} ({median_steps(document, best, tau):g})"
    return value, None, words, without_loss(best["config"])


def ratio(ours, theirs, limit):
    if ours and theirs:
        return f"**{theirs / ours:.3g}**"
    return f"> {limit / ours:.3g}" if ours and limit else ""


def table(documents, loss):
    """One loss: seconds (steps) of each solver's quickest configuration, and ratios to sheaf's."""
    head = ["scene", "to", "Sheaf, s (steps)"]
    for _, text in PEERS:
        head += [f"{text}, s (steps)", "ratio", "configuration"]
    lines = ["| " + " | ".join(head) + " |", "|---|--:|--:" + "|--:|--:|---" * len(PEERS) + "|"]
    for document in (d for d in documents if d["loss"] == loss):
        for tau in TAUS:
            ours, _, words, _ = cells_of(document, "sheaf", tau)
            cells = [document["scene"], f"{tau:g}", words]
            for name, _ in PEERS:
                theirs, limit, words, config = cells_of(document, name, tau)
                cells += [words, ratio(ours, theirs, limit), config]
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def tables(results):
    losses = dict.fromkeys(d["loss"] for d in results["problems"])
    return "\n".join(f"### {loss.capitalize()}\n\n{table(results['problems'], loss)}"
                     for loss in losses)


def picture(document):
    """Cost over time of each solver's quickest configuration."""
    curves = [(label if label == "sheaf" else without_loss(label), trace)
              for label, trace in side_by_side.curves(document, f"{min(TAUS):g}")]
    title = f"{document['scene']}, {document['loss'].capitalize()}'s loss, one thread"
    return cost_plot.draw(title, curves, document["best_cost"])


def read_json(path):
    with open(path) as file:
        return json.load(file)


def write_json(value, path):
    write_text(json.dumps(value, indent=1), path)


def write_text(text, path):
    with open(path, "w") as file:
        file.write(text)


def main():
    options = parse_arguments()
    options.memory_gb, options.deadline, options.optimum = 0.0, math.inf, math.inf
    os.makedirs(options.out, exist_ok=True)
    (choose if options.choose else measure)(options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
