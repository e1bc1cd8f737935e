// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/ndarray.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "fork_safety.h"
#include "keyword_options.h"
#include "options/photometric_options.h"
#include "options/scene_options.h"
#include "running.h"
#include "sheaf/io.h"
#include "sheaf/solve.h"
#include "summary_object.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;
/// A folder that Python holds; one call at a time works on it.
struct HeldFolder : PhotometricFolder {
  std::atomic<bool> used{false};
};
using FolderHandle = std::shared_ptr<HeldFolder>;

/// Throws Error (usage) while another call works on the folder.
class FolderUse {
 public:
  explicit FolderUse(HeldFolder& folder) : folder_(folder) {
    if (folder.used.exchange(true))
      throw Error(ErrorCode::usage, "the folder is in use by another call");
  }
  ~FolderUse() { folder_.used = false; }
  FolderUse(const FolderUse&) = delete;
  FolderUse& operator=(const FolderUse&) = delete;

 private:
  HeldFolder& folder_;
};

/// Grey levels of an array (height, width) of any numbers that a float holds well enough.
GreyImage image_from(nb::handle given, std::size_t i) {
  const nb::object array =
      nb::module_::import_("numpy").attr("ascontiguousarray")(given, nb::arg("dtype") = "float32");
  const auto grey = nb::cast<nb::ndarray<const float, nb::device::cpu, nb::c_contig>>(array);
  if (grey.ndim() != 2)
    throw Error(ErrorCode::usage, "images[" + std::to_string(i) + "]: found " +
                                      std::to_string(grey.ndim()) +
                                      " dimensions, expected (height, width)");
  GreyImage out;
  out.height = static_cast<int>(grey.shape(0));
  out.width = static_cast<int>(grey.shape(1));
  out.pixels.assign(grey.data(), grey.data() + grey.size());
  return out;
}

void construct(HeldFolder* self, nb::handle images, nb::handle camera, nb::handle poses,
               nb::handle points, nb::handle host, nb::handle host_xy) {
  PhotometricProblem p;
  for (nb::handle image : nb::borrow<nb::object>(images))
    p.images.push_back(image_from(image, p.images.size()));
  const std::vector<double> pinhole = reals_from(camera, "camera", 1);
  if (pinhole.size() != 4)
    throw Error(ErrorCode::usage, "camera: found " + std::to_string(pinhole.size()) +
                                      " numbers, expected fx, fy, cx, cy");
  p.camera = {pinhole[0], pinhole[1], pinhole[2], pinhole[3]};
  p.poses = poses_from(poses, "poses");
  p.points = reals_from(points, "points", 3);
  p.host = indices_from(host, "host");
  p.host_xy = reals_from(host_xy, "host_xy", 2);
  validate(p).value();
  new (self) HeldFolder();
  self->problem = std::move(p);
  self->format = "direct";
}

FolderHandle held(PhotometricFolder folder) {
  auto out = std::make_shared<HeldFolder>();
  static_cast<PhotometricFolder&>(*out) = std::move(folder);
  return out;
}

nb::dict copy_of(const nb::kwargs& keywords) { return nb::cast<nb::dict>(keywords.attr("copy")()); }

FolderHandle read_folder(const fs::path& path, const nb::kwargs& keywords) {
  nb::dict left = copy_of(keywords);
  PhotometricReadOptions options;
  take_options(left, bound(photometric_read_fields(), options));
  check_all_taken(left, "read_photometric");
  const nb::gil_scoped_release released;
  return held(read_photometric(path, options).value());
}

nb::tuple generate_folders(const nb::kwargs& keywords) {
  nb::dict left = copy_of(keywords);
  PhotometricSceneOptions options;
  take_options(left, bound(photometric_scene_fields(), options));
  const auto count = [&](const char* name, std::uint32_t& to) {
    if (left.contains(name)) to = nb::cast<std::uint32_t>(left.attr("pop")(name));
  };
  count("cameras", options.images);
  count("points", options.points);
  if (left.contains("seed")) options.seed = nb::cast<std::uint64_t>(left.attr("pop")("seed"));
  check_all_taken(left, "generate_photometric");
  auto start = std::make_shared<HeldFolder>(), truth = std::make_shared<HeldFolder>();
  {
    const nb::gil_scoped_release released;
    PhotometricScene scene = generate(options).value();
    start->problem = std::move(scene.start);
    truth->problem = std::move(scene.truth);
    start->format = truth->format = "direct";
  }
  return nb::make_tuple(start, truth);
}

