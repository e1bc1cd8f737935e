#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Hashes what a `sheaf` program writes, command by command, to hold two builds against each other.

  check-bits.py SHEAF                      print the list: a name and a SHA-256 for each output
  check-bits.py SHEAF --against OTHER      run both; name every line that differs, and exit with 1
  check-bits.py SHEAF --list FILE          the same against a list that was printed before

The commands (scripts/bits/commands.py) take every home, camera solver, precision, loss, format and
verb. Their scenes are generated; where $SHEAF_DATA has real ones, those are solved too. Hashed are
files as they are, JSON without what depends on machine, time, memory and version (its `options` are
a line of their own), and what is printed without times. Commands run with two threads, some of them
with one as well, and a program whose result depends on that fails by itself. So does a command that
exits with anything but 0.
"""

import argparse
import fnmatch
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.dont_write_bytecode = True
from bits.commands import Command, all_commands  # noqa: E402

# Keys of the JSON that differ between machines, builds or runs.
UNSTEADY = {"version", "command", "time", "memory", "simd", "threads", "time_s", "time_to", "solve_s",
            "setup_s", "total_s", "cpu_percent", "peak_bytes", "seconds_per_iteration",
            "seconds_per_accepted", "seconds_per_rejected"}


def steady(value):
    """A JSON value without the unsteady keys; traces keep their costs."""
    if isinstance(value, dict):
        return {key: [cost for _, cost in rest] if key == "trace" and rest else steady(rest)
                for key, rest in value.items() if key not in UNSTEADY}
    return [steady(x) for x in value] if isinstance(value, list) else value


def steady_text(text):
    """What was printed without times, memory, instruction sets and numbers of threads."""
    lines = [line for line in text.splitlines() if not line.startswith(("time ", "memory "))]
    text = re.sub(r", \w+, \d+ threads?$", "", "\n".join(lines), flags=re.MULTILINE)
    return re.sub(r"\d+(\.\d+)? s\b", "T s", text)


def sha256(data):
    return hashlib.sha256(data).hexdigest()


class Program:
    """One `sheaf`, what it is run with, and the folder that it works in."""

    def __init__(self, path, work, arguments, threads):
        self.path = str(pathlib.Path(path).resolve())
        self.work, self.threads, self.simd = work, threads, arguments.simd
        self.runs_twice = arguments.against_threads in (None, arguments.threads) and threads != 1
        self.hashes, self.costs, self.failures, self.helps = {}, {}, [], {}
        work.mkdir(parents=True)
        data = os.environ.get("SHEAF_DATA")
        if data:
            (work / "data").symlink_to(pathlib.Path(data).resolve())

    def takes_simd(self, verb):
        """Whether the verb lets the instruction set be chosen."""
        if verb not in self.helps:
            self.helps[verb] = subprocess.run([self.path, verb, "--help"], capture_output=True,
                                              text=True, timeout=60).stdout
        return "--simd" in self.helps[verb]

    def run_all(self, commands, chosen):
        for item in commands.list:
            if item.name not in chosen:
                continue
            if not isinstance(item, Command):
                paths = [self.work / scene_path(commands, name) for name in item.needs]
                (self.work / "out").mkdir(exist_ok=True)
                item.write(self.work / "out" / item.name, paths)
                continue
            self.run(commands, item, item.name, self.threads)
            if item.one_thread and self.runs_twice:
                self.run(commands, item, item.name + "@1", 1)
                self.hold_threads_equal(item.name)

    def run(self, commands, item, name, threads):
        folder = pathlib.Path("out") / name
        (self.work / folder).mkdir(parents=True)
        words = [self.path] + [expand(commands, word, folder) for word in shlex.split(item.words)]
        words += ["--quiet", "--threads", str(threads)]
        if self.simd and self.takes_simd(words[1]):
            words += ["--simd", self.simd]
        result = subprocess.run(words, cwd=self.work, capture_output=True, text=True, timeout=300)
        if result.returncode != 0:
            self.failures.append(f"{name}: exit code {result.returncode}: {result.stderr.strip()}")
            self.hashes[f"{name}/failed"] = f"exit-{result.returncode}"
            return
        if words[1] != "compare":  # whose table is of times
            self.hashes[f"{name}/printed"] = sha256(
                steady_text(result.stdout.replace(str(folder), "@")).encode())
        self.hash_files(name, self.work / folder, str(folder))

    def hash_files(self, name, folder, spelled):
        """A line for each file, one for all PNGs and one for all SVGs of a folder, two for JSON."""
        pictures = {}
        for path in sorted(p for p in folder.rglob("*") if p.is_file()):
            place = path.relative_to(folder)
            if place.name == "json":
                document = steady(json.loads(path.read_text().replace(spelled, "@")))
                options = document.pop("options", None)
                self.costs[name] = document
                self.hashes[f"{name}/json"] = sha256(json.dumps(document, sort_keys=True).encode())
                if options is not None:
                    self.hashes[f"{name}/json:options"] = sha256(
                        json.dumps(options, sort_keys=True).encode())
            elif path.suffix in (".png", ".svg"):
                pictures.setdefault(str(place.parent / f"*{path.suffix}"), hashlib.sha256()).update(
                    place.name.encode() + path.read_bytes())
            else:
                self.hashes[f"{name}/{place}"] = sha256(path.read_bytes())
        for place, total in pictures.items():
            self.hashes[f"{name}/{place}"] = total.hexdigest()

    def hold_threads_equal(self, name):
        for line in [x for x in self.hashes if x.startswith(name + "@1/")]:
            if self.hashes[line] != self.hashes.get(line.replace("@1/", "/", 1)):
                self.failures.append(f"{line} is not what it is with {self.threads} threads")


def scene_path(commands, name):
    return pathlib.Path("out") / name / commands.results[name]


def expand(commands, word, folder):
    word = re.sub(r"\{([^}]+)\}", lambda m: str(scene_path(commands, m.group(1))), word)
    return f"{folder}/{word[1:]}" if word.startswith("@") else word


def choose(commands, arguments):
    """Names of the commands asked for, and of the scenes that they need."""
    wanted = [x for x in commands.list if not arguments.only
              or any(fnmatch.fnmatch(x.name, pattern) for pattern in arguments.only)]
    if arguments.quick:
        wanted = [x for x in wanted if isinstance(x, Command) and x.quick]
    by_name, chosen = {x.name: x for x in commands.list}, set()

    def take(item):
        if item.name in chosen:
            return
        chosen.add(item.name)
        needs = item.needs if not isinstance(item, Command) else re.findall(
            r"\{([^}]+)\}|out/([\w.]+)/", item.words)
        for need in needs:
            take(by_name[need if isinstance(need, str) else need[0] or need[1]])

    for item in wanted:
        take(item)
    return chosen


def relative(a, b):
    return abs(a - b) / max(abs(a), abs(b), 1e-300)


def costs_apart(ours, theirs):
    """How far two runs' costs are apart, relatively: after one step and at the end, or None."""
    try:
        first = relative(*(x["iterations"][1]["cost"] for x in (ours, theirs)))
        return first, relative(ours["final_cost"], theirs["final_cost"])
    except (KeyError, IndexError, TypeError):
        return None


