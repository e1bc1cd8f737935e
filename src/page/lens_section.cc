// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/lens_section.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "chart/number_text.h"
#include "chart/plot.h"
#include "geometry/camera_model.h"
#include "page/html.h"
#include "page/projection_map.h"
#include "scene/scene_lenses.h"

namespace sheaf {
namespace {

constexpr std::size_t kFewLenses = 4, kCurves = 48, kRows = 16, kMostRows = 400;

/// A lens that something was measured through.
struct LensUse {
  std::uint32_t lens = 0, image = 0;  ///< an image of it
  std::size_t images = 0;
  double reach =
      0;  ///< px: of its measurements from the principal point, but for one in a thousand
  std::string name;
  std::vector<double> radius, after, before;  ///< px: of its distortion
};

/// How much farther from the principal point a lens puts what a lens without distortion puts at
/// `radius` px; along the image's x axis.
double distortion(const Camera& camera, double radius) {
  const double at = radius / pixels_per_radian(camera);
  const std::array<double, 3> ray = is_fisheye(camera.model)
                                        ? std::array{std::sin(at), 0.0, std::cos(at)}
                                        : std::array{at, 0.0, 1.0};
  const double x = project(camera, ray).pixel[0] - principal_point_of(camera)[0];
  return x - radius;
}

std::string name_of(const PageScene& scene, const LensUse& use) {
  if (use.images == 1) return scene.names[use.image];
  const SceneMetadata* known = scene.result.metadata.get();
  const bool numbered = known != nullptr && use.lens < known->camera_ids.size();
  return "camera " + std::to_string(numbered ? known->camera_ids[use.lens] : use.lens);
}

const Camera& start_camera(const PageScene& scene, const LensUse& use) {
  return scene.start.cameras[scene.start.image_camera[use.image]];
}

bool has_start(const PageScene& scene, const LensUse& use) {
  return scene.has_start && scene.start_image[use.image] != 0 &&
         start_camera(scene, use).model == scene.result.cameras[use.lens].model;
}

std::vector<LensUse> lenses_of(const PageScene& scene) {
  const Problem& p = scene.result;
  std::vector<LensUse> uses;
  std::vector<std::size_t> place(p.cameras.size(), SIZE_MAX);
  std::vector<std::vector<float>> distances;
  for (std::uint32_t i = 0; i < scene.num_images(); ++i) {
    if (scene.observations(i) == 0) continue;
    std::size_t& at = place[p.image_camera[i]];
    if (at == SIZE_MAX) {
      at = uses.size();
      uses.push_back({p.image_camera[i], i, 0, 0, "", {}, {}, {}});
      distances.emplace_back();
    }
    ++uses[at].images;
    const Camera& camera = p.cameras[p.image_camera[i]];
    const std::array<double, 2> middle = principal_point_of(camera);
    for (std::uint64_t k = scene.begin[i]; k < scene.begin[i + 1]; ++k) {
      const double* u = &p.observation_xy[2 * scene.order[k]];
      const double x = u[0] - middle[0];
      const double y = u[1] - middle[1];
      distances[at].push_back(static_cast<float>(std::sqrt(x * x + y * y)));
    }
  }
  for (std::size_t l = 0; l < uses.size(); ++l) {
    uses[l].reach = quantile(distances[l], 0.999);
    uses[l].name = name_of(scene, uses[l]);
  }
  return uses;
}

void find_curves(const PageScene& scene, LensUse& use) {
  constexpr int kPoints = 40;
  for (int k = 0; k < kPoints; ++k) {
    const double radius = use.reach * k / (kPoints - 1);
    use.radius.push_back(radius);
    use.after.push_back(distortion(scene.result.cameras[use.lens], radius));
    if (has_start(scene, use)) use.before.push_back(distortion(start_camera(scene, use), radius));
  }
}

/// The ends of what curves do, but for lenses that have gone wild.
struct CurveEnds {
  double low = 0, high = 0, reach = 0;
};

CurveEnds ends_of(const std::vector<LensUse>& uses) {
  std::vector<float> values, reaches;
  for (const LensUse& use : uses) {
    for (const auto* curve : {&use.after, &use.before})
      for (const double v : *curve)
        if (std::isfinite(v)) values.push_back(static_cast<float>(v));
    reaches.push_back(static_cast<float>(use.reach));
  }
  const double part = uses.size() > 8 ? 0.004 : 0;
  CurveEnds ends{quantile(values, part), quantile(values, 1 - part), 0};
  for (const float reach : reaches) ends.reach = std::max(ends.reach, double(reach));
  const double pad = (ends.high - ends.low) * 0.08 + 1e-6;
  ends.high = std::max(ends.high + pad, pad);
  ends.low = std::min(ends.low - pad, -pad);
  return ends;
}

void name_extremes(Plot& plot, const std::vector<const LensUse*>& drawn) {
  const auto less = [](const LensUse* a, const LensUse* b) {
    return a->after.back() < b->after.back();
  };
  const LensUse* low = *std::min_element(drawn.begin(), drawn.end(), less);
  const LensUse* high = *std::max_element(drawn.begin(), drawn.end(), less);
  const bool near = std::abs(plot.y(low->after.back()) - plot.y(high->after.back())) <= 24;
  for (const LensUse* use : {low, high})
    plot.text(plot.x(use->reach) + 5,
              plot.y(use->after.back()) + (!near        ? 4
                                           : use == low ? 10
                                                        : -2),
              use->name, "t b");
}

std::string distortion_chart(const PageScene& scene, const std::vector<LensUse>& uses) {
  const CurveEnds ends = ends_of(uses);
  const bool one = uses.size() == 1;
  Plot plot({0, ends.reach}, {ends.low, ends.high}, {.left = 52, .right = one ? 8.0 : 66.0});
  plot.axis_y(round_ticks(ends.low, ends.high), "px");
  plot.axis_x(round_ticks(0, ends.reach), "px");
  std::vector<const LensUse*> drawn;
  const std::size_t step = std::max<std::size_t>(1, uses.size() / kCurves);
  for (std::size_t l = 0; l < uses.size(); l += step) drawn.push_back(&uses[l]);
  bool start = false;
  for (const LensUse* use : drawn) {
    if (use->before.empty()) continue;
    start = true;
    plot.line(use->radius, use->before, "before th");
  }
  for (const LensUse* use : drawn)
    plot.line(use->radius, use->after,
              one                  ? "after"
              : drawn.size() <= 24 ? "after th"
                                   : "after th many");
  if (one) {
    const LensUse& use = uses[0];
    const double x = plot.x(use.radius[26]);
    if (start) {
      plot.text(x, plot.y(use.after[26]) - 8, "after", "t b", Anchor::end);
      plot.text(x, plot.y(use.before[26]) + 16, "before", "t bf", Anchor::end);
    }
  } else {
    name_extremes(plot, drawn);
    if (start) {
      plot.text(plot.left() + 8, plot.bottom() - 24, "after", "t b");
      plot.text(plot.left() + 8, plot.bottom() - 9, "before", "t bf");
    }
  }
  const bool angles = is_fisheye(scene.result.cameras[uses[0].lens].model);
  return figure("Distortion",
                std::string("how far the lens moves a point outwards, up to its outermost "
                            "observation") +
                    (angles ? "; against an image that grows evenly with the angle" : ""),
                plot.svg("Distortion against the distance from the principal point"));
}

/// Lengths in px have one decimal, coefficients four, one more where there is room.
bool is_length(const std::string& parameter) {
  return parameter[0] == 'f' || parameter == "cx" || parameter == "cy";
}

double sigma_of(const Covariance* known, std::uint32_t lens, std::size_t parameter,
                std::size_t count) {
  if (known == nullptr || lens >= known->lenses.size() ||
      known->lenses[lens].size() != count * count)
    return NAN;
  return std::sqrt(known->lenses[lens][parameter * count + parameter]);
}

std::vector<std::string> parameters_of(const PageScene& scene, const LensUse& use) {
  std::vector<std::string> names;
  for (const auto name : parameter_names(scene.result.cameras[use.lens].model))
    names.emplace_back(name);
  return names;
}

/// Principal points of BAL lenses are 0 by definition; nobody measured them.
bool is_shown(const PageScene& scene, const std::string& parameter) {
  return !scene.has_bal_lenses || (parameter != "cx" && parameter != "cy");
}

/// What is nothing has no decimals.
std::string shown(double x, int places) { return x == 0 ? "0" : decimals(x, places); }

std::string signed_text(double x, int places) { return (x > 0 ? "+" : "") + decimals(x, places); }

std::string lens_table(const PageScene& scene, const LensUse& use, const Covariance* known) {
  const Camera& camera = scene.result.cameras[use.lens];
  const std::vector<std::string> names = parameters_of(scene, use);
  const bool start = has_start(scene, use);
  const bool sigmas = std::isfinite(sigma_of(known, use.lens, 0, names.size()));
  std::string body;
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (!is_shown(scene, names[k])) continue;
    const bool length = is_length(names[k]);
    const int places = length ? 2 : 5;
    const double after = camera.parameters[k];
    body += "<tr><th scope=\"row\"><i>" + escaped(names[k]) + "</i></th>";
    const double sigma = sigma_of(known, use.lens, k, names.size());
    if (start) {
      const double before = start_camera(scene, use).parameters[k];
      body += "<td class=\"bfc\">" + decimals(before, places) + "</td><td>" +
              decimals(after, places) + "</td><td>" +
              (after == before ? "held" : signed_text(after - before, places)) + "</td>";
    } else {
      body += "<td>" + decimals(after, places) + "</td>";
    }
    if (sigmas) body += "<td>" + (sigma == 0 ? "held" : digits(sigma, 2)) + "</td>";
    body += std::string("<td class=\"un\">") + (length ? "px" : "") + "</td></tr>";
  }
  std::string caption = escaped(use.name) + ", " + std::string(to_string(camera.model));
  if (scene.has_bal_lenses) caption = escaped(use.name) + ", BAL";
  if (scene.sizes_known)
    caption += ", " + grouped(std::int64_t(camera.width_px)) + " × " +
               grouped(std::int64_t(camera.height_px)) + kThinSpace + "px";
  caption += ", " + count_text(use.images, "image", "images");
  return "<table class=\"num\"><caption>" + caption + "</caption><thead><tr><th>parameter</th>" +
         (start ? "<th>before</th><th>after</th><th>change</th>" : "<th>value</th>") +
         (sigmas ? "<th>σ</th>" : "") + "<th>unit</th></tr></thead><tbody>" + body +
         "</tbody></table>";
}

std::string spark(const LensUse& use, const CurveEnds& ends) {
  const Axis x{0, ends.reach, 0, 96}, y{ends.low, ends.high, 19, 1};
  const auto curve = [&](const std::vector<double>& values) {
    std::vector<double> u, v;
    for (std::size_t k = 0; k < values.size(); k += 4) {
      u.push_back(x(use.radius[k]));
      v.push_back(std::clamp(y(values[k]), -20.0, 40.0));
    }
    return polyline(u, v);
  };
  Drawing out;
  out.path("M0 " + coordinate(y(0)) + "H96", "gr");
  out.path(curve(use.before), "before th");
  out.path(curve(use.after), "after th");
  return "<svg class=\"sp\" viewBox=\"0 0 96 20\" width=\"96\" height=\"20\" "
         "aria-hidden=\"true\">" +
         out.content() + "</svg>";
}

double focal_change(const PageScene& scene, const LensUse& use) {
  if (!has_start(scene, use)) return NAN;
  return scene.result.cameras[use.lens].parameters[0] / start_camera(scene, use).parameters[0] - 1;
}

std::string lens_row(const PageScene& scene, const LensUse& use, const Covariance* known,
                     const CurveEnds& ends) {
  const std::vector<std::string> names = parameters_of(scene, use);
  const Camera& camera = scene.result.cameras[use.lens];
  std::string row = "<tr><th scope=\"row\">" + escaped(use.name) + "</th>";
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (!is_shown(scene, names[k])) continue;
    const int places = is_length(names[k]) ? 1 : 4;
    if (scene.has_start)
      row += "<td class=\"bfc\">" +
             (has_start(scene, use) ? shown(start_camera(scene, use).parameters[k], places) : "") +
             "</td>";
    row += "<td>" + shown(camera.parameters[k], places) + "</td>";
    if (k == 0 && known != nullptr)
      row += "<td>" + digits(sigma_of(known, use.lens, k, names.size()), 2) + "</td>";
  }
  if (scene.has_start)
    row += "<td>" + signed_text(100 * focal_change(scene, use), 2) + kThinSpace + "%</td>";
  return row + "<td class=\"spc\">" + spark(use, ends) + "</td></tr>";
}