nb::object details_object(const PhotometricDetails& details, std::size_t points) {
  std::vector<std::uint32_t> image, point;
  std::vector<double> xy, rms;
  for (const PatchSight& sight : details.seen) {
    image.push_back(sight.image);
    point.push_back(sight.point);
    xy.insert(xy.end(), {sight.x, sight.y});
    rms.push_back(sight.rms_grey);
  }
  const std::size_t columns = details.of_inverse_depth || points == 0 ? 1 : 3;
  return nb::module_::import_("sheaf._records")
      .attr("PhotometricDetails")(
          array_of(point), array_of(image), array_of(xy, {rms.size(), 2}),
          array_of(rms, {rms.size()}), details.sigma_grey,
          array_of(details.sigma, {details.sigma.size() / columns, columns}),
          details.of_inverse_depth);
}

nb::object refine(const FolderHandle& folder, const nb::kwargs& keywords) {
  nb::dict left = copy_of(keywords);
  Run run(left.attr("pop")("callback", nb::none()));
  PhotometricOptions options;
  take_options(left, bound(photometric_fields(), options));
  check_all_taken(left, "photometric");
  const FolderUse use(*folder);
  options.threads = threads_here(options.threads);
  options.stop = run.token();
  options.on_iteration = [&](const Iteration& iteration) { return run.report(iteration); };
  PhotometricSummary summary;
  PhotometricDetails details;
  run.go([&] {
    summary = refine_photometric(folder->problem, options).value();
    PhotometricOptions at_end = options;
    at_end.on_iteration = nullptr;
    if (!summary.solve.rounds.empty()) at_end.loss.scale_px = summary.solve.rounds.back().scale_px;
    details = examine_photometric(folder->problem, at_end).value();
  });
  const nb::object solved =
      nb::module_::import_("sheaf._summary").attr("Summary")(**fields_of(summary.solve));
  nb::dict out;
  out["solve"] = solved;
  out["patches_total"] = summary.patches_total;
  out["patches_visible"] = summary.patches_visible;
  out["patches_left"] = summary.patches_left;
  out["initial_rms_grey"] = summary.initial_rms_grey;
  out["final_rms_grey"] = summary.final_rms_grey;
  out["initial_median_grey"] = summary.initial_median_grey;
  out["final_median_grey"] = summary.final_median_grey;
  out["initial_inlier_share"] = summary.initial_inlier_share;
  out["final_inlier_share"] = summary.final_inlier_share;
  out["details"] = details_object(details, folder->problem.num_points());
  return nb::module_::import_("sheaf._records").attr("PhotometricSummary")(**out);
}

nb::object poses_of(HeldFolder& folder) {
  const FolderUse use(folder);
  const std::vector<Pose>& poses = folder.problem.poses;
  return array_of(poses.empty() ? nullptr : poses.front().rotation.data(), {poses.size(), 7});
}

nb::object brightness_of(HeldFolder& folder) {
  const FolderUse use(folder);
  std::vector<double> out;
  for (const Brightness& b : folder.problem.brightness) out.insert(out.end(), {b.a, b.b});
  return array_of(out, {out.size() / 2, 2});
}

void write_folder(const FolderHandle& folder, const fs::path& path) {
  const FolderUse use(*folder);
  const nb::gil_scoped_release released;
  write_photometric(*folder, path).value();
}

using FolderClass = nb::class_<HeldFolder>;

FolderClass bind_folder(nb::module_& module) {
  FolderClass folder(
      module, "PhotometricFolder",
      "Images with their poses, and points with their grey patches (docs/photometric.md).\n\n"
      "  images: of each (height, width): grey levels, 0 to 255\n"
      "  camera: fx, fy, cx, cy of all, pixels; (0, 0) is the centre of the first one\n"
      "  poses: (n, 7): qw qx qy qz tx ty tz, cam_from_world, looking along +z\n"
      "  points: (m, 3), host: (m,), host_xy: (m, 2): each on the ray of a pixel of its host, the "
      "image that its patch is taken from");
  folder.def("__init__", &construct, nb::arg("images"), nb::arg("camera"), nb::arg("poses"),
             nb::arg("points"), nb::arg("host"), nb::arg("host_xy"),
             nb::sig("def __init__(self, images: "
                     "collections.abc.Sequence[numpy.typing.NDArray[typing.Any]], camera: "
                     "numpy.typing.ArrayLike, poses: numpy.typing.ArrayLike, points: "
                     "numpy.typing.ArrayLike, host: numpy.typing.ArrayLike, host_xy: "
                     "numpy.typing.ArrayLike) -> None"));
  return folder;
}

