// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "constraints_option.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "outputs.h"

namespace sheaf {
namespace {

constexpr std::size_t kMostShown = 10;

const char* name_of(WorldKind kind) {
  return kind == WorldKind::local       ? "local"
         : kind == WorldKind::projected ? "projected"
                                        : "geodetic";
}

std::string frame_text(const WorldFrame& frame) {
  std::string out = name_of(frame.kind);
  if (!frame.name.empty()) out += " " + frame.name;
  if (!frame.origin) return out;
  const std::array<double, 3>& o = *frame.origin;
  if (frame.kind == WorldKind::geodetic)
    return out + fmt::format(", east, north and up of {} {} {}", o[0], o[1], o[2]);
  return out + fmt::format(", less {} {} {}", o[0], o[1], o[2]);
}

std::string three_text(const std::array<double, 3>& v) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g})", v[0], v[1], v[2]);
}

std::size_t used(const std::vector<std::uint32_t>& list) {
  return static_cast<std::size_t>(
      std::count_if(list.begin(), list.end(), [](auto i) { return i != Survey::kNone; }));
}

Json three_json(const std::array<double, 3>& v) {
  return {number(v[0]), number(v[1]), number(v[2])};
}

void add_list(const char* kind, const std::vector<SurveyResidual>& list,
              const std::array<double, 3>& rmse, std::string& out) {
  if (list.empty()) return;
  out += fmt::format("{:<11} {}, rmse {}\n", kind, list.size(), three_text(rmse));
  const std::size_t shown = std::min<std::size_t>(list.size(), 3);
  for (std::size_t i = 0; i < shown; ++i)
    out += fmt::format("            {}: off by {}, {:.3g} sigmas at most\n", list[i].name,
                       three_text(list[i].residual), list[i].worst_sigmas);
}

void add_blunders(const char* what, const std::vector<SurveyResidual>& list, std::string& out) {
  std::size_t shown = 0;
  const auto all = std::count_if(list.begin(), list.end(), [](const auto& r) { return r.blunder; });
  for (const SurveyResidual& r : list)
    if (r.blunder && shown++ < kMostShown)
      out += fmt::format("blunder     {} {} by {:.3g} sigmas, where {} are 1 in 1000\n", what,
                         r.name, r.worst_sigmas, kBlunderSigmas);
  if (static_cast<std::size_t>(all) > kMostShown)
    out += fmt::format("            and {} more\n", static_cast<std::size_t>(all) - kMostShown);
}

Json residuals_json(const std::vector<SurveyResidual>& list) {
  Json out = Json::array();
  for (const SurveyResidual& r : list) {
    Json marks = Json::array();
    for (const MarkResidual& mark : r.marks)
      marks.push_back({{"image", mark.image},
                       {"residual_px", {number(mark.residual_px[0]), number(mark.residual_px[1])}},
                       {"sigma_px", mark.sigma_px}});
    out.push_back({{"name", r.name},
                   {"residual", three_json(r.residual)},
                   {"sigma", three_json(r.sigma)},
                   {"adjusted", three_json(r.adjusted)},
                   {"worst_sigmas", number(r.worst_sigmas)},
                   {"blunder", r.blunder},
                   {"marks", marks}});
  }
  return out;
}

Json report_json(const SurveyReport& report) {
  Json distances = Json::array();
  for (const DistanceResidual& d : report.distances)
    distances.push_back({{"first", d.first},
                         {"second", d.second},
                         {"residual", number(d.residual)},
                         {"sigma", d.sigma},
                         {"blunder", d.blunder}});
  return {{"positions_rmse", three_json(report.positions_rmse)},
          {"control_rmse", three_json(report.control_rmse)},
          {"check_rmse", three_json(report.check_rmse)},
          {"positions", residuals_json(report.positions)},
          {"control", residuals_json(report.control)},
          {"check", residuals_json(report.check)},
          {"distances", distances}};
}

}  // namespace

std::vector<BoundOption> options_of(ConstraintsArguments& arguments, bool adjusts) {
  using F = FieldsOf<ConstraintsArguments>;
  std::vector<OptionField<ConstraintsArguments>> fields = {
      F::list(&ConstraintsArguments::paths,
              {.name = "constraints",
               .placeholder = "FILE",
               .help = "positions of images, control and check points, scale bars: survey.json, "
                       "gcp_list.txt, geo.txt, ground_control_points.json, a CSV, a database of "
                       "COLMAP or a folder of images with GPS tags; may be given several times "
                       "(docs/constraints.md)"})};
  if (adjusts)
    fields.push_back(F::text(&ConstraintsArguments::residuals,
                             {.name = "residuals",
                              .placeholder = "FILE",
                              .help = "write what is left of --constraints as CSV"}));
  return bound<ConstraintsArguments>(fields, arguments);
}

