#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Sends signals to the command at any time, and looks at what is left.

  signals.py SHEAF [--signals 1000] [--seed 1] [--jobs 2]

Every run overwrites an output that is there. SIGINT, SIGTERM or SIGHUP comes after a random time, and in
every fourth run a second one soon after. Right is: exit code 130, or that of a run which was quicker, or
the system's own end of a process whose main() has not begun (a negative code); the output is as it was or reads as a whole; nothing else is in its folder; and the command ends within the
stated seconds of its signal. The last lines have the counts and the longest wait; the exit code is 1
where anything else happened.
"""
import argparse
import collections
import concurrent.futures
import os
import random
import signal
import subprocess
import sys
import tempfile
import time

LONGEST_S = 20  # under load; the longest that was seen is printed


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sheaf", help="the command")
    parser.add_argument("--signals", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    return parser.parse_args()


def scenes(sheaf, folder):
    run = lambda *words: subprocess.run([sheaf, *words, "--quiet"], check=True, cwd=folder,
                                        capture_output=True)
    run("generate", "street.txt", "--family", "street", "--cameras", "150", "--points", "12000")
    run("generate", "model", "--camera", "OPENCV", "--cameras", "30", "--points", "4000")
    run("generate", "rig", "--camera", "RADIAL", "--rigs", "stereo", "--frames", "20", "--points", "2000")
    run("generate", "photos", "--photometric", "--points", "800")
    at = lambda name: os.path.join(folder, name)
    tight = ["--tolerance", "1e-15", "--max-iterations", "60"]
    return {
        "solve, implicit": (["solve", at("street.txt"), "-o", "out.txt", "--solver",
                             "iterative-implicit"] + tight, "out.txt"),
        "solve, sparse, loss": (["solve", at("street.txt"), "-o", "out.txt", "--solver", "sparse",
                                 "--loss", "huber:auto"] + tight, "out.txt"),
        "solve, dense, folder": (["solve", at("model"), "-o", "out", "--solver", "dense"] + tight,
                                 "out"),
        "solve, rig": (["solve", at("rig"), "-o", "out"] + tight, "out"),
        "convert": (["convert", at("street.txt"), "out.sfm"], "out.sfm"),
        "generate": (["generate", "out.txt", "--family", "collection", "--cameras", "200", "--points",
                      "20000"], "out.txt"),
        "perturb": (["perturb", at("street.txt"), "out.txt", "--point", "0.1"], "out.txt"),
        "photometric": (["photometric", at("photos"), "-o", "out", "--levels", "3"] + tight,
                        "out"),
        "covariance": (["covariance", at("model"), "--json", "out.json"], "out.json"),
    }


def contents(path):
    if not os.path.isdir(path):
        with open(path, "rb") as file:
            return file.read()
    return {name: contents(os.path.join(path, name)) for name in sorted(os.listdir(path))}


def whole(sheaf, folder, output):
    """Whether what is there now can be read to its end."""
    path = os.path.join(folder, output)
    if output.endswith(".json"):
        with open(path) as file:
            return file.read().rstrip().endswith("}")
    if os.path.exists(os.path.join(path, "brightness.txt")):
        words = ["photometric", path, "--max-iterations", "0"]
    else:
        words = ["info", path]
    return subprocess.run([sheaf, *words, "--quiet"], capture_output=True).returncode in (0, 2)


def send(sheaf, name, words, output, seconds, seed):
    draw = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        quick = [word if word != "60" else "1" for word in words]
        subprocess.run([sheaf] + quick + ["--quiet"], cwd=folder, capture_output=True)
        before = contents(os.path.join(folder, output))
        process = subprocess.Popen([sheaf] + words + ["--quiet"], cwd=folder,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        time.sleep(draw.random() * seconds)
        first = draw.choice([signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
        sent = time.monotonic()
        process.send_signal(first)
        if seed % 4 == 0:
            time.sleep(draw.random() * 0.05)
            process.send_signal(draw.choice([signal.SIGINT, signal.SIGTERM, signal.SIGHUP]))
        words_of_it = process.communicate(timeout=600)[1]
        waited = time.monotonic() - sent
        wrong = []
        if process.returncode not in (0, 130, -first):
            wrong.append(f"exit {process.returncode}: {words_of_it[:200]!r}")
        if os.listdir(folder) != [output]:
            wrong.append(f"left {sorted(os.listdir(folder))}")
        elif contents(os.path.join(folder, output)) == before:
            pass
        elif process.returncode < 0 or not whole(sheaf, folder, output):
            wrong.append("the output is neither as it was nor whole")
        if process.returncode == 130 and waited > LONGEST_S:
            wrong.append(f"ended after {waited:.1f} s")
        return name, process.returncode, waited, [f"{name} seed {seed}: {w}" for w in wrong]


def main():
    a = parse_arguments()
    sheaf = os.path.abspath(a.sheaf)
    counts, longest, wrong = collections.defaultdict(collections.Counter), {}, []
    with tempfile.TemporaryDirectory() as folder:
        runs = scenes(sheaf, folder)
        takes = {}
        for name, (words, _) in runs.items():
            with tempfile.TemporaryDirectory() as place:
                began = time.monotonic()
                subprocess.run([sheaf] + words + ["--quiet"], cwd=place, capture_output=True)
                takes[name] = 1.1 * (time.monotonic() - began)
        names = sorted(runs)
        jobs = [(names[k % len(names)], a.seed * 1_000_003 + k) for k in range(a.signals)]
        with concurrent.futures.ThreadPoolExecutor(a.jobs) as pool:
            for name, code, waited, words in pool.map(
                    lambda job: send(sheaf, job[0], *runs[job[0]], takes[job[0]], job[1]), jobs):
                counts[name][code] += 1
                if code == 130:
                    longest[name] = max(longest.get(name, 0), waited)
                wrong += words
    for words in wrong[:40]:
        print(words)
    for name in names:
        print(f"{name:<22} " + ", ".join(f"exit {code}: {n}"
                                         for code, n in sorted(counts[name].items())) +
              f"; longest wait {longest.get(name, 0):.2f} s")
    print(f"{a.signals} signals, {len(wrong)} wrong")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
