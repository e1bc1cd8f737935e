# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""The ladder's results as Markdown and plots (suite.py)."""
import math
import os
import statistics

import cost_plot
import run_table
import side_by_side

BEGIN, END = "<!-- suite:begin -->", "<!-- suite:end -->"
TARGETS = (1e-2, 1e-3)  # of the tables and profiles
SOLVERS = ("dense", "sparse", "explicit", "implicit")  # what `auto` chooses from
WITHOUT_K2 = "-k2zero"


def table(head, rows, left=1):
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * left + "--:|" * (len(head) - left)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def full(results):
    return [d for d in results["problems"] if not d["problem"].endswith(WITHOUT_K2)]


def auto(document):
    """Our row: what a user gets without choosing."""
    rows = [r for r in document["summary"] if r["name"] == "sheaf" and
            r["config"].split("-")[0] == "auto"]
    return rows[0] if rows else None


def at(row, tau):
    """Seconds to f* (1 + tau), infinite for a miss."""
    value = row and row.get("time_to", {}).get(f"{tau:g}")
    return math.inf if value is None else value


def peers(documents):
    return list(dict.fromkeys(r["name"] for d in documents for r in d["summary"]
                              if r["name"] != "sheaf"))


def best(document, name, tau):
    """The peer's quickest configuration to f* (1 + tau), else the one that came lowest; None when it
    did not run."""
    rows = [r for r in document["summary"] if r["name"] == name]
    return min(rows, key=lambda r: (at(r, tau), r.get("final_cost_independent", math.inf)),
               default=None)


def ratio(value, ours):
    return f"**{value / ours:.1f}**" if math.isfinite(value) and math.isfinite(ours) else ""


def at_least(row, ours):
    """What is known of the ratio of a run that the time limit ended."""
    limit = row.get("limit_s")
    return f"> {limit / ours:.1f}" if limit and limit > ours else ""


def problem_table(results):
    rows = []
    for d in {d["problem"]: d for d in results["problems"]}.values():
        counts = [f"{d['header'][k]}" for k in ("cameras", "points", "observations")]
        kind = "synthetic" if d["synthetic"] else "real"
        same = [e for e in results["problems"] if e["problem"] == d["problem"]]
        limits = dict.fromkeys(f"{e['time_limit_s']:g}" for e in same)  # with fewer threads first
        rows.append([d["problem"], kind, *counts,
                     f"{min(e['best_cost'] for e in same):.6g}{run_table.mark(d)}",
                     ", ".join(limits), str(d["turns"])])
    return table(["problem", "kind", "cameras", "points", "observations", "f*",
                  "limit, s", "runs"], rows, 2)


def speed_table(documents, tau):
    """Ours against the best configuration of each peer."""
    names = peers(documents)
    head = ["problem", "threads", "sheaf auto, s"] + [w for n in names for w in (n + ", s", "ratio")]
    rows = []
    for d in documents:
        ours = auto(d)
        cells = [d["problem"], str(d["threads"]), run_table.reached(ours, tau) if ours else ""]
        for name in names:
            row = best(d, name, tau)
            cells += ["", ""] if row is None else [
                run_table.reached(row, tau) if row["runs"] or row.get("limit_s") else "failed",
                ratio(at(row, tau), at(ours, tau)) or at_least(row, at(ours, tau))]
        rows.append(cells)
    return table(head, rows)


def choice_table(documents, tau):
    """`auto` against each explicit choice: its time, and that of the same solver when asked for by
    name, over the quickest."""
    rows = []
    for d in documents:
        mine = {r["config"]: r for r in d["summary"] if r["name"] == "sheaf"}
        explicit = [at(mine.get(c), tau) for c in SOLVERS]
        if "auto" not in mine or not any(map(math.isfinite, explicit)):
            continue
        taken = own(d).get("solver", {}).get("name", "")
        twin = mine.get(taken.removeprefix("iterative-"))
        losses = [at(row, tau) / min(explicit) if row else math.nan for row in (mine["auto"], twin)]
        rows.append([d["problem"], str(d["threads"]), taken,
                     run_table.reached(mine["auto"], tau)] +
                    [run_table.reached(mine[c], tau) if c in mine else "" for c in SOLVERS] +
                    ["" if math.isnan(loss) else f"{loss:.2f}" if math.isfinite(loss) else "miss"
                     for loss in losses])
    return table(["problem", "threads", "auto takes", "auto, s"] +
                 [c + ", s" for c in SOLVERS] + ["auto / best", "what it takes / best"], rows)