/// A table of the lenses of one model, what changed most first.
std::string model_table(const PageScene& scene, std::vector<const LensUse*> uses,
                        const Covariance* known, const CurveEnds& ends) {
  std::stable_sort(uses.begin(), uses.end(), [&](const LensUse* a, const LensUse* b) {
    return std::abs(focal_change(scene, *a)) > std::abs(focal_change(scene, *b));
  });
  std::string head, second, shown, rest;
  const std::vector<std::string> names = parameters_of(scene, *uses[0]);
  for (std::size_t k = 0; k < names.size(); ++k) {
    if (!is_shown(scene, names[k])) continue;
    const int columns = (scene.has_start ? 2 : 1) + (k == 0 && known != nullptr ? 1 : 0);
    head += "<th colspan=\"" + std::to_string(columns) + "\"><i>" + escaped(names[k]) + "</i>" +
            (is_length(names[k]) ? ", px" : "") + "</th>";
    second += std::string(scene.has_start ? "<th>before</th><th>after</th>" : "<th></th>") +
              (k == 0 && known != nullptr ? "<th>σ</th>" : "");
  }
  const std::size_t most = std::min(uses.size(), kMostRows);
  for (std::size_t k = 0; k < most; ++k)
    (k < kRows ? shown : rest) += lens_row(scene, *uses[k], known, ends);
  const std::string titles = "<thead><tr><th rowspan=\"2\">lens of</th>" + head +
                             (scene.has_start ? "<th rowspan=\"2\"><i>f</i> changed</th>" : "") +
                             "<th rowspan=\"2\" class=\"spc l\">distortion</th></tr><tr>" + second +
                             "</tr></thead>";
  std::string out = "<table class=\"num\">" + titles + "<tbody>" + shown + "</tbody></table>";
  if (!rest.empty())
    out += "<details><summary>" + std::to_string(most - kRows) + " more, which changed less" +
           (most < uses.size() ? ", of " + grouped(std::int64_t(uses.size())) : "") +
           "</summary><table class=\"num\">" + titles + "<tbody>" + rest +
           "</tbody></table></details>";
  return scrolling("Parameters of the lenses", out);
}

