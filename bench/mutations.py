#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Reads damaged files with the command, and counts what becomes of them.

  mutations.py SHEAF [--inputs 30000] [--seed 1] [--jobs 2]

A generated scene is written in every format that is read and written. Each input is one of these with a
few bytes changed, cut, doubled, swapped or replaced by others that matter (signs, digits, quotes, huge
counts), and goes through `sheaf convert IN out.txt`, so that what is accepted is written too. Right is:
exit code 0 with an output that reads again, or 2 or 3 with a sentence on stderr and no output; never a
signal, another code, a control character on a stream, or a file left behind. The last lines have the
counts; the exit code is 1 where anything else happened.
"""
import argparse
import collections
import concurrent.futures
import os
import random
import subprocess
import sys
import tempfile

FILES = ["in.txt", "in.txt.gz", "in.out", "in.nvm", "in.problem", "in.sfm", "reconstruction.json",
         "sfm_data.json"]
FOLDERS = {"colmap": "cameras.bin images.bin points3D.bin".split(),
           "colmap-text": "cameras.txt images.txt points3D.txt".split()}
PIECES = [b"-", b"e999", b"nan", b"inf", b"0", b"-1", b"\x00", b"\xff\xff\xff\xff", b"\n", b" ",
          b"\x1b[2J", b"99999999999999999999", b'"', b"{", b"]", b"4294967295", b"\xc3(", b"1e-320"]


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sheaf", help="the command")
    parser.add_argument("--inputs", type=int, default=30000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2)
    return parser.parse_args()


def mutated(data, draw):
    data = bytearray(data)
    for _ in range(draw.choice([1, 1, 2, 4])):
        at, many = draw.randrange(len(data) + 1), draw.randrange(1, 40)
        kind = draw.choice([0, 0, 1, 2, 3, 4, 5, 6, 6, 6])
        digits = [k for k in range(max(0, at - 40), min(len(data), at + 40)) if 48 <= data[k] < 58]
        if kind == 0 and at < len(data):
            data[at] = draw.randrange(256)
        elif kind == 6 and digits:
            data[draw.choice(digits)] = draw.randrange(48, 58)
        elif kind == 1:
            del data[at:at + many]
        elif kind == 2:
            data[at:at] = data[at:at + many]
        elif kind == 3:
            piece = draw.choice(PIECES)
            data[at:at + draw.choice([0, len(piece)])] = piece
        elif kind == 4:
            del data[at:]
        else:
            other = draw.randrange(len(data) + 1)
            data[at:at + many], data[other:other + many] = (data[other:other + many],
                                                            data[at:at + many])
        if not data:
            break
    return bytes(data)


def write(path, data):
    with open(path, "wb") as file:
        file.write(data)


def judge(sheaf, job):
    """One input: what became of it, and words where that is wrong."""
    name, files, seed = job
    draw = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        place = os.path.join(folder, name)
        if name in FOLDERS:
            os.mkdir(place)
            hit = draw.choice(sorted(files))
            for part, data in files.items():
                write(os.path.join(place, part), mutated(data, draw) if part == hit else data)
        else:
            hit = name if len(files) == 1 or draw.random() < 0.7 else draw.choice(sorted(files))
            for part, data in files.items():
                write(os.path.join(folder, part), mutated(data, draw) if part == hit else data)
        before = set(os.listdir(folder))
        done = subprocess.run([sheaf, "convert", place, os.path.join(folder, "out.txt"), "--quiet"],
                              capture_output=True, timeout=60)
        left = set(os.listdir(folder)) - before
        streams = done.stdout + done.stderr
        wrong = []
        if any(byte < 32 and byte not in (9, 10) for byte in streams):
            wrong.append("a control character")
        if done.returncode == 0:
            again = subprocess.run([sheaf, "info", os.path.join(folder, "out.txt"), "--quiet"],
                                   capture_output=True, timeout=60)
            if left != {"out.txt"} or again.returncode not in (0, 2):
                wrong.append(f"output {sorted(left)}, read again: {again.stderr[:200]!r}")
        elif done.returncode in (2, 3):
            if left or len(done.stderr) < 10:
                wrong.append(f"left {sorted(left)}, said {done.stderr[:200]!r}")
        else:
            wrong.append(f"exit {done.returncode}: {done.stderr[:300]!r}")
        return name, done.returncode, [f"{name} seed {seed}: {w}" for w in wrong]


def templates(sheaf, folder):
    run = lambda *words: subprocess.run([sheaf, *words, "--quiet"], check=True, cwd=folder,
                                        capture_output=True)
    run("generate", "start", "--cameras", "4", "--points", "24", "--camera", "SIMPLE_RADIAL")
    run("generate", "in.txt", "--cameras", "4", "--points", "24")
    run("generate", "plain", "--cameras", "4", "--points", "24", "--camera", "SIMPLE_PINHOLE",
        "--shared")
    out = {}
    for name in FILES:
        place = os.path.join(folder, "of-" + name)
        os.mkdir(place)
        source = ("in.txt" if name in ("in.txt", "in.txt.gz") else
                  "plain" if name in ("in.nvm", "in.problem") else "start")
        done = subprocess.run([sheaf, "convert", source, os.path.join(place, name), "--quiet"],
                              cwd=folder, capture_output=True)
        if done.returncode != 0:
            print(f"not tried: {name}: {done.stderr.decode()[:200]}")
            continue
        out[name] = {part: open(os.path.join(place, part), "rb").read()
                     for part in sorted(os.listdir(place))}
    for name, parts in FOLDERS.items():
        run("convert", "start", name, "--format", name)
        out[name] = {part: open(os.path.join(folder, name, part), "rb").read() for part in parts}
    return out


def main():
    a = parse_arguments()
    sheaf = os.path.abspath(a.sheaf)
    with tempfile.TemporaryDirectory() as folder:
        known = templates(sheaf, folder)
    names = sorted(known)
    jobs = [(names[k % len(names)], known[names[k % len(names)]], a.seed * 1_000_003 + k)
            for k in range(a.inputs)]
    counts, wrong = collections.defaultdict(collections.Counter), []
    with concurrent.futures.ThreadPoolExecutor(a.jobs) as pool:
        for name, code, words in pool.map(lambda job: judge(sheaf, job), jobs):
            counts[name][code] += 1
            wrong += words
    for words in wrong[:40]:
        print(words)
    for name in names:
        print(f"{name:<22} " + ", ".join(f"exit {code}: {n}"
                                         for code, n in sorted(counts[name].items())))
    print(f"{a.inputs} inputs, {len(wrong)} wrong")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
