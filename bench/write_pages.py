#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""BENCHMARKS.md and the README's table from results: write_pages.py RESULTS.json ROOT PLOTS [KERNELS.json]

ROOT is the repository; PLOTS the folder with the SVGs, relative to it. KERNELS.json is the output
of bench-kernels in Google Benchmark's format, when there is one.
"""
import json
import os
import sys

import run_table
import side_by_side
import suite_report

BEGIN, END = "<!-- bench:begin -->", "<!-- bench:end -->"
TAU = "1e-06"
# Columns of the README: the peers a reader looks for, with what to call them there.
PEERS = (("ceres-head", "Ceres HEAD"), ("ceres-2.1", "Ceres 2.1"), ("g2o", "g2o"),
         ("gtsam", "GTSAM"))


def stem(document):
    return os.path.splitext(document["problem"])[0]


def readme_table(results):
    """Time to f*(1 + 1e-6) of every solver's strongest configuration, and ratios to ours."""
    measured = {r["name"] for d in results["problems"] for r in d["summary"] if r["runs"]}
    peers = [(name, text) for name, text in PEERS if name in measured]
    head = ["problem", "threads", "sheaf, s"]
    for _, text in peers:
        head += [f"{text}, s", "ratio"]
    lines = ["| " + " | ".join(head) + " |", "|---" + "|--:" * (len(head) - 1) + "|"]
    for document in results["problems"]:
        ours = run_table.strongest(document["summary"], "sheaf", TAU)
        cells = [stem(document) + run_table.mark(document), str(document["threads"]),
                 run_table.seconds(ours and ours["time_to"][TAU])]
        for name, _ in peers:
            cells += peer_cells(document, name, ours)
        lines.append("| " + " | ".join(cells) + " |")
    note = ("Seconds from the built arrays to within 1e-6 of f*, the best cost among these rows (all "
            "of them: [BENCHMARKS.md](BENCHMARKS.md)), set-up included, reading left out; medians "
            f"of {results['runs']} interleaved runs; \"miss\": not within 50 steps{at_most(results)}. "
            "For each solver its quickest configuration measured. **Only the ratios (in bold) carry "
            "over, and those within a kind of processor; the seconds are those of this machine:** "
            f"{run_table.machine_text(results['machine'])}; {results['date']}. Ceres HEAD and g2o "
            "were built natively for it, with derivatives by hand; Ceres 2.1 is Debian's package.")
    lower = run_table.footnote(results["problems"])
    return "\n".join(lines) + "\n\n" + note + "\n" + ("\n" + lower if lower else "")


def at_most(results):
    """The limits that the runs had, in words."""
    limits = [r["limit_s"] for d in results["problems"] for r in d["runs"] if "limit_s" in r]
    return f" and {run_table.either(limits)} s" if limits else ""


def peer_cells(document, name, ours):
    row = run_table.strongest(document["summary"], name, TAU)
    if row is None:
        return ["miss", ""]
    ratio = f"**{row['time_to'][TAU] / ours['time_to'][TAU]:.1f}**" if ours else ""
    return [run_table.seconds(row["time_to"][TAU]), ratio]


def kernel_table(document, machine):
    """From Google Benchmark's JSON: time of one core, work, and rates beside the machine's own.

    Processor time, not the wall's, so that other programs do not enter."""
    lines = ["| kernel | ms | flops/obs. | Gflop/s | of peak | bytes/obs. | GB/s | of triad |",
             "|---|--:|--:|--:|--:|--:|--:|--:|"]
    scale = {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}
    triad = machine.get("triad_gbytes_s", {}).get("one")
    for b in document["benchmarks"]:
        if b.get("run_type") == "aggregate":
            continue
        rate, peak = b.get("Gflop/s"), b.get("of peak")
        flops, nbytes = b.get("flops/obs"), b.get("bytes/obs")
        traffic = rate * nbytes / flops if rate and flops and nbytes else None
        lines.append("| " + " | ".join([
            b["name"].replace("/real_time", ", wall"),
            f"{b['real_time' if 'real_time' in b['name'] else 'cpu_time'] * scale[b['time_unit']]:.3f}",
            f"{flops:.0f}" if flops else "", f"{rate / 1e9:.1f}" if rate else "",
            f"{100 * peak:.0f} %" if peak else "", f"{nbytes:.0f}" if nbytes else "",
            f"{traffic / 1e9:.1f}" if traffic else "",
            f"{100 * traffic / 1e9 / triad:.0f} %" if traffic and triad else ""]) + " |")
    return "\n".join(lines) + "\n"


# Of an iteration on dubrovnik-16's shape: the kernel, what it does, and the milliseconds that the
# first sketch of this layout took on a machine of this kind (AVX-512, written by hand).
STAGES = [("linearize", "Jacobians, 3x3 factors, records", 0.81),
          ("diagonal", "diagonal blocks, right-hand side", 0.35),
          ("pairs", "off-diagonal blocks", 0.86),
          ("cholesky/144", "camera system, 144 columns", 0.04),
          ("trial", "back-substitution, trial cost", 0.33),
          ("trial_inner", "the same with inner iterations", None)]