/// What it was made of.
void bind_inputs(FolderClass& folder) {
  folder
      .def_prop_ro(
          "host", [](const HeldFolder& f) { return array_of(f.problem.host); },
          nb::sig("def host(self) -> numpy.typing.NDArray[numpy.uint32]"),
          "(m,): the image that each point's patch is taken from; empty where patches are stored.")
      .def_prop_ro(
          "host_xy",
          [](const HeldFolder& f) {
            return array_of(f.problem.host_xy, {f.problem.host.size(), 2});
          },
          nb::sig("def host_xy(self) -> numpy.typing.NDArray[numpy.float64]"),
          "(m, 2): where, pixels; a copy.")
      .def_prop_ro(
          "camera",
          [](const HeldFolder& f) {
            const Pinhole& c = f.problem.camera;
            return nb::make_tuple(c.fx, c.fy, c.cx, c.cy);
          },
          nb::sig("def camera(self) -> tuple[float, float, float, float]"),
          "fx, fy, cx, cy of all images, pixels.")
      .def(
          "image",
          [](const HeldFolder& f, std::size_t i) {
            if (i >= f.problem.images.size()) throw nb::index_error("no such image");
            const GreyImage& grey = f.problem.images[i];
            const std::vector<double> levels(grey.pixels.begin(), grey.pixels.end());
            return array_of(levels, {static_cast<std::size_t>(grey.height),
                                     static_cast<std::size_t>(grey.width)});
          },
          nb::arg("index"),
          nb::sig("def image(self, index: int) -> numpy.typing.NDArray[numpy.float64]"),
          "(height, width): grey levels; a copy.");
}

/// What a refinement changes, and where it goes.
void bind_state(FolderClass& folder) {
  folder
      .def_prop_ro("poses", &poses_of,
                   nb::sig("def poses(self) -> numpy.typing.NDArray[numpy.float64]"),
                   "(n, 7): qw qx qy qz tx ty tz, cam_from_world; a copy.")
      .def_prop_ro(
          "points",
          [](HeldFolder& f) {
            const FolderUse use(f);
            return array_of(f.problem.points, {f.problem.num_points(), 3});
          },
          nb::sig("def points(self) -> numpy.typing.NDArray[numpy.float64]"),
          "(m, 3): X, Y, Z, scene units; a copy.")
      .def_prop_ro("brightness", &brightness_of,
                   nb::sig("def brightness(self) -> numpy.typing.NDArray[numpy.float64]"),
                   "(n, 2): a, b of each image, or (0, 2) where all are (1, 0); a copy.")
      .def_prop_ro("num_images", [](const HeldFolder& f) { return f.problem.images.size(); })
      .def_prop_ro("num_points", [](const HeldFolder& f) { return f.problem.num_points(); })
      .def_prop_ro("format", [](const HeldFolder& f) { return f.format; })
      .def_prop_ro("notes", [](const HeldFolder& f) { return f.notes; })
      .def("write", &write_folder, nb::arg("path"),
           nb::sig("def write(self, path: str | os.PathLike[str]) -> None"),
           "Writes the state in the folder's own format into a folder.");
}

}  // namespace

void bind_photometric(nb::module_& module) {
  FolderClass folder = bind_folder(module);
  bind_inputs(folder);
  bind_state(folder);
  PhotometricReadOptions reading;
  const auto of_reading = bound(photometric_read_fields(), reading);
  module.def("read_photometric", &read_folder, nb::arg("path"), nb::arg("options"),
             nb::sig(signature_of("read_photometric", "path: str | os.PathLike[str]", {},
                                  of_reading, "PhotometricFolder")
                         .c_str()),
             ("Reads a folder of images with poses and points.\n" + help_of(of_reading)).c_str());
  PhotometricSceneOptions scene;
  const auto of_scene = bound(photometric_scene_fields(), scene);
  module.def("generate_photometric", &generate_folders, nb::arg("options"),
             nb::sig(signature_of("generate_photometric", "",
                                  {"cameras: int = 6", "points: int = 2000", "seed: int = 1"},
                                  of_scene, "tuple[PhotometricFolder, PhotometricFolder]")
                         .c_str()),
             ("Images of a textured surface: (start, truth).\n" + help_of(of_scene)).c_str());
  PhotometricOptions fresh;
  const auto options = bound(photometric_fields(), fresh);
  module.def("photometric", &refine, nb::arg("folder"), nb::arg("options"),
             nb::sig(signature_of("photometric", "folder: PhotometricFolder",
                                  {"callback: collections.abc.Callable[[Iteration], bool | None] | "
                                   "None = None"},
                                  options, "sheaf._records.PhotometricSummary")
                         .c_str()),
             ("Refines poses and points from the pixels of images, in place. Where a Summary says "
              "px its numbers are grey levels.\n" +
              help_of(options))
                 .c_str());
}

}  // namespace sheaf
