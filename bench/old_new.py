#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Whether a new build is slower than an old one: both run in turns, old new new old ...

  old_new.py OLD NEW [--kernels OLD NEW] [--command "solve a.txt --solver sparse" ...]

OLD and NEW are sheaf commands, or bench-kernels programs after --kernels. Without --command the
rows are plain solves of the three scenes in $SHEAF_DATA/bal. A pair is one measurement of each
program, made one right after the other; its ratio is new / old, so that what slows the machine down
for a while slows both. Printed are, row by row, the median ratio of all pairs and the 95 % interval
of the slowdown that the order of the ratios gives (a sign test, whatever their distribution). The
exit code is 1 where the lower end of an interval is above --most.

Seconds are those that the command itself states: of set-up and solving, reading and writing left
out, the fastest of --repeat runs. The processor's, unless --clock says otherwise: other programs
enter them least.
"""
import argparse
import json
import math
import os
import shlex
import subprocess
import sys
import tempfile

SCENES = ("dubrovnik-16-22106", "trafalgar-21-11315", "ladybug-49-7776")


def sign_interval(ratios, level=0.95):
    """(low, high): order statistics between which the median lies at least with this probability.

    The k-th smallest of n is above the median with the probability that fewer than k of n fair
    coins show heads."""
    ordered, n = sorted(ratios), len(ratios)
    beyond, k = 0.0, 0
    while k < n // 2 and beyond + math.comb(n, k) / 2 ** n <= (1 - level) / 2:
        beyond += math.comb(n, k) / 2 ** n
        k += 1
    if k == 0:
        raise ValueError(f"{n} pairs are too few for an interval of {level:g}")
    return ordered[k - 1], ordered[n - k]


def median(values):
    ordered, n = sorted(values), len(values)
    return (ordered[(n - 1) // 2] + ordered[n // 2]) / 2


def solve_seconds(program, words, arguments, folder):
    """Of one command of a sheaf program, the fastest run."""
    path = os.path.join(folder, "summary.json")
    fastest = math.inf
    for _ in range(arguments.repeat):
        subprocess.run([program, *words, "--quiet", "--threads", str(arguments.threads), "--json",
                        path], check=True, stdout=subprocess.DEVNULL)
        with open(path) as file:
            time = json.load(file)["time"]
        wall = time["setup_s"] + time["solve_s"]
        fastest = min(fastest, time["cpu_s"] if arguments.clock == "cpu" and "cpu_s" in time
                      else wall)
    return fastest


def kernel_rows(program, arguments):
    """{row: time of one pass} of a bench-kernels program: the fastest of --repeat measurements."""
    result = subprocess.run(
        [program, "--benchmark_format=json", f"--benchmark_filter={arguments.filter}",
         f"--benchmark_min_time={arguments.kernel_seconds}",
         f"--benchmark_repetitions={arguments.repeat}"],
        check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    rows = {}
    for b in json.loads(result.stdout)["benchmarks"]:
        if b.get("run_type") == "aggregate":
            continue
        name = b["name"].replace("/real_time", "")
        # Of a step on two threads the processor's time would be the first one's.
        wall = arguments.clock == "wall" or name.endswith("/step/2")
        rows[name] = min(rows.get(name, math.inf), b["real_time" if wall else "cpu_time"])
    return rows


def measure(pairs, old, new):
    """{row: ratios} of two functions that give {row: time}, called in turns: old new new old ..."""
    ratios = {}
    for turn in range(pairs):
        if turn % 2:
            after, before = new(), old()
        else:
            before, after = old(), new()
        for row in (row for row in before if row in after):
            ratios.setdefault(row, []).append(after[row] / before[row])
        if sys.stderr.isatty():
            print(f"\r{turn + 1} of {pairs} pairs ", end="\n" if turn + 1 == pairs else "",
                  file=sys.stderr)
    return ratios


def report(ratios, most):
    """The table as text, and the rows that are slower by more than `most`."""
    lines, slower = [], []
    width = max(map(len, ratios), default=0)
    for row, values in ratios.items():
        low, high = sign_interval(values)
        verdict = ""
        if low - 1 > most:
            slower.append(row)
            verdict = "  slower"
        lines.append(f"{row:{width}}  {median(values):.3f}  "
                     f"[{100 * (low - 1):+.1f} %, {100 * (high - 1):+.1f} %]{verdict}")
    return "\n".join(lines), slower


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--kernels", nargs=2, metavar=("OLD", "NEW"), help="bench-kernels programs")
    parser.add_argument("--command", action="append", metavar="WORDS",
                        help="a solve or photometric command; may be given several times")
    parser.add_argument("--data", default=os.environ.get("SHEAF_DATA", "data"), metavar="FOLDER")
    parser.add_argument("--pairs", type=int, default=21)
    parser.add_argument("--repeat", type=int, default=3,
                        help="runs of a measurement, of which the fastest counts [3]")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--clock", choices=("cpu", "wall"), default="cpu")
    parser.add_argument("--most", type=float, default=0.02, help="slowdown that is let pass [0.02]")
    parser.add_argument("--filter", default="", metavar="REGEX",
                        help="kernels to run [those of the best instruction set]")
    parser.add_argument("--kernel-seconds", type=float, default=0.02, metavar="S",
                        help="of each kernel's measurement [0.02]")
    return parser.parse_args()


def best_kernels(program):
    """A filter for the kernels of the machine's best instruction set, which come first."""
    listed = subprocess.run([program, "--benchmark_list_tests"], check=True, text=True,
                            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout.split()
    best = next(name.split("/")[0] for name in listed if "/" in name)
    return f"^(arrange$|{best}/)"


def main():
    arguments = parse()
    commands = arguments.command or [
        f"solve {os.path.join(arguments.data, 'bal', scene + '-pre.txt')}" for scene in SCENES]
    slower = []
    print("row, median of new / old, 95 % interval of the slowdown")
    with tempfile.TemporaryDirectory() as folder:
        for command in commands:
            words = shlex.split(command)
            row = " ".join(os.path.basename(word) for word in words)
            old, new = ((lambda program=program: {
                row: solve_seconds(program, words, arguments, folder)})
                for program in (arguments.old, arguments.new))
            text, found = report(measure(arguments.pairs, old, new), arguments.most)
            print(text, flush=True)
            slower += found
    if arguments.kernels:
        arguments.filter = arguments.filter or best_kernels(arguments.kernels[0])
        old, new = ((lambda program=program: kernel_rows(program, arguments))
                    for program in arguments.kernels)
        text, found = report(measure(arguments.pairs, old, new), arguments.most)
        print(text)
        slower += found
    if slower:
        print(f"slower by more than {100 * arguments.most:g} %: {', '.join(slower)}")
    return 1 if slower else 0


if __name__ == "__main__":
    sys.exit(main())
