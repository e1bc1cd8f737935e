// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/survey_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "chart/axis.h"
#include "chart/number_text.h"
#include "chart/plot.h"
#include "page/html.h"

namespace sheaf {
namespace {

constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"}, kGeodetic = {"east", "north", "up"};

/// Residuals of one kind, as the page calls it.
struct Kind {
  const char *one, *many;
  const std::vector<RunSurveyResidual>* list;
  const std::array<double, 3>* rmse;
};

std::array<Kind, 3> kinds(const RunSurvey& s) {
  return {Kind{"control point", "control points", &s.control, &s.control_rmse},
          Kind{"check point", "check points", &s.check, &s.check_rmse},
          Kind{"position", "positions", &s.positions, &s.positions_rmse}};
}

const std::array<const char*, 3>& axes_of(const RunSurvey& survey) {
  return survey.world.kind == WorldKind::geodetic ? kGeodetic : kAxes;
}

/// Where something is on the map: along the first two axes of the local frame.
std::array<double, 2> place(const RunSurvey& survey, const RunSurveyResidual& r) {
  const std::array<double, 3> at = to_local(survey.world, r.adjusted);
  return {at[0], at[1]};
}

bool is_geodetic(const RunSurvey& survey) { return survey.world.kind == WorldKind::geodetic; }

std::string mark(const std::string& kind, double x, double y, bool off) {
  const std::string classes = off ? "look" : "after";
  if (kind == "position")
    return "<circle cx=\"" + coordinate(x) + "\" cy=\"" + coordinate(y) +
           "\" r=\"1.8\" class=\"hb2\"/>";
  const std::string d = kind == "check point"
                            ? "M" + coordinate(x) + " " + coordinate(y - 4.5) + "l4 7h-8z"
                            : "M" + coordinate(x - 3.5) + " " + coordinate(y - 3.5) + "h7v7h-7z";
  return "<path d=\"" + d + "\" class=\"" + classes + "\"/>";
}

struct MapFrame {
  double low_x = 0, low_y = 0, scale = 1, width = 0, height = 0;
};

MapFrame map_frame(const RunSurvey& survey) {
  double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
  for (const Kind& kind : kinds(survey))
    for (const RunSurveyResidual& r : *kind.list) {
      const auto at = place(survey, r);
      for (int k = 0; k < 2; ++k)
        low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k]);
    }
  const double wide = std::max(high[0] - low[0], 1e-9), tall = std::max(high[1] - low[1], 1e-9);
  MapFrame frame;
  frame.scale = std::min(640 / wide, 360 / tall);
  frame.width = wide * frame.scale + 80;
  frame.height = tall * frame.scale + 80;
  frame.low_x = low[0];
  frame.low_y = low[1];
  return frame;
}

std::string map_chart(const RunSurvey& survey) {
  const MapFrame frame = map_frame(survey);
  std::vector<double> sizes;
  for (const Kind& kind : kinds(survey))
    for (const RunSurveyResidual& r : *kind.list)
      sizes.push_back(std::sqrt(r.residual[0] * r.residual[0] + r.residual[1] * r.residual[1]));
  std::sort(sizes.begin(), sizes.end());
  const double typical = sizes.empty() ? 0 : sizes[(sizes.size() - 1) * 9 / 10];
  const double enlarged = typical > 0 ? round_below(36 / (typical * frame.scale)) : 1;
  Drawing out;
  for (const Kind& kind : kinds(survey))
    for (const RunSurveyResidual& r : *kind.list) {
      const auto at = place(survey, r);
      const double x = 40 + (at[0] - frame.low_x) * frame.scale;
      const double y = frame.height - 40 - (at[1] - frame.low_y) * frame.scale;
      const double by = frame.scale * enlarged;
      double dx = r.residual[0] * by, dy = -r.residual[1] * by;
      const double length = std::sqrt(dx * dx + dy * dy);
      if (length > 160) dx *= 160 / length, dy *= 160 / length;
      out.path(
          "M" + coordinate(x) + " " + coordinate(y) + "l" + coordinate(dx) + " " + coordinate(dy),
          r.blunder                             ? "vs"
          : std::string(kind.one) == "position" ? "vn"
                                                : "vk");
      out.raw(mark(kind.one, x, y, r.blunder));
      if (std::string(kind.one) != "position" || r.blunder)
        out.text(x + 7, y - 6, r.name, r.blunder ? "t at" : "t");
    }
  const double bar = round_below(120 / frame.scale);
  out.path("M0 " + coordinate(frame.height + 10) + "v4h" + coordinate(bar * frame.scale) + "v-4",
           "ax");
  out.text(bar * frame.scale + 7, frame.height + 15,
           tick_text(bar) + kThinSpace + (is_geodetic(survey) ? "m" : "units"), "a");
  out.path("M" + coordinate(frame.width - 8) + " 26V4m-3.5 6l3.5-6l3.5 6", "ax");
  out.text(frame.width - 8, 40, is_geodetic(survey) ? "N" : "y", "a", Anchor::middle);
  return figure("Map",
                "residuals " + digits(enlarged, 2) +
                    " times enlarged; ▢ control, △ check, ○ positions of images; accent: larger "
                    "than its sigma allows",
                out.svg(frame.width, frame.height + 20, "Map of the survey with residuals"),
                "wide");
}

