// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <charconv>
#include <cmath>

#include "io/csv_field.h"
#include "sheaf/survey.h"

namespace sheaf {
namespace {

std::string shortest(double x) {
  char buffer[40];
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr);
}

void add_lines(const char* kind, const std::vector<SurveyResidual>& list, std::string& out) {
  for (const SurveyResidual& r : list) {
    out += kind + ("," + csv_field(r.name)) + ",";
    for (const auto& three : {r.residual, r.sigma, r.adjusted})
      for (const double x : three) out += "," + shortest(x);
    out += ",,,," + shortest(r.worst_sigmas) + (r.blunder ? ",1\n" : ",0\n");
    for (const MarkResidual& mark : r.marks)
      out += std::string(kind) + "-mark," + csv_field(r.name) + "," + csv_field(mark.image) +
             std::string(10, ',') + shortest(mark.residual_px[0]) + "," +
             shortest(mark.residual_px[1]) + "," + shortest(mark.sigma_px) + ",,\n";
  }
}

}  // namespace

std::string residuals_csv(const SurveyReport& report) {
  std::string out =
      "kind,name,image,residual_x,residual_y,residual_z,sigma_x,sigma_y,sigma_z,adjusted_x,"
      "adjusted_y,adjusted_z,residual_x_px,residual_y_px,sigma_px,worst_sigmas,blunder\n";
  add_lines("position", report.positions, out);
  add_lines("control", report.control, out);
  add_lines("check", report.check, out);
  for (const DistanceResidual& d : report.distances)
    out += "distance," + csv_field(d.first + " to " + d.second) + ",," + shortest(d.residual) +
           ",,," + shortest(d.sigma) + std::string(9, ',') +
           shortest(std::abs(d.residual) / d.sigma) + (d.blunder ? ",1\n" : ",0\n");
  return out;
}

}  // namespace sheaf