def own(document):
    """What our `auto` said of itself in its last good run."""
    row = auto(document)
    said = [r["sheaf"] for r in document["runs"] if row and "sheaf" in r and
            r["config"] == row["config"]]
    return said[-1] if said else {}


def memory_table(documents):
    """Peak MB; of each peer that of its quickest configuration."""
    names = peers(documents)
    rows = []
    for d in largest_threads(documents):
        ours, said = auto(d), own(d)
        if not ours or not ours["runs"]:
            continue
        cells = [d["problem"], f"{ours['peak_bytes'] / 1e6:.0f}",
                 f"{said['forecast_bytes'] / ours['peak_bytes']:.2f}" if said else ""]
        for name in names:
            row = best(d, name, 1e-3)
            cells.append(f"{row['peak_bytes'] / 1e6:.0f}" if row and row["runs"] else "")
        rows.append(cells)
    return table(["problem", "sheaf auto, MB", "forecast / peak"] + [n + ", MB" for n in names],
                 rows)


def largest_threads(documents):
    last = {}
    for d in documents:
        if d["problem"] not in last or d["threads"] > last[d["problem"]]["threads"]:
            last[d["problem"]] = d
    return list(last.values())


def end_table(documents):
    """Why each of our runs stopped, and how much work its steps were."""
    rows = []
    for d in largest_threads(documents):
        ours, said = auto(d), own(d)
        if not said:
            continue
        steps = [n for n in said["linear_iterations"] if n]
        first, last = said["gradient"]
        gap = ours["final_cost_independent"] / d["best_cost"] - 1
        rows.append([d["problem"], said["termination"]["code"], said["precision"],
                     f"{ours['iterations']:.0f}", f"{sum(steps) / len(steps):.0f}" if steps else "",
                     f"{max(steps)}" if steps else "", f"{first:.1e}", f"{last:.1e}", f"{gap:.1e}"])
    return table(["problem", "stopped by", "precision", "steps", "CG a step", "most CG",
                  "gradient, start", "end", "above f*"], rows, 3)


def profile(documents, tau):
    """Dolan and Moré: for each solver the share of problems it solves within r times the quickest's
    time. {name: [r of each problem]}, infinite where it misses. A problem that nobody solves counts
    for nobody."""
    ratios = {}
    for d in documents:
        times = {"sheaf auto": at(auto(d), tau)}
        times.update({n: at(best(d, n, tau), tau) for n in peers(documents)})
        quickest = min(times.values())
        for name, time in times.items():
            ratios.setdefault(name, []).append(
                time / quickest if math.isfinite(quickest) else math.inf)
    return ratios


def profile_plot(documents, tau):
    ratios = {n: sorted(r) for n, r in profile(documents, tau).items()}
    furthest = max((r for rs in ratios.values() for r in rs if math.isfinite(r)), default=1)
    end = max(10.0, furthest * 1.3)
    x = cost_plot.Axis(0.93, end, cost_plot.LEFT, cost_plot.WIDTH - cost_plot.RIGHT)
    y = cost_plot.LinearAxis(1.0, cost_plot.HEIGHT - cost_plot.BOTTOM, cost_plot.TOP)
    curves = []
    for name, rs in ratios.items():
        share, places = 0.0, []
        for r in filter(math.isfinite, rs):
            places += [(x(r), y(share)), (x(r), y(share + 1 / len(rs)))]
            share += 1 / len(rs)
        curves.append((name, places + [(x(end), y(share))] if places else [(x(end), y(0))]))
    curves.sort(key=lambda c: c[0] != "sheaf auto")
    return cost_plot.chart(f"Share of the ladder solved to {tau:g}", x, y,
                           ("time / quickest solver's time", "share of problems"), curves)