def stage_table(document):
    """The stages of one iteration beside the floor that their flops set and the first sketch."""
    scale = {"ns": 1e-6, "us": 1e-3, "ms": 1.0, "s": 1e3}
    # The machine's best instruction set comes first.
    best = next((b["name"].split("/")[0] for b in document["benchmarks"] if "/" in b["name"]), "")
    rows = {b["name"]: b for b in document["benchmarks"] if b.get("run_type") != "aggregate"}
    lines = ["| stage | what | ms | floor, ms | over the floor | sketch, ms | over the sketch |",
             "|---|---|--:|--:|--:|--:|--:|"]
    for name, what, sketch in STAGES:
        b = rows.get(f"{best}/{name}")
        if b is None:
            continue
        ms = b["cpu_time"] * scale[b["time_unit"]]
        floor = ms * b["of peak"] if b.get("of peak") else None
        lines.append(f"| {name} | {what} | {ms:.3f} | {f'{floor:.3f}' if floor else ''} "
                     f"| {f'{ms / floor:.1f}' if floor else ''} | {sketch or ''} "
                     f"| {f'{ms / sketch:.2f}' if sketch else ''} |")
    return "\n".join(lines) + "\n"


def page(results, plots, kernels=None):
    """BENCHMARKS.md."""
    machine = results["machine"]
    out = ["# Benchmarks\n",
           "Written by `bench/regenerate.sh` (and its ladder by `bench/suite.py`); do not edit. How it is measured: "
           "[bench/README.md](bench/README.md).\n",
           f"Machine: {run_table.machine_text(machine)}. {results['date']}. Medians of {results['runs']} "
           "interleaved runs in fresh processes. Times are seconds until the cost is at or below "
           "f* (1 + tau), f* the best cost among the problem's rows, set-up included, reading left out; "
           f"\"miss\": not within 50 steps{at_most(results)}. Cost is 1/2 sum |r|^2, 9-parameter cameras, no loss. \"Final cost\" is "
           "evaluated by code apart from all solvers; † marks a solver whose own figure differs (one "
           "that leaves observations out, say): its trace is not comparable and gets no times. "
           "\"Spread\" is (max - min) / median of the "
           "last target. One-thread runs that got less than 90 % of a core were repeated; what is "
           "still below in the CPU column was disturbed, and seconds there are too long. "
           "For sheaf the CPU column counts the whole process, reading and writing included.\n"]
    if results["missing"]:
        out.append(f"Not on this machine: {', '.join(results['missing'])}.\n")
    out += ["## Summary\n", readme_table(results)]
    for document in results["problems"]:
        counts = ", ".join(f"{n} {what}" for what, n in document["header"].items())
        out += [f"## {side_by_side.title(document)}\n",
                f"{counts}; f* = {document['best_cost']:.6f}{run_table.mark(document)}.\n",
                run_table.markdown(document["summary"]),
                f"![cost against time]({plots}/{side_by_side.plot_name(document)})\n"]
    if kernels:
        out += ["## Stages\n",
                "One iteration of dubrovnik-16's shape on one core, stage by stage. The floor is the "
                "stage's flops at this machine's measured peak. Above it stand divisions and square "
                "roots, slow and counted as one flop each, the transposes and stores of records, "
                "and in the small Cholesky a chain of pivots.\n",
                stage_table(kernels),
                "## Kernels\n",
                "One pass over dubrovnik-16's shape on one core, beside what this machine can do "
                "at best. Traffic counts what a pass must move; data that stay in cache show as "
                "more than the triad's rate.\n", kernel_table(kernels, machine)]
    return "\n".join(out)


def between(text, table):
    """`text` with what stands between the markers replaced; without markers it stays as it is."""
    if BEGIN not in text or END not in text:
        return text
    return text[:text.index(BEGIN) + len(BEGIN)] + "\n" + table + text[text.index(END):]


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    with open(sys.argv[1]) as file:
        results = json.load(file)
    root, plots = sys.argv[2:4]
    kernels = None
    if len(sys.argv) > 4:
        with open(sys.argv[4]) as file:
            kernels = json.load(file)
    benchmarks = os.path.join(root, "BENCHMARKS.md")
    ladder = ""  # suite.py writes that section
    if os.path.exists(benchmarks):
        with open(benchmarks) as file:
            ladder = suite_report.cut(file.read())
    with open(benchmarks, "w") as file:
        file.write(page(results, plots, kernels) + ("\n" + ladder if ladder else ""))
    readme = os.path.join(root, "README.md")
    with open(readme) as file:
        text = file.read()
    with open(readme, "w") as file:
        file.write(between(text, readme_table(results)))


if __name__ == "__main__":
    main()
