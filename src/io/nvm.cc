// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/nvm.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include "geometry/rotation.h"
#include "io/colmap_form.h"
#include "io/line_cursor.h"
#include "io/point_text.h"
#include "scene/camera_frame.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

/// Least text of a record, each field one digit.
constexpr std::uint64_t kLeastImage = 22, kLeastPoint = 14, kLeastView = 8;

struct Reader : PointText {
  bool matrices;  ///< R9T
  SourceFiles source;

  std::optional<Error> image_name(const std::string& of, std::string_view& name);
  std::optional<Error> place(const std::string& of, Pose& pose);
  std::optional<Error> image(std::uint64_t i);
  std::optional<Error> view();
};

bool is_unit(const Quaternion<double>& q) {
  const double norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  return std::abs(norm2 - 1) < 1e-6;
}

std::optional<Error> Reader::place(const std::string& of, Pose& pose) {
  if (matrices) {
    std::array<double, 9> R{};
    if (auto e = reals(R, "an entry of the rotation" + of)) return e;
    if (auto e = rotation(R, in.line_number(), of)) return e;
    pose.rotation = rotation_from_stated(R);
    if (auto e = reals(pose.translation, "an entry of the translation" + of)) return e;
  } else {
    std::array<double, 4> q{};
    std::array<double, 3> centre{};
    if (auto e = reals(q, "an entry of the quaternion" + of)) return e;
    pose.rotation = rotation_from_stated(q);
    metadata.stated_rotations.insert(metadata.stated_rotations.end(), q.begin(), q.end());
    if (auto e = reals(centre, "a coordinate of the centre" + of)) return e;
    pose.translation = translation_of(pose.rotation, centre);
    source.centres.insert(source.centres.end(), centre.begin(), centre.end());
  }
  const bool finite = std::all_of(pose.translation.begin(), pose.translation.end(),
                                  [](double t) { return std::isfinite(t); });
  if (is_unit(pose.rotation) && finite) return {};
  return in.refuse_as("found no rotation, or a centre too far away, expected the pose" + of);
}

/// Names may have blanks: a name is what stands before the numbers of its line. Where the numbers
/// go on on further lines it is one word.
std::optional<Error> Reader::image_name(const std::string& of, std::string_view& name) {
  constexpr std::size_t kNumbers = 10, kNumbersOfMatrices = 15;
  in.seek_field();
  const std::string_view line = in.rest();
  std::size_t end = line.size();
  for (std::size_t k = 0; k < (matrices ? kNumbersOfMatrices : kNumbers) && end > 0; ++k) {
    const std::size_t last = line.find_last_not_of(" \t", end - 1);
    const std::size_t blank = last == line.npos ? line.npos : line.find_last_of(" \t", last);
    end = blank == line.npos ? 0 : line.find_last_not_of(" \t", blank) + 1;
  }
  if (!in.read_word(name)) return in.refuse("the name" + of);
  for (std::string_view word; name.size() < end && in.read_word(word);)
    name = {name.data(), static_cast<std::size_t>(word.data() - name.data()) + word.size()};
  return {};
}

std::optional<Error> Reader::image(std::uint64_t i) {
  const std::string of = " of image " + std::to_string(i);
  std::string_view name;
  if (auto e = image_name(of, name)) return e;
  if (name.find_first_of(std::string_view("\t\r\0", 3)) != name.npos)
    return in.refuse_as(
        "found a tab, a zero byte or half a line's end inside the name, expected "
        "the name" +
        of);
  if (name.starts_with('#')) return in.refuse_as("found a comment, expected the name" + of);
  metadata.image_names.emplace_back(name);
  std::array<double, 1> f{}, r{}, zero{};
  if (auto e = reals(f, "the focal length" + of)) return e;
  if (!(f[0] > 0)) return in.refuse("a focal length above 0" + of);
  Pose pose;
  if (auto e = place(of, pose)) return e;
  if (auto e = reals(r, "the radial coefficient" + of)) return e;
  if (auto e = reals(zero, "the 0 at the end" + of)) return e;
  source.nvm_distortion.push_back(r[0]);
  problem.add_image(pose, Camera{CameraModel::simple_pinhole, {f[0], 0, 0}});
  return {};
}

std::optional<Error> Reader::view() {
  std::uint32_t image = 0, feature = 0;
  std::array<double, 2> m{};
  const std::string what =
      "the number of an image, 0 to " + std::to_string(problem.num_images() - 1);
  if (auto e = integer(image, what)) return e;
  if (image >= problem.num_images()) return in.refuse(what);
  if (auto e = integer(feature, "the number of a feature")) return e;
  if (auto e = reals(m, "x or y of a view")) return e;
  const double f = problem.cameras[image].parameters[0];
  const double straight = 1 + source.nvm_distortion[image] * (m[0] * m[0] + m[1] * m[1]) / (f * f);
  if (!std::isfinite(straight * m[0]) || !std::isfinite(straight * m[1]))
    return in.refuse("a measurement that its radial coefficient leaves finite");
  problem.add_observation(image, static_cast<std::uint32_t>(problem.num_points() - 1),
                          straight * m[0], straight * m[1]);
  source.nvm_measured.insert(source.nvm_measured.end(), m.begin(), m.end());
  metadata.observation_feature.push_back(feature);
  return {};
}

void put(std::string& out, double value, char separator) {
  char buffer[40];
  out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr) += separator;
}
void put(std::string& out, std::uint64_t value, char separator) {
  out.append(std::to_string(value)) += separator;
}

bool can_state(const std::string& name) {
  return !name.empty() && name.find_first_of(std::string_view("\t\r\n\0", 4)) == name.npos &&
         name.front() != '#' && name.front() != ' ' && name.back() != ' ';
}