PLOTTED = 1e-4


def growth(documents):
    """{label: [(observations, seconds a step)]}: our `auto`, over the whole run and on the way to
    PLOTTED alone, and each peer's quickest configuration."""
    lines = {}
    for d in documents:
        rows = [("sheaf auto", auto(d))] + [(n, best(d, n, 1e-3)) for n in peers(documents)]
        for name, row in rows:
            if row and row["runs"] and row["seconds_per_iteration"] > 0:
                lines.setdefault(f"{name}, {d['threads']} thr.", []).append(
                    (d["header"]["observations"], row["seconds_per_iteration"]))
        step = step_on_the_way(d, PLOTTED)
        if step > 0:
            lines.setdefault(f"sheaf to {PLOTTED:g}, {d['threads']} thr.", []).append(
                (d["header"]["observations"], step))
    return {label: sorted(points) for label, points in lines.items()}


def growth_plot(documents):
    most = max(d["threads"] for d in documents)
    lines = {l: p for l, p in growth(documents).items() if l.endswith(f", {most} thr.")}
    points = [p for line in lines.values() for p in line]
    if not points:
        return None
    lines = dict(list(lines.items())[:len(cost_plot.COLOURS) - 1])
    low, high = min(n for n, _ in points), max(n for n, _ in points)
    rate = min(s / n for n, s in points)
    lines["in proportion"] = [(low, rate * low), (high, rate * high)]
    seconds = [s for line in lines.values() for _, s in line]
    x = cost_plot.Axis(low / 1.2, high * 1.2, cost_plot.LEFT, cost_plot.WIDTH - cost_plot.RIGHT)
    y = cost_plot.Axis(min(seconds) / 1.3, max(seconds) * 1.3,
                       cost_plot.HEIGHT - cost_plot.BOTTOM, cost_plot.TOP)
    return cost_plot.chart("Time of one step", x, y, ("observations", "seconds a step"),
                           [(label, [(x(n), y(s)) for n, s in line])
                            for label, line in lines.items()])


def step_on_the_way(document, tau):
    """Seconds a step of `auto`, set-up left out, until its cost is within tau of the best: median of
    its runs. Steps beyond take more inner iterations, and how many there are depends on the time
    limit."""
    means = []
    for run in document["runs"]:
        if run.get("failed") or (run["name"], run["config"]) != ("sheaf", "auto"):
            continue
        trace, target = run["trace"], document["best_cost"] * (1 + tau)
        last = next((i for i, (_, cost) in enumerate(trace) if cost <= target), len(trace) - 1)
        if last > 0:
            means.append((trace[last][0] - run["setup_s"]) / last)
    return statistics.median(means) if means else math.nan


def growth_table(documents):
    """Ours only: nanoseconds of a step per observation, inner iterations included."""
    rows = []
    for d in documents:
        ours = auto(d)
        if ours and ours["runs"]:
            n, s = d["header"]["observations"], ours["seconds_per_iteration"]
            rows.append([d["problem"], str(d["threads"]), str(n), run_table.seconds(s)] +
                        [f"{1e9 * x / n:.0f}" for x in
                         (s, step_on_the_way(d, 1e-3), step_on_the_way(d, 1e-4))])
    return table(["problem", "threads", "observations", "seconds a step", "ns an observation",
                  "steps to 1e-3 alone", "to 1e-4"], rows)


def plots(results):
    """{file name: SVG}"""
    documents = full(results)
    named = {f"suite-profile-{tau:g}.svg": profile_plot(documents, tau) for tau in TARGETS}
    named["suite-growth.svg"] = growth_plot(documents)
    for d in results["problems"]:
        shown = [r for r in d["summary"] if r["name"] != "sheaf" or r is auto(d)]
        curves = side_by_side.curves({**d, "summary": shown})
        if curves:
            named[side_by_side.plot_name(d)] = cost_plot.draw(side_by_side.title(d), curves,
                                                              d["best_cost"])
    return {name: svg for name, svg in named.items() if svg}


