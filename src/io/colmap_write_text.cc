// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <charconv>
#include <functional>

#include "geometry/camera_model.h"
#include "io/colmap_form.h"
#include "io/line_cursor.h"

namespace sheaf {
namespace {

void put(std::string& out, double x) {
  char buffer[40];
  out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr) += ' ';
}
void put(std::string& out, std::uint64_t n) { out.append(std::to_string(n)) += ' '; }

/// Ends a line whose last field left a blank behind it.
void end_line(std::string& out) {
  if (out.ends_with(' ')) out.pop_back();
  out += '\n';
}

std::uint64_t bits(double x) { return std::bit_cast<std::uint64_t>(x); }

template <class Numbers>
bool same(const Numbers& a, const Numbers& b) {
  for (std::size_t i = 0; i < a.size(); ++i)
    if (bits(a[i]) != bits(b[i])) return false;
  return true;
}

/// The text of `lines` lines for each of `count` records: the lines of the source where `same(i,
/// line)`, else what `format(i, line, out)` appends. Comments are the source's too.
std::string restate(const std::string& source, std::size_t count, int lines,
                    const std::function<bool(std::size_t, int)>& same,
                    const std::function<void(std::size_t, int, std::string&)>& format) {
  std::string out;
  LineCursor in(source, "");
  std::size_t record = 0;
  while (in.next_line()) {
    const std::string_view text = in.rest();
    if (text.empty() || text.front() == '#' || record == count) {
      out += in.raw_line();
      continue;
    }
    for (int line = 0; line < lines; ++line) {
      if (line > 0) in.next_line();
      if (same(record, line)) {
        out += in.raw_line();
      } else {
        format(record, line, out);
      }
    }
    ++record;
  }
  return out;
}

std::string state(const std::string& header, std::size_t count, int lines,
                  const std::function<void(std::size_t, int, std::string&)>& format) {
  std::string out = header;
  for (std::size_t i = 0; i < count; ++i)
    for (int line = 0; line < lines; ++line) format(i, line, out);
  return out;
}

}  // namespace

std::string cameras_text(const ColmapForm& form, const std::string& source,
                         const ColmapForm* before) {
  const auto& cameras = form.problem->cameras;
  const auto format = [&](std::size_t c, int, std::string& out) {
    put(out, std::uint64_t{form.camera_ids[c]});
    out.append(to_string(cameras[c].model)) += ' ';
    put(out, cameras[c].width_px);
    put(out, cameras[c].height_px);
    for (std::size_t k = 0; k < parameter_count(cameras[c].model); ++k)
      put(out, cameras[c].parameters[k]);
    end_line(out);
  };
  if (before == nullptr || before->camera_ids != form.camera_ids)
    return state("# id, model, width, height, parameters\n", cameras.size(), 1, format);
  const auto& were = before->problem->cameras;
  return restate(
      source, cameras.size(), 1,
      [&](std::size_t c, int) {
        return cameras[c].model == were[c].model && cameras[c].width_px == were[c].width_px &&
               cameras[c].height_px == were[c].height_px &&
               same(cameras[c].parameters, were[c].parameters);
      },
      format);
}

std::string images_text(const ColmapForm& form, const std::string& source,
                        const ColmapForm* before) {
  const Problem& problem = *form.problem;
  const auto features_of = [](const ColmapForm& f, std::size_t j, auto&& use) {
    for (std::uint64_t k = f.features.begin[j]; k < f.features.begin[j + 1]; ++k)
      use(f.features.xy[2 * k], f.features.xy[2 * k + 1], f.features.point[k]);
  };
  const auto format = [&](std::size_t j, int line, std::string& out) {
    if (line == 0) {
      put(out, std::uint64_t{form.image_ids[j]});
      for (const double q : form.rotation(j)) put(out, q);
      for (const double t : problem.poses[j].translation) put(out, t);
      put(out, std::uint64_t{form.camera_ids[problem.image_camera[j]]});
      out += form.names[j];
    } else {
      features_of(form, j, [&](double x, double y, std::uint64_t point) {
        put(out, x), put(out, y);
        if (point == ColmapDraft::kNoPoint) {
          out += "-1 ";
        } else {
          put(out, point);
        }
      });
    }
    end_line(out);
  };
  if (before == nullptr || before->image_ids != form.image_ids ||
      before->features.begin != form.features.begin ||
      before->problem->num_observations() != problem.num_observations())
    return state(
        "# id, qw qx qy qz, tx ty tz (camera from world), camera id, name\n# features: x, y, point "
        "id or -1\n",
        problem.num_images(), 2, format);
  return restate(
      source, problem.num_images(), 2,
      [&](std::size_t j, int line) {
        if (line == 0)
          return form.camera_ids[problem.image_camera[j]] ==
                     before->camera_ids[before->problem->image_camera[j]] &&
                 form.names[j] == before->names[j] && same(form.rotation(j), before->rotation(j)) &&
                 same(problem.poses[j].translation, before->problem->poses[j].translation);
        const auto& now = form.features;
        const auto& then = before->features;
        for (std::uint64_t k = now.begin[j]; k < now.begin[j + 1]; ++k)
          if (bits(now.xy[2 * k]) != bits(then.xy[2 * k]) ||
              bits(now.xy[2 * k + 1]) != bits(then.xy[2 * k + 1]) || now.point[k] != then.point[k])
            return false;
        return true;
      },
      format);
}

std::string points_text(const ColmapForm& form, const std::string& source,
                        const ColmapForm* before) {
  const Problem& problem = *form.problem;
  const auto track = [](const ColmapForm& f, std::size_t p, auto&& use) {
    for (std::uint64_t k = f.features.track[p]; k < f.features.track[p + 1]; ++k) {
      const std::uint64_t i = f.features.order[k];
      use(f.image_ids[f.problem->observation_image[i]], f.features.of_observation[i]);
    }
  };
  const auto format = [&](std::size_t p, int, std::string& out) {
    put(out, form.point_ids[p]);
    for (std::size_t k = 0; k < 3; ++k) put(out, problem.points[3 * p + k]);
    for (const std::uint8_t c : form.colours[p]) put(out, std::uint64_t{c});
    put(out, form.errors_px[p]);
    track(form, p, [&](std::uint32_t image, std::uint32_t feature) {
      put(out, std::uint64_t{image});
      put(out, std::uint64_t{feature});
    });
    end_line(out);
  };
  if (before == nullptr || before->point_ids != form.point_ids ||
      before->problem->num_observations() != problem.num_observations())
    return state("# id, x y z, r g b, mean error (px), track: image id, number of the feature\n",
                 problem.num_points(), 1, format);
  const auto elements = [&](const ColmapForm& f, std::size_t p) {
    std::vector<std::array<std::uint32_t, 2>> list;
    track(f, p, [&](std::uint32_t image, std::uint32_t feature) {
      list.push_back({image, feature});
    });
    return list;
  };
  return restate(
      source, problem.num_points(), 1,
      [&](std::size_t p, int) {
        for (std::size_t k = 3 * p; k < 3 * p + 3; ++k)
          if (bits(problem.points[k]) != bits(before->problem->points[k])) return false;
        return bits(form.errors_px[p]) == bits(before->errors_px[p]) &&
               form.colours[p] == before->colours[p] && elements(form, p) == elements(*before, p);
      },
      format);
}

}  // namespace sheaf