std::string tables(const PageScene& scene, const std::vector<LensUse>& uses,
                   const Covariance* known, const CurveEnds& ends) {
  std::string out;
  if (uses.size() <= kFewLenses) {
    for (const LensUse& use : uses) out += lens_table(scene, use, known);
    return scrolling("Parameters of the lenses", "<div class=\"lenses\">" + out + "</div>");
  }
  std::map<CameraModel, std::vector<const LensUse*>> models;
  for (const LensUse& use : uses) models[scene.result.cameras[use.lens].model].push_back(&use);
  for (const auto& [model, list] : models) {
    if (models.size() > 1)
      out += "<p class=\"un\">" + std::string(to_string(model)) + ", " +
             count_text(list.size(), "lens", "lenses") + "</p>";
    out += model_table(scene, list, known, ends);
  }
  return "<div>" + out + "</div>";
}

}  // namespace

std::string lens_words(const PageScene& scene) {
  const std::vector<LensUse> uses = lenses_of(scene);
  if (uses.empty()) return "";
  std::vector<float> changes;
  for (const LensUse& use : uses)
    if (std::isfinite(focal_change(scene, use)))
      changes.push_back(static_cast<float>(std::abs(focal_change(scene, use))));
  if (changes.empty()) return count_text(uses.size(), "lens", "lenses") + ".";
  const double most = *std::max_element(changes.begin(), changes.end());
  if (most == 0) return "Focal lengths are where they were.";
  if (changes.size() == 1) return "The focal length changed by " + percent(most) + ".";
  return "Focal lengths changed by " + percent(quantile(changes, 0.5)) + " in the median, " +
         percent(most) + " at most.";
}

std::string lens_section(const PageScene& scene, const Covariance* known) {
  std::vector<LensUse> uses = lenses_of(scene);
  if (uses.empty()) return "";
  for (LensUse& use : uses) find_curves(scene, use);
  const CurveEnds ends = ends_of(uses);
  std::string charts = distortion_chart(scene, uses);
  if (known != nullptr && uses.size() <= kFewLenses)
    for (const LensUse& use : uses) {
      charts += projection_chart(scene, use.lens, use.name, *known);
      charts += correlation_chart(scene, use.lens, use.name, *known);
    }
  if (uses.size() <= kFewLenses)
    return "<div class=\"grid\">" + charts + "</div>" + tables(scene, uses, known, ends);
  return "<div class=\"lens\"><div>" + charts + "</div>" + tables(scene, uses, known, ends) +
         "</div>";
}

}  // namespace sheaf
