# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""From runs to figures: times to f*(1 + tau), medians, Markdown tables."""
import math
import statistics

TAUS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-6)


# Minima below every row's that this project itself knows: points pass through infinity on the way
# there (`sheaf solve --points NAME`, to the end), and other observations lie behind their cameras.
# By problem: NAME, the cost, observations behind their cameras there, and where f* is.
KNOWN_LOWER = {
    "ladybug-49": ("homogeneous", 13120.540872, 337, 31),
    "ladybug-138": ("inverse-depth", 32103.529998, 18, 115),
    "ladybug-1723": ("inverse-depth", 299811.784318, 185, 952),
    "ladybug-49-k2zero": ("inverse-depth", 13454.406087, 328, 31),
    "ladybug-138-k2zero": ("inverse-depth", 35994.921756, 29, 115),
    "ladybug-1723-k2zero": ("inverse-depth", 331699.110083, 216, 955)}
MARK = "\u00b9"


def ladder_name(problem):
    """What the ladder calls a file; ladybug-138 and -1723 are the generated ones."""
    return {"ladybug-49-7776-pre.txt": "ladybug-49"}.get(problem, problem)


def known_lower(document):
    """The entry of KNOWN_LOWER that is below a document's f*, or None."""
    known = KNOWN_LOWER.get(ladder_name(document["problem"]))
    return known if known and known[1] < document["best_cost"] * (1 - 1e-6) else None


def mark(document):
    return " " + MARK if known_lower(document) else ""


def footnote(documents):
    """What is known below f* of the problems that have a mark; nothing where none has."""
    known = {ladder_name(d["problem"]): known_lower(d) for d in documents if known_lower(d)}
    if not known:
        return ""
    return (f"{MARK} Not the lowest cost that is known. With points that may pass through infinity "
            "(`--points`) sheaf ends lower, where other observations lie behind their cameras: "
            + "; ".join(f"{name} at {cost:.6g} by {points}, {behind} of them (at f* {at_best})"
                        for name, (points, cost, behind, at_best) in known.items()) + ".\n")


def time_to(trace, cost):
    """Seconds until the cost is at or below `cost`; infinite when it never is."""
    return next((t for t, c in trace if c <= cost), math.inf)


def trusted(run, tau):
    """Whether the run's own trace may be read at f* (1 + tau). One that ends at another cost than its
    state has counts something else; one that counts in float is read as far as it is exact."""
    return run["agrees"] and run.get("disagreement", 0.0) <= tau / 10


def best_cost(runs):
    """f*: the best cost among these runs, as evaluated independently. A solver's own figure does not
    count: it could be wrong."""
    finals = [r["final_cost_independent"] for r in runs if not r.get("failed")]
    return min((c for c in finals if math.isfinite(c)), default=math.nan)


def summarise(runs, optimum):
    """One row per (solver, config), in the order of first appearance: medians over its runs."""
    groups = {}
    for run in runs:
        groups.setdefault((run["name"], run["config"]), []).append(run)
    return [summary_row(name, config, group, optimum) for (name, config), group in groups.items()]


def summary_row(name, config, group, optimum):
    good = [r for r in group if not r.get("failed")]
    row = {"name": name, "config": config, "runs": len(good), "failed": len(group) - len(good)}
    if not good:
        row["message"] = group[0]["failed"]
        row["limit_s"] = group[0].get("limit_s") if group[0].get("cut") else None
        return row
    row["solver"] = good[0]["solver"]
    row["agrees"] = all(r["agrees"] for r in good)
    row["limit_s"] = max((r["limit_s"] for r in good if r.get("cut")), default=None)
    row["time_to"] = {}
    for tau in TAUS:
        times = [time_to(r["trace"], optimum * (1 + tau)) if trusted(r, tau) else math.inf
                 for r in good]
        row["time_to"][f"{tau:g}"] = finite(statistics.median(times))
    last = [t for t in times if math.isfinite(t)]
    row["spread"] = (max(last) - min(last)) / statistics.median(last) if last else None
    for key in ("seconds_per_iteration", "setup_s", "total_s", "cpu_percent", "peak_bytes",
                "iterations", "final_cost_independent"):
        row[key] = statistics.median(r[key] for r in good)
    return row


def finite(value):
    return value if math.isfinite(value) else None


def seconds(value):
    """Three figures that count; a miss is called one."""
    if value is None:
        return "miss"
    if value >= 100:
        return f"{value:.0f}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(value)))}f}" if value > 0 else "0"


def reached(row, tau):
    """The cell of a target: seconds, a miss, or the limit that ended the run before."""
    value = row.get("time_to", {}).get(f"{tau:g}")
    if value is None and row.get("limit_s"):
        return f"> {row['limit_s']:g}"
    return seconds(value)


def markdown(rows):
    """The whole table of one problem. Quickest to 1e-3 first, misses last. A run that the time limit
    ended before a target shows the limit."""
    head = ["solver", "configuration"] + [f"to {tau:g}" for tau in TAUS]
    head += ["per iteration", "iterations", "peak MB", "CPU %", "final cost", "spread"]
    lines = ["| " + " | ".join(head) + " |", "|---|---" + "|--:" * (len(head) - 2) + "|"]
    for row in sorted(rows, key=speed):
        if not row["runs"]:
            cells = [reached(row, TAUS[0]) if row.get("limit_s") else "failed"]
            lines.append(f"| {row['name']} | {row['config']} | " +
                         " | ".join(cells + [""] * (len(head) - 3)) + " |")
            continue
        cells = [row["name"], row["config"]] + [reached(row, t) for t in TAUS]
        cells += [seconds(row["seconds_per_iteration"]), f"{row['iterations']:.0f}",
                  f"{row['peak_bytes'] / 1e6:.0f}", f"{row['cpu_percent']:.0f}",
                  f"{row['final_cost_independent']:.4f}" + ("" if row["agrees"] else " †"),
                  "" if row["spread"] is None else f"{100 * row['spread']:.0f} %"]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def speed(row, tau="0.001"):
    """Sorting key: time to 1e-3, then to looser targets for those that miss it."""
    if not row["runs"]:
        return (2, 0.0)
    value = row["time_to"][tau]
    return (0, value) if value is not None else (1, row["final_cost_independent"])


def strongest(rows, name, tau="1e-06"):
    """The row of solver `name` that is quickest to f*(1 + tau), None when it has none there."""
    rows = [r for r in rows if r["name"] == name and r["runs"] and r["time_to"][tau] is not None]
    return min(rows, key=lambda r: r["time_to"][tau], default=None)


def either(numbers):
    """1, or 1 to 3 of several."""
    return " to ".join(f"{n:g}" for n in dict.fromkeys((min(numbers), max(numbers))))


def machine_text(machine):
    words = [machine["cpu"], f"{machine['cores']} cores"]
    if "double_gflops" in machine:
        simd = "AVX-512" if machine["simd"].startswith("AVX3") else machine["simd"]
        words += [simd, f"{machine['double_gflops']['one']:.0f} Gflop/s double a core",
                  f"{machine['triad_gbytes_s']['all']:.0f} GB/s"]
    return ", ".join(words)
