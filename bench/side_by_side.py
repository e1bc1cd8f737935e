#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Runs solvers side by side on BAL files and writes results.json, table.md and one SVG per problem.

  side_by_side.py --problems FILE... --solvers sheaf:auto,ceres-2.1:dense_schur-auto
                  --peers FOLDER --threads 1,2 --runs 5 --out build/bench

A solver is NAME:CONFIG; NAME is the program `peer-NAME` (or peer_NAME.py) in one of the --peers
folders or in bench/peers. Each is a program of its own that reads the file by itself, starts its
clock after reading, and writes the state it ends with, whose cost is evaluated here again.
Runs are interleaved, each turn in another order, in fresh processes. f* is the best cost found by anyone.
"""
import argparse
import json
import math
import os
import platform
import random
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time

import cost_plot
import evaluate
import run_table

HERE = os.path.dirname(os.path.abspath(__file__))
# A solver's own final cost may differ from the independent one by its summation order only, or, when
# it says that it counts in float, by float's rounding (its trace is then read as far as that goes).
AGREEMENT = {"double": 1e-9, "float": 1e-2}
# One thread that got less of a core than this was disturbed by other programs: run again.
UNDISTURBED_PERCENT = 90


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problems", nargs="+", default=[], metavar="FILE")
    parser.add_argument("--solvers", default="sheaf:auto", help="comma-separated NAME:CONFIG")
    parser.add_argument("--peers", default=os.environ.get("SHEAF_PEERS", ""), metavar="FOLDERS",
                        help="where the peer programs are, colon-separated [$SHEAF_PEERS]")
    parser.add_argument("--threads", default="1", help="comma-separated counts")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--retries", type=int, default=2, help="of a run that was disturbed")
    parser.add_argument("--max-iterations", type=int, default=50)
    parser.add_argument("--time-limit", type=float, default=60.0, help="seconds per run")
    parser.add_argument("--memory-gb", type=float, default=0.0,
                        help="of address space for each run; 0: no limit")
    parser.add_argument("--budget-minutes", type=float, default=math.inf,
                        help="after this nothing new is started")
    parser.add_argument("--optimum", type=float, default=math.inf,
                        help="a known cost of the (one) problem, when it is below what is found")
    parser.add_argument("--cost-target", type=float, help="ends a peer's run that is at or below it")
    parser.add_argument("--machine", help="JSON of bench-machine, to be kept with the results")
    parser.add_argument("--out", default="build/bench")
    parser.add_argument("--self-test", action="store_true")
    return parser.parse_args()


def find_program(name, folders):
    for folder in [*filter(None, folders.split(":")), os.path.join(HERE, "peers")]:
        for candidate in (f"peer-{name}", f"peer_{name}.py"):
            path = os.path.join(folder, candidate)
            if os.path.isfile(path) and os.access(path, os.X_OK):
                return path
    return None


def run_once(program, name, config, problem, threads, options, folder):
    """One run in a fresh process: the peer's JSON, with the independent final cost."""
    final = os.path.join(folder, "final.txt")
    line = [os.path.abspath(program), os.path.abspath(problem), "--config", config, "--threads",
            str(threads), "--max-iterations", str(options.max_iterations),
            "--time-limit", str(options.time_limit), "--out", final]
    if options.cost_target is not None:
        line += ["--cost-target", repr(options.cost_target)]
    if os.path.exists(final):
        os.remove(final)
    # Libraries inside a peer (BLAS, OpenMP) get the same count as the peer.
    environment = {**os.environ,
                   **{k: str(threads) for k in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")}}
    if os.sep in environment.get("SHEAF_COMMAND", ""):
        environment["SHEAF_COMMAND"] = os.path.abspath(environment["SHEAF_COMMAND"])
    limit = options.time_limit
    warm_up(line, environment, limit, options.memory_gb, folder)
    run = {"name": name, "config": config, "threads": threads, "limit_s": limit}
    done = run_program(line, environment, 60 + 2 * limit, options.memory_gb, folder)
    if done is None:
        return {**run, "failed": "did not end in time", "cut": True}
    if done.returncode != 0:
        words = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
        return {**run, "failed": words[0]}
    try:
        run.update(json.loads(done.stdout))
    except ValueError:  # a cost that is not a number, for one
        return {**run, "failed": f"wrote no JSON: {done.stdout.strip()[-60:]}"}
    run["cut"] = run["total_s"] >= limit
    run["final_cost_independent"] = evaluate.cost(
        problem, final, find_program("evaluate", options.peers), evaluate.loss_of(config))
    own, other = run["final_cost"], run["final_cost_independent"]
    run["disagreement"] = abs(own - other) / max(own, other, sys.float_info.min)
    run["agrees"] = run["disagreement"] <= AGREEMENT[run.get("cost_in", "double")]
    return run


def warm_up(line, environment, limit, memory_gb, folder):
    """One iteration by the same program, not measured, so that each run finds memory and caches as a
    run of itself leaves them. A virtual machine gives pages back to its host as a large process ends;
    a run that follows one waits for them, 0.1 to 0.3 s where a solve takes 0.35 to 0.6."""
    short = list(line)
    short[short.index("--max-iterations") + 1] = "1"
    run_program(short, environment, 60 + 2 * limit, memory_gb, folder)


def run_program(line, environment, timeout, memory_gb, folder):
    """The finished process, or None when it had to be ended. Memory is limited so that a greedy peer
    fails by itself and not the machine with it. It runs in `folder`, where what it leaves (rootba
    writes a debug.txt) is swept up."""
    def limit_memory():
        if memory_gb:
            resource.setrlimit(resource.RLIMIT_AS, (int(memory_gb * 1e9),) * 2)

    child = subprocess.Popen(line, env=environment, stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True, start_new_session=True,
                             preexec_fn=limit_memory, cwd=folder)
    try:
        out, err = child.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        os.killpg(child.pid, signal.SIGKILL)  # with what a wrapper has started
        child.communicate()
        return None
    except BaseException:
        os.killpg(child.pid, signal.SIGKILL)
        raise
    return subprocess.CompletedProcess(line, child.returncode, out, err)


def run_undisturbed(*arguments, retries):
    """Runs again while a one-thread run got too little of its core; the least disturbed counts."""
    best = run_once(*arguments)
    for _ in range(retries):
        if best.get("failed") or best["threads"] > 1 or best["cpu_percent"] > UNDISTURBED_PERCENT:
            break
        again = run_once(*arguments)
        if not again.get("failed") and again["cpu_percent"] > best["cpu_percent"]:
            best = again
    return best


def in_turn(solvers, turn):
    """The first turn in the order given, the others shuffled: what a run finds of memory and caches
    is what the one before left, and that must not be the same solver's every time. Configurations of
    one solver follow each other: a large process before a small one then meets one of them a turn."""
    order = list(solvers)
    if turn > 0:
        shuffle = random.Random(turn).shuffle
        shuffle(order)
        names = list(dict.fromkeys(name for name, *_ in order))
        shuffle(names)
        order.sort(key=lambda solver: names.index(solver[0]))
    return order


def compare(problem, solvers, threads, options):
    """All runs of one problem at one thread count, interleaved, and their summary."""
    runs = []
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(options.runs):
            for name, config, program in in_turn(solvers, turn):
                if time.time() > options.deadline:
                    runs.append({"name": name, "config": config, "threads": threads,
                                 "failed": "not run: the time for all runs was over"})
                    continue
                run = run_undisturbed(program, name, config, problem, threads, options, folder,
                                      retries=options.retries)
                runs.append({**run, "turn": turn})
                report(problem, run)
    optimum = min(run_table.best_cost(runs), options.optimum)
    rows = run_table.summarise(runs, optimum)
    return {"problem": os.path.basename(problem), "threads": threads, "best_cost": optimum,
            "header": header(problem), "runs": runs, "summary": rows}


def report(problem, run):
    words = run.get("failed") or (f"{run['final_cost_independent']:.6f} in {run['total_s']:.3f} s" +
                                  ("" if run["agrees"] else f", BUT IT SAYS {run['final_cost']}"))
    print(f"{os.path.basename(problem)} {run['threads']} {run['name']}:{run['config']}: {words}",
          file=sys.stderr, flush=True)


def header(problem):
    with open(problem) as file:
        return dict(zip(("cameras", "points", "observations"),
                        (int(n) for n in file.readline().split())))


def median_run(runs, row):
    """The run of that row whose total time is the median one."""
    mine = [r for r in runs if not r.get("failed") and
            (r["name"], r["config"]) == (row["name"], row["config"])]
    mine.sort(key=lambda r: r["total_s"])
    return mine[len(mine) // 2]


def curves(document, tau="0.001"):
    """Each solver's quickest configuration to f*(1 + tau), sheaf first; labels and traces."""
    chosen = {}
    comparable = [r for r in document["summary"] if r["runs"] and r["agrees"]]
    for row in sorted(comparable, key=lambda r: run_table.speed(r, tau)):
        chosen.setdefault(row["name"], row)
    rows = sorted(chosen.values(), key=lambda r: (r["name"] != "sheaf", run_table.speed(r, tau)))
    return [(row["name"] if row["name"] == "sheaf" else f"{row['name']} {row['config']}",
             median_run(document["runs"], row)["trace"])
            for row in rows[:len(cost_plot.COLOURS)]]


def plot_name(document):
    """cost-16-images-1-threads.svg: plots are ours, and are not named like the files they show."""
    stem = os.path.splitext(document["problem"])[0]
    images = re.match(r"[a-z]+-(\d+)(?:-\d+-pre)?(-k2zero)?$", stem)
    short = f"{images[1]}-images{images[2] or ''}" if images else stem
    return f"cost-{short}-{document['threads']}-threads.svg"


def write_results(results, out):
    os.makedirs(out, exist_ok=True)
    with open(os.path.join(out, "results.json"), "w") as file:
        json.dump(results, file, indent=1)
    with open(os.path.join(out, "table.md"), "w") as file:
        for document in results["problems"]:
            file.write(f"### {title(document)}\n\nf* = {document['best_cost']:.6f}\n\n" +
                       run_table.markdown(document["summary"]) + "\n")
    for document in results["problems"]:
        drawn = curves(document)
        if drawn:
            with open(os.path.join(out, plot_name(document)), "w") as file:
                file.write(cost_plot.draw(title(document), drawn, document["best_cost"]))


def title(document):
    count = document["threads"]
    return f"{document['problem']}, {count} thread{'s' if count > 1 else ''}"


def find_solvers(text, folders):
    """[(name, config, program)] of comma-separated NAME:CONFIG, and the names that are not here."""
    solvers, missing = [], set()
    for word in filter(None, text.split(",")):
        name, _, config = word.partition(":")
        program = find_program(name, folders)
        if program:
            solvers.append((name, config, program))
        elif name not in missing:
            print(f"peer-{name} is not here: left out", file=sys.stderr)
            missing.add(name)
    return solvers, sorted(missing)


def machine(path):
    facts = {"cpu": platform.processor() or platform.machine(), "cores": os.cpu_count()}
    if path:
        with open(path) as file:
            facts.update(json.load(file))
    return facts


def main():
    options = parse_arguments()
    if options.self_test:
        import self_test
        return self_test.run()
    solvers, missing = find_solvers(options.solvers, options.peers)
    if not solvers or not options.problems:
        sys.exit("nothing to run: --problems and --solvers (see --help)")
    options.deadline = time.time() + 60 * options.budget_minutes
    results = {"version": 1, "date": time.strftime("%Y-%m-%d"), "runs": options.runs,
               "machine": machine(options.machine), "taus": run_table.TAUS,
               "missing": missing, "problems": []}
    for problem in options.problems:
        for threads in (int(n) for n in options.threads.split(",")):
            results["problems"].append(compare(problem, solvers, threads, options))
            write_results(results, options.out)
    with open(os.path.join(options.out, "table.md")) as file:
        print(file.read(), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