def read_list(path):
    lines = [line.split() for line in pathlib.Path(path).read_text().splitlines() if line.strip()]
    return {name: value for name, value in lines}


def report_differences(ours, theirs, our_costs, their_costs):
    """Prints each line that differs and returns how many do."""
    count, furthest = 0, [0, 0]
    for name in sorted(ours.keys() | theirs.keys()):
        if ours.get(name) == theirs.get(name):
            continue
        count += 1
        if name not in ours or name not in theirs:
            print(f"only in the {'second' if name not in ours else 'first'}: {name}")
            continue
        command = name.rsplit("/json", 1)[0]
        apart = costs_apart(our_costs.get(command), their_costs.get(command))
        if name.endswith("/json") and apart:
            furthest = [max(pair) for pair in zip(furthest, apart)]
            name += " (costs apart by {:.1e} after one step, {:.1e} at the end)".format(*apart)
        print(f"differs: {name}")
    if any(furthest):
        print("costs are at most {:.1e} apart after one step, {:.1e} at the end".format(*furthest))
    return count


def compare(program, other, saved):
    """The exit code of a program held against another or against a saved list."""
    theirs = other.hashes if other else saved
    if saved is not None and not (program.work / "data").exists():
        theirs = {name: value for name, value in theirs.items() if not name.startswith("real.")}
    count = report_differences(program.hashes, theirs, program.costs, other.costs if other else {})
    failures = program.failures + (other.failures if other else [])
    for failure in failures:
        print(failure)
    print(f"{len(program.hashes)} lines, {count} differ" if count else
          f"{len(program.hashes)} lines, all equal")
    return 1 if count or failures else 0


def parse():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="a sheaf command")
    parser.add_argument("--against", metavar="OTHER", help="another sheaf command")
    parser.add_argument("--list", metavar="FILE", help="a list printed before")
    parser.add_argument("--threads", type=int, default=2, help="of most commands [2]")
    parser.add_argument("--against-threads", type=int, help="of the other program's [the same]")
    parser.add_argument("--simd", help="instruction set, for verbs that let it be chosen")
    parser.add_argument("--quick", action="store_true", help="a subset of a few seconds")
    parser.add_argument("--only", nargs="*", metavar="PATTERN", help="commands of these names")
    parser.add_argument("--keep", metavar="FOLDER", help="work there, in a and b, and leave it")
    return parser.parse_args()


def main():
    arguments = parse()
    commands = all_commands(os.environ.get("SHEAF_DATA"))
    names = [item.name for item in commands.list]
    if len(names) != len(set(names)):
        sys.exit("two commands of one name: " + ", ".join(
            sorted({name for name in names if names.count(name) > 1})))
    chosen = choose(commands, arguments)
    work = pathlib.Path(arguments.keep or tempfile.mkdtemp(prefix="sheaf-bits-"))
    try:
        program = Program(arguments.program, work / "a", arguments, arguments.threads)
        program.run_all(commands, chosen)
        if arguments.against:
            other = Program(arguments.against, work / "b", arguments,
                            arguments.against_threads or arguments.threads)
            other.run_all(commands, chosen)
            return compare(program, other, None)
        if arguments.list:
            return compare(program, None, read_list(arguments.list))
        for name, value in program.hashes.items():
            print(f"{name} {value}")
        for failure in program.failures:
            print(failure, file=sys.stderr)
        return 1 if program.failures else 0
    finally:
        if not arguments.keep:
            shutil.rmtree(work, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