def details(document, folder):
    counts = ", ".join(f"{n} {what}" for what, n in document["header"].items())
    missing = document.get("missing")
    failed = [f"{r['name']}:{r['config']}: {r['message']}" for r in document["summary"]
              if not r["runs"]]
    return "\n".join([
        f"<details><summary>{side_by_side.title(document)}</summary>\n",
        f"{counts}; f* = {document['best_cost']:.6f}{run_table.mark(document)}; at most {document['time_limit_s']:g} s a run."
        + (f" Not on this machine: {', '.join(missing)}." if missing else "") + "\n",
        run_table.markdown(document["summary"]),
        *([f"Failed: {'; '.join(failed)}.\n"] if failed else []),
        f"![cost against time]({folder}/{side_by_side.plot_name(document)})\n", "</details>\n"])


def markdown(results, folder):
    """The section for BENCHMARKS.md; `folder` is where its plots lie, seen from there."""
    documents = full(results)
    small = [d for d in results["problems"] if d["problem"].endswith(WITHOUT_K2)]
    out = ["## The ladder\n",
           f"Written by `bench/suite.py`, {results['date']}; medians of interleaved runs in fresh "
           "processes, as many as the table says; the rules of [bench/README.md](bench/README.md). "
           "\"Synthetic\" problems are our own scenes of the size and kind of the published problem "
           "of that name (`sheaf generate --like`), not that problem. f* is the best cost among a "
           "problem's rows; where none of them converged (\"How our runs end\") it is where the best "
           "one stood. \"miss\": the solver ended before the target, by itself or after its 50 "
           "steps; \"> 9\": the limit of 9 s ended it (each problem's limits, where they differ "
           "first that of one thread, stand in the table). A ratio behind \">\" is a cut-off, not a "
           "measurement: the limit over our time, which the true one is above. Each peer stands "
           "with its quickest configuration for each problem, sheaf with what `auto` chose. "
           f"Machine: {run_table.machine_text(results['machine'])}.\n",
           problem_table(results)]
    out += [text for text in (run_table.footnote(results["problems"]),) if text]
    for tau in TARGETS:
        out += [f"### Seconds to within {tau:g} of f*\n", speed_table(documents, tau),
                f"![performance profile]({folder}/suite-profile-{tau:g}.svg)\n"]
    if small:
        out += ["### Against multicore PBA, k2 = 0\n",
                "PBA's camera is smaller (f and k1) and its arithmetic is float: sheaf solves the "
                "same problem with `--fix k2`. PBA's costs are its own figures in float, read as "
                "far as they agree with its final state.\n"]
        for tau in (1e-1, 1e-2, 1e-3):
            out += [f"To {tau:g}:\n", speed_table(small, tau)]
    out += ["### `auto` against each explicit choice, to 0.001\n", choice_table(documents, 1e-3),
            "`auto` and the solver it takes run the same instructions. Where their times differ it is "
            "the machine: a virtual one may hand memory that was free for seconds out slowly (measured: "
            "0.1 to 0.4 s for 245 MB), which meets the first of our runs after a peer's.\n",
            "### Peak memory, all threads\n", memory_table(documents),
            "### How our runs end\n", end_table(documents),
            "### Growth of a step\n", growth_table(documents),
            f"![time of one step]({folder}/suite-growth.svg)\n", "### Each problem\n"]
    return "\n".join(out + [details(d, folder) for d in results["problems"]])


def put(path, section):
    """The section into a page, in place of the one there or at its end."""
    text = ""
    if os.path.exists(path):
        with open(path) as file:
            text = file.read()
    with open(path, "w") as file:
        file.write(without(text) + BEGIN + "\n" + section + END + "\n")


def cut(page):
    """The section a page holds, with its markers, or nothing."""
    if BEGIN not in page or END not in page:
        return ""
    return page[page.index(BEGIN):page.index(END) + len(END)] + "\n"


def without(page):
    return page.replace(cut(page), "").rstrip("\n") + "\n\n" if page else ""
