// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/run_section.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "chart/number_text.h"
#include "chart/plot.h"
#include "options/solve_options.h"
#include "page/html.h"

namespace sheaf {
namespace {

/// A curve of a run: values by step, drawn against steps and against time.
struct Curve {
  std::vector<double> step, time_s, value;
  std::vector<bool> accepted;

  void add(const RunStep& at, double v, bool ok = true) {
    if (!(v > 0) || !std::isfinite(v)) return;
    step.push_back(at.index);
    time_s.push_back(at.time_s);
    value.push_back(v);
    accepted.push_back(ok);
  }
};

Curve costs_of(const RunRecord& run) {
  Curve out;
  for (const RunStep& step : run.steps) out.add(step, step.cost);
  return out;
}

/// Of the state after each step: each step tells that of the state it starts from.
Curve gradients_of(const RunRecord& run) {
  Curve out;
  for (std::size_t k = 0; k + 1 < run.steps.size(); ++k)
    out.add(run.steps[k], run.steps[k + 1].gradient);
  return out;
}

Curve rejected_of(const RunRecord& run) {
  Curve out;
  for (const RunStep& step : run.steps)
    if (!step.accepted) out.add(step, step.trial_cost, false);
  return out;
}

Curve changes_of(const RunRecord& run) {
  Curve out;
  for (std::size_t k = 1; k < run.steps.size(); ++k)
    out.add(run.steps[k], run.steps[k].change, run.steps[k].accepted);
  return out;
}

Curve scales_of(const RunRecord& run) {
  Curve out;
  for (const RunStep& step : run.steps) out.add(step, step.scale_px);
  return out;
}

/// Whether the loss's scale was set anew in the run.
bool changes_scale(const RunRecord& run) {
  for (const RunStep& step : run.steps)
    if (std::isfinite(step.scale_px) && step.scale_px != run.steps.front().scale_px) return true;
  return false;
}

std::string dots(const Plot& plot, const Curve& curve, const std::vector<double>& x) {
  std::string out;
  if (x.size() > 60) return "";
  for (std::size_t k = 0; k < x.size(); ++k)
    out += "<circle cx=\"" + coordinate(plot.x(x[k])) + "\" cy=\"" +
           coordinate(plot.y(curve.value[k])) + "\" r=\"2.6\" class=\"" +
           (curve.accepted[k] ? "ha" : "hr") + "\"><title>step " + tick_text(curve.step[k]) + ", " +
           seconds_text(curve.time_s[k]) + ": " + digits(curve.value[k], 6) + "</title></circle>";
  return out;
}

/// One drawing of a curve; off: single places that stand beside it.
std::string drawing(const Curve& curve, const Curve& off, bool by_time, const std::string& label) {
  std::vector<double> values = curve.value;
  // Costs of refused states may be astronomic: what is off the chart stands on its edge.
  double low = *std::min_element(values.begin(), values.end());
  double high = *std::max_element(values.begin(), values.end());
  const double ceiling = 100 * high;
  for (const double v : off.value) high = std::max(high, std::min(v, ceiling));
  if (!(high > 1.02 * low)) low /= 1.5, high *= 1.5;
  const std::vector<double>& x = by_time ? curve.time_s : curve.step;
  const double end = std::max(x.back(), by_time ? 1e-6 : 1.0);
  const bool in_ms = by_time && end < 1;
  Plot plot({by_time ? std::min(x.front(), 0.9 * end) : 0.0, end},
            {low / 1.3, high * 1.3, 0, 0, true}, {.left = 54, .right = 14});
  std::vector<double> ticks = decade_ticks(low / 1.3, high * 1.3);
  if (ticks.size() < 2) ticks = log_ticks(low / 1.3, high * 1.3);
  if (ticks.size() < 2) ticks = {low, high};
  plot.axis_y(ticks, "", [](double v) {
    return std::abs(std::log10(v) - std::round(std::log10(v))) < 1e-9 ? tick_text(v) : digits(v, 3);
  });
  std::vector<double> along = round_ticks(by_time ? std::min(x.front(), 0.9 * end) : 0, end);
  if (!by_time)
    along.erase(
        std::remove_if(along.begin(), along.end(), [](double t) { return t != std::floor(t); }),
        along.end());
  plot.axis_x(along,
              in_ms     ? "ms"
              : by_time ? "s"
                        : "",
              [&](double t) { return tick_text(in_ms ? 1000 * t : t); });
  plot.line(x, curve.value, "after");
  plot.raw(dots(plot, curve, x));
  Curve held = off;
  for (double& v : held.value) v = std::min(v, ceiling);
  plot.raw(dots(plot, held, by_time ? held.time_s : held.step));
  return plot.svg(label + (by_time ? " against time" : " against steps"));
}

std::string chart(const std::string& title, const std::string& note, const Curve& curve,
                  const Curve& off = {}) {
  if (curve.value.size() < 2) return "";
  std::string body = "<div class=\"by-step\">" + drawing(curve, off, false, title) + "</div>";
  if (curve.time_s.back() > 0)
    body += "<div class=\"by-time\" hidden>" + drawing(curve, off, true, title) + "</div>";
  return figure(title, note, body);
}

std::string megabytes(double bytes) { return with_unit(bytes / 1048576, "MB"); }

std::string facts_of(const RunRecord& run) {
  const auto rejected = std::count_if(run.steps.begin(), run.steps.end(),
                                      [](const RunStep& s) { return !s.accepted; });
  std::string out = fact("Ended", escaped(run.words));
  if (!run.steps.empty())
    out += fact("Steps", grouped(std::int64_t(run.steps.size()) - 1) + ", " +
                             (rejected > 0 ? grouped(rejected) : "none") + " rejected" +
                             (run.recoveries > 0 ? "; " + count_text(std::size_t(run.recoveries),
                                                                     "recovery", "recoveries")
                                                 : ""));
  out += fact("Cost", digits(run.initial_cost, 5) + " → " + digits(run.final_cost, 5) + kThinSpace +
                          run.unit + "²");
  if (!run.loss.empty())
    out += fact("Loss", escaped(run.loss) +
                            (std::isfinite(run.loss_scale_px)
                                 ? ", scale " + with_unit(run.loss_scale_px, run.unit.c_str())
                                 : ""));
  if (!run.solver.empty())
    out += fact("Solver",
                escaped(run.solver + ", " + (run.precision.empty() ? "" : run.precision + ", ") +
                        run.simd + ", ") +
                    count_text(std::size_t(run.threads), "thread", "threads"));
  if (!run.reason.empty()) out += fact("Why", escaped(run.reason));
  if (std::isfinite(run.total_s))
    out += fact("Time", seconds_text(run.total_s) + ": reading " + seconds_text(run.read_s) +
                            ", set-up " + seconds_text(run.setup_s) + ", solving " +
                            seconds_text(run.solve_s) + ", writing " + seconds_text(run.write_s));
  if (std::isfinite(run.peak_bytes))
    out += fact("Memory",
                megabytes(run.peak_bytes) + ", " + megabytes(run.forecast_bytes) + " forecast");
  return "<dl class=\"facts\">" + out + "</dl>";
}

std::string step_table(const RunRecord& run) {
  std::string body;
  for (const RunStep& s : run.steps) {
    const auto after_start = [&](double v, int significant) {
      return s.index == 0 ? std::string("–") : digits(v, significant);
    };
    body += std::string("<tr") + (s.accepted ? "" : " class=\"rej\"") + "><td>" +
            std::to_string(s.index) + "</td><td>" + digits(s.cost, 7) + "</td><td>" +
            digits(s.gradient) + "</td><td>" + after_start(s.change, 3) + "</td><td>" +
            digits(s.damping, 2) + "</td><td>" + after_start(s.gain, 3) + "</td><td>" +
            decimals(1000 * s.time_s, 1) + "</td></tr>";
  }
  return "<details><summary>Every step</summary>" +
         scrolling("Every step",
                   "<table class=\"num\"><thead><tr><th>step</th><th>cost, px²</th>"
                   "<th>gradient, px</th><th>largest relative change</th><th>damping</th>"
                   "<th>gain ratio</th><th>time, ms</th></tr></thead><tbody>" +
                       body + "</tbody></table>") +
         "</details>";
}

/// What options are where nobody sets them, as a run's record has them.
std::map<std::string, std::string> default_texts() {
  std::map<std::string, std::string> out;
  SolveArguments arguments;
  for (const BoundOption& option : options_of(arguments)) {
    const OptionValue value = option.get();
    std::string text = text_of(value);
    if (const auto* real = std::get_if<double>(&value)) text = tick_text(*real);
    if (const auto* number = std::get_if<std::int64_t>(&value)) text = tick_text(double(*number));
    if (const auto* flag = std::get_if<bool>(&value)) text = *flag ? "yes" : "no";
    out[key_of(option.spec)] = text.empty() ? "none" : text;
  }
  return out;
}

}  // namespace

std::string run_words(const RunRecord& run) {
  if (run.steps.empty()) return "";
  std::string out = count_text(run.steps.size() - 1, "step", "steps");
  if (std::isfinite(run.solve_s)) out += " in " + seconds_text(run.solve_s);
  const double times = run.initial_cost / run.final_cost;
  if (std::isfinite(times) && times > 1) out += "; the cost fell " + digits(times) + " times";
  return out + ".";
}

std::string run_section(const RunRecord& run) {
  const std::string cost =
      chart("Cost", "½ Σ r², " + run.unit + "²; hollow: refused", costs_of(run), rejected_of(run));
  const std::string gradient = chart(
      "Gradient", "largest, " + run.unit + ", of the state after each step", gradients_of(run));
  const std::string change = chart("Step", "largest relative change of any block", changes_of(run));
  const std::string scale =
      !changes_scale(run) ? ""
                          : chart("Scale of the loss", run.unit + ", in each step", scales_of(run));
  const std::string switching =
      cost.empty()
          ? ""
          : "<fieldset class=\"seg\" id=\"xaxis\"><legend class=\"vh\">Axis</legend><label><input "
            "type=\"radio\" name=\"x\" value=\"step\" checked><span>against steps</span></label>"
            "<label><input type=\"radio\" name=\"x\" value=\"time\"><span>against time</span>"
            "</label></fieldset>";
  return "<div class=\"grid two\">" + cost + gradient + change + scale + facts_of(run) + "</div>" +
         switching + (run.steps.empty() ? "" : step_table(run));
}

std::string settings_section(const RunRecord& run) {
  const std::map<std::string, std::string> defaults = default_texts();
  std::string options;
  for (const auto& [key, value] : run.options) {
    const auto usual = defaults.find(key);
    const bool same = usual == defaults.end() || usual->second == value;
    std::string name = key;
    std::replace(name.begin(), name.end(), '_', ' ');
    options += std::string("<div") + (same ? " class=\"df\"" : "") + "><dt>" + escaped(name) +
               "</dt><dd>" + escaped(value) + "</dd></div>";
  }
  std::string out;
  if (!run.command.empty()) out += "<p class=\"cmd\"><code>" + escaped(run.command) + "</code></p>";
  if (!options.empty()) out += "<dl class=\"opts\">" + options + "</dl>";
  std::string made;
  if (!run.version.empty()) made += fact("Sheaf", escaped(run.version));
  if (!run.path.empty())
    made += fact("Input",
                 "<code>" + escaped(run.path) + "</code>, " + escaped(run.format) +
                     (std::isfinite(run.bytes) ? ", " + with_unit(run.bytes / 1e6, "MB") : ""));
  if (!run.sha256.empty())
    made += fact("SHA-256", "<code class=\"hash\">" + escaped(run.sha256) + "</code>");
  return out + (made.empty() ? "" : "<dl class=\"prov\">" + made + "</dl>");
}

}  // namespace sheaf