/// Residuals along each axis in sigmas, on one scale for all kinds.
std::string axis_chart(const RunSurvey& survey) {
  double most = 3.5;
  for (const Kind& kind : kinds(survey))
    for (const RunSurveyResidual& r : *kind.list)
      for (std::size_t k = 0; k < 3; ++k)
        if (r.sigma[k] > 0) most = std::max(most, std::abs(r.residual[k] / r.sigma[k]));
  most = std::min(1.05 * most, 12.0);
  Plot plot({-most, most}, {0, 1}, {.height = 210, .left = 84});
  plot.raw("<rect x=\"" + coordinate(plot.x(-1)) + "\" y=\"12\" width=\"" +
           coordinate(plot.x(1) - plot.x(-1)) + "\" height=\"164\" class=\"fill\"/>");
  plot.axis_x(round_ticks(-most, most, 6), "σ");
  plot.path("M" + coordinate(plot.x(0)) + " 12V176", "gr");
  double y = 24;
  for (const Kind& kind : kinds(survey)) {
    if (kind.list->empty()) continue;
    for (std::size_t k = 0; k < 3; ++k, y += 17) {
      if (k == 0)
        plot.text(0, y + 4, std::string(kind.one).substr(0, std::string(kind.one).find(' ')),
                  "t b");
      plot.text(plot.left() - 6, y + 4, axes_of(survey)[k], "a", Anchor::end);
      for (const RunSurveyResidual& r : *kind.list) {
        if (!(r.sigma[k] > 0)) continue;
        const double t = r.residual[k] / r.sigma[k];
        const std::string x = coordinate(plot.x(std::clamp(t, -most, most)));
        plot.path("M" + x + " " + coordinate(y - 5) + "v10", std::abs(t) > 3.29 ? "vs" : "vk");
      }
    }
    y += 4;
  }
  return figure("Residuals in sigmas",
                "a stroke for each, along each axis; shaded: within one sigma as stated",
                plot.svg("Residuals of the survey in sigmas"));
}

std::string table_of(const RunSurvey& survey, const Kind& kind) {
  constexpr std::size_t kMost = 20;
  if (kind.list->empty()) return "";
  std::string body, head;
  for (std::size_t k = 0; k < 3; ++k) head += std::string("<th>") + axes_of(survey)[k] + "</th>";
  for (std::size_t i = 0; i < std::min(kMost, kind.list->size()); ++i) {
    const RunSurveyResidual& r = (*kind.list)[i];
    body += std::string("<tr") + (r.blunder ? " class=\"bad\"" : "") + "><th scope=\"row\">" +
            escaped(r.name) + "</th>";
    for (std::size_t k = 0; k < 3; ++k) body += "<td>" + digits(r.residual[k], 3) + "</td>";
    for (std::size_t k = 0; k < 3; ++k)
      body += "<td class=\"bfc\">" + (r.sigma[k] > 0 ? digits(r.sigma[k], 2) : "–") + "</td>";
    body += "<td>" + digits(r.worst_sigmas, 2) + "</td></tr>";
  }
  std::string rmse = "<tr><th scope=\"row\">rms</th>";
  for (const double v : *kind.rmse) rmse += "<td><b>" + digits(v, 3) + "</b></td>";
  rmse += "<td colspan=\"4\"></td></tr>";
  const std::string caption =
      count_text(kind.list->size(), kind.one, kind.many) +
      (kind.list->size() > kMost ? ", the worst " + std::to_string(kMost) : "") +
      "; adjusted less stated, units of the frame";
  return "<table class=\"num\"><caption>" + caption + "</caption><thead><tr><th rowspan=\"2\">" +
         kind.one +
         "</th><th colspan=\"3\">residual</th><th colspan=\"3\">σ as stated</th><th "
         "rowspan=\"2\">worst, "
         "σ</th></tr><tr>" +
         head + head + "</tr></thead><tbody>" + rmse + body + "</tbody></table>";
}

}  // namespace

std::string survey_words(const RunSurvey& survey) {
  std::string out;
  for (const Kind& kind : kinds(survey)) {
    if (kind.list->empty()) continue;
    double sum = 0;
    for (const double v : *kind.rmse) sum += v * v;
    out += (out.empty() ? "" : " ") + count_text(kind.list->size(), kind.one, kind.many) +
           ", rms " + digits(std::sqrt(sum)) + ".";
  }
  return out + (survey.frame.empty() ? "" : " Frame: " + escaped(survey.frame) + ".");
}

std::string survey_section(const RunSurvey& survey) {
  std::string tables;
  std::size_t residuals = 0;
  for (const Kind& kind : kinds(survey)) {
    tables += table_of(survey, kind);
    residuals += kind.list->size();
  }
  if (residuals == 0) return "";
  return "<div class=\"grid survey\">" + map_chart(survey) + axis_chart(survey) + "</div>" +
         scrolling("Residuals of the survey", "<div class=\"lenses\">" + tables + "</div>");
}

}  // namespace sheaf