/// `measured`: what stands for the measurements, or null.
void put_points(const ColmapForm& form, const double* measured, std::string& out) {
  const Problem& problem = *form.problem;
  const FeatureTable& features = form.features;
  const bool keys = problem.metadata && !problem.metadata->observation_feature.empty();
  out += "\n" + std::to_string(problem.num_points()) + "\n";
  for (std::size_t p = 0; p < problem.num_points(); ++p) {
    for (std::size_t k = 0; k < 3; ++k) put(out, problem.points[3 * p + k], ' ');
    for (const std::uint8_t c : form.colours[p]) put(out, std::uint64_t{c}, ' ');
    put(out, features.track[p + 1] - features.track[p], ' ');
    for (std::uint64_t k = features.track[p]; k < features.track[p + 1]; ++k) {
      const std::uint64_t i = features.order[k];
      const std::uint32_t image = problem.observation_image[i];
      const auto view = *radial_view(problem.cameras[problem.image_camera[image]]);
      const double* xy = &problem.observation_xy[2 * i];
      put(out, std::uint64_t{image}, ' ');
      put(out,
          std::uint64_t{keys ? problem.metadata->observation_feature[i]
                             : features.of_observation[i]},
          ' ');
      put(out, measured ? measured[2 * i] : xy[0] - view.cx, ' ');
      put(out, measured ? measured[2 * i + 1] : xy[1] - view.cy, ' ');
    }
    out += '\n';
  }
}

}  // namespace

Result<Problem> parse_nvm(std::string_view text, const std::string& name,
                          std::vector<std::string>& notes) {
  Reader reader{{LineCursor(text, name), text.size()}, false, {}};
  LineCursor& in = reader.in;
  std::string_view mark;
  in.next_line();
  in.read_word(mark);
  if ((mark != kNvmMark && mark != "NVM_V3_R9T") || !in.line_ended())
    return in.refuse_as("found " + quoted(in.line()) +
                        ", expected NVM_V3 or NVM_V3_R9T alone on the first line (fixed "
                        "calibrations are not read)");
  reader.matrices = mark != kNvmMark;
  std::uint64_t images = 0, points = 0;
  if (auto e = reader.integer(images, "the number of images")) return *e;
  if (images == 0 || images > text.size() / kLeastImage)
    return in.refuse("a number of images that the file can hold");
  for (std::uint64_t i = 0; i < images; ++i)
    if (auto e = reader.image(i)) return *e;
  if (auto e = reader.integer(points, "the number of points")) return *e;
  if (points > text.size() / kLeastPoint)
    return in.refuse("a number of points that the file can hold");
  for (std::uint64_t i = 0; i < points; ++i)
    if (auto e = reader.point(i, kLeastView, [&] { return reader.view(); })) return *e;
  // Behind a model: another one, or 0 and what VisualSFM adds for its own use.
  std::uint64_t more = 0;
  if (in.seek_field() && in.read_integer(more) && more > 0)
    notes.push_back("the file has further models (the next of " + std::to_string(more) +
                    " images), which were left out");
  Problem& problem = reader.problem;
  if (std::any_of(reader.source.nvm_distortion.begin(), reader.source.nvm_distortion.end(),
                  [](double r) { return r != 0; }))
    notes.push_back("measurements were made straight by the images' radial coefficients");
  reader.source.format = "nvm";
  reader.metadata.source = std::make_shared<const SourceFiles>(std::move(reader.source));
  reader.metadata.state_hash = state_hash(problem);
  problem.metadata = std::make_shared<const SceneMetadata>(std::move(reader.metadata));
  return std::move(problem);
}

Result<std::string> format_nvm(const Problem& given) {
  Problem turned;
  const Problem& problem = *without_bal_cameras(given, turned);
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const auto view = radial_view(problem.cameras[c]);
    if (!view || view->k1 != 0 || view->k2 != 0)
      return Error(ErrorCode::usage, "camera " + std::to_string(c) + " is " +
                                         std::string(to_string(given.cameras[c].model)) +
                                         " with distortion or two focal lengths; NVM has no lens "
                                         "but the pinhole");
    if (!(view->f > 0))
      return Error(ErrorCode::usage, "camera " + std::to_string(c) +
                                         " has no focal length above 0, which NVM asks for");
  }
  const SceneMetadata* metadata = problem.metadata.get();
  const SourceFiles* source = metadata && metadata->source && metadata->source->format == "nvm"
                                  ? metadata->source.get()
                                  : nullptr;
  // Measurements as they were, where they and the lenses that made them straight still are.
  const bool measured = source && state_hash(given) == metadata->state_hash;
  const ColmapForm form = colmap_form(problem, "nvm");
  std::string out = "NVM_V3\n\n" + std::to_string(problem.num_images()) + "\n";
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    if (!can_state(form.names[j]))
      return Error(ErrorCode::usage, "the image name " + sheaf::quoted(form.names[j]) +
                                         " begins or ends with a blank, holds a tab, a zero byte "
                                         "or a line's end, starts with # or is empty, which NVM "
                                         "cannot state");
    out.append(form.names[j]) += form.names[j].find(' ') == std::string::npos ? ' ' : '\t';
    put(out, problem.cameras[problem.image_camera[j]].parameters[0], ' ');
    for (std::size_t k = 0; k < 4; ++k) put(out, form.poses[j][k], ' ');
    for (const double c : centre_of(problem, j, source ? &source->centres : nullptr))
      put(out, c, ' ');
    put(out, measured ? source->nvm_distortion[j] : 0, ' ');
    out += "0\n";
  }
  put_points(form, measured ? source->nvm_measured.data() : nullptr, out);
  return out += "\n0\n";
}

}  // namespace sheaf