std::vector<std::string> with_survey(std::vector<std::string> inputs,
                                     const ConstraintsArguments& arguments) {
  inputs.insert(inputs.end(), arguments.paths.begin(), arguments.paths.end());
  return inputs;
}

Constraints read_constraints(const ConstraintsArguments& arguments) {
  return read_constraints(
             std::vector<std::filesystem::path>(arguments.paths.begin(), arguments.paths.end()))
      .value();
}

std::optional<Survey> place_survey(const ConstraintsArguments& arguments, Problem& problem,
                                   const Fixed& fixed) {
  if (arguments.paths.empty()) {
    if (!arguments.residuals.empty())
      throw Error(ErrorCode::usage, "--residuals is for --constraints");
    return {};
  }
  return place_survey(problem, read_constraints(arguments), fixed).value();
}

std::string survey_text(const Survey& survey) {
  const Constraints& c = survey.constraints;
  std::size_t counts[3] = {0, 0, 0};
  for (const SurveyPoint& point : c.points) ++counts[static_cast<std::size_t>(point.role)];
  std::string out = fmt::format(
      "survey      {}: {} of {} positions used, {} control, {} check and {} tie points, {} scale "
      "bars\n            frame {}\n",
      fmt::join(c.paths, ", "), used(survey.position_image), c.positions.size(), counts[0],
      counts[1], counts[2], c.scale_bars.size(), frame_text(survey.frame));
  for (const std::string& words : survey.words) out += fmt::format("            {}\n", words);
  for (const std::string& words : c.notes) out += fmt::format("            {}\n", words);
  for (std::size_t i = 0; i < std::min(survey.unused.size(), kMostShown); ++i)
    out += fmt::format("not used    {}\n", survey.unused[i]);
  if (survey.unused.size() > kMostShown)
    out += fmt::format("            and {} more\n", survey.unused.size() - kMostShown);
  for (std::size_t i = 0; i < std::min(survey.outliers.size(), kMostShown); ++i)
    out +=
        fmt::format("outlier     {} is {:.4g} off after the motion, {:.3g} sigmas (above {:.3g})\n",
                    survey.outliers[i].name, survey.outliers[i].distance, survey.outliers[i].sigmas,
                    survey.threshold_sigmas);
  if (survey.outliers.size() > kMostShown)
    out += fmt::format("            and {} more\n", survey.outliers.size() - kMostShown);
  return out;
}

std::string residuals_text(const SurveyReport& report) {
  std::string out;
  add_list("positions", report.positions, report.positions_rmse, out);
  add_list("control", report.control, report.control_rmse, out);
  add_list("check", report.check, report.check_rmse, out);
  for (const DistanceResidual& d : report.distances)
    out += fmt::format("distance    {} to {}: off by {:.4g}, sigma {:.4g}\n", d.first, d.second,
                       d.residual, d.sigma);
  add_blunders("the position of", report.positions, out);
  add_blunders("control point", report.control, out);
  add_blunders("check point", report.check, out);
  return out;
}

Json frame_json(const Survey& survey) {
  const WorldFrame& frame = survey.frame;
  return {{"kind", name_of(frame.kind)},
          {"name", frame.name},
          {"origin", frame.origin ? three_json(*frame.origin) : Json()}};
}

std::string write_frame(const Survey& survey, const std::string& format, const std::string& model) {
  if (!format.starts_with("colmap")) return "";
  std::string path = (std::filesystem::path(model) / "frame.json").string();
  write_json(frame_json(survey), path);
  return path;
}

void write_residuals(const SurveyReport& report, const std::string& path) {
  write_text(residuals_csv(report), path);
}

Json survey_json(const std::optional<Survey>& survey, const SurveyReport* report) {
  if (!survey) return {};
  Json outliers = Json::array();
  for (const SurveyOutlier& o : survey->outliers)
    outliers.push_back(
        {{"name", o.name}, {"distance", number(o.distance)}, {"sigmas", number(o.sigmas)}});
  return {{"paths", survey->constraints.paths},
          {"frame", frame_json(*survey)},
          {"positions", used(survey->position_image)},
          {"moved", survey->moved},
          {"rigid", survey->rigid},
          {"scale", number(survey->scale)},
          {"threshold_sigmas", number(survey->threshold_sigmas)},
          {"outliers", outliers},
          {"words", survey->words},
          {"not_used", survey->unused},
          {"residuals", report == nullptr ? Json() : report_json(*report)}};
}

}  // namespace sheaf
