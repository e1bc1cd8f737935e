// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "chart/number_text.h"
#include "inspect/check.h"
#include "io/output_file.h"
#include "io/sha256.h"
#include "page/cell_map.h"
#include "page/html.h"
#include "page/image_section.h"
#include "page/lens_section.h"
#include "page/page_assets.h"
#include "page/page_scene.h"
#include "page/photometric_section.h"
#include "page/report.h"
#include "page/residual_charts.h"
#include "page/run_record.h"
#include "page/run_section.h"
#include "page/scene_pack.h"
#include "page/scene_view.h"
#include "page/sensor_table.h"
#include "page/structure_section.h"
#include "page/survey_section.h"
#include "page/thumbnails.h"
#include "page/verdict.h"
#include "platform/base64.h"
#include "platform/parallel.h"
#include "scene/rigs.h"
#include "sheaf/survey.h"

namespace sheaf {
namespace {

using Fills = std::vector<std::pair<std::string_view, std::string>>;

/// A text with names in doubled braces, which are replaced; what is put in is not looked at again.
std::string filled(std::string_view text, const Fills& fills) {
  std::string out;
  while (true) {
    const std::size_t open = text.find("{{"), close = text.find("}}", open);
    if (open == std::string_view::npos || close == std::string_view::npos) break;
    out += text.substr(0, open);
    const std::string_view name = text.substr(open + 2, close - open - 2);
    for (const auto& [key, value] : fills)
      if (key == name) out += value;
    text.remove_prefix(close + 2);
  }
  return out + std::string(text);
}

/// What a page's policy allows as its only script.
std::string script_hash(const std::string& script) {
  Sha256 hash;
  hash.update(script.data(), script.size());
  const std::string hex = hash.hex_digest();
  std::string bytes;
  for (std::size_t i = 0; i < hex.size(); i += 2)
    bytes += static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16));
  return "sha256-" + base64(bytes);
}

std::string counts_html(const Problem& problem) {
  const std::size_t lenses = problem.cameras.size();
  std::string out = count_text(problem.num_images(), "image", "images");
  if (lenses > 0 && problem.num_observations() > 0)
    out += lenses == problem.num_images() && lenses > 1 ? ", a lens each"
           : lenses == 1                                ? ", one lens"
                         : ", " + count_text(lenses, "lens", "lenses");
  if (!problem.rigs.empty())
    out += ", " + count_text(problem.rigs.num_frames(), "frame", "frames") + " of " +
           count_text(problem.rigs.count, "rig", "rigs");
  out += ", " + count_text(problem.num_points(), "point", "points");
  if (problem.num_observations() == 0) return out;
  return out + ", " + count_text(problem.num_observations(), "observation", "observations");
}

/// Halves of a sentence, so that lines break between them.
std::string headline_html(const std::string& text) {
  const std::size_t at = text.find_first_of(",;");
  if (at == std::string::npos) return "<span>" + escaped(text) + "</span>";
  return "<span>" + escaped(text.substr(0, at + 1)) + "</span> <span>" +
         escaped(text.substr(at + 2)) + "</span>";
}

std::string colours_html(const PageScene& scene, bool sigmas) {
  const SceneMetadata* known = scene.result.metadata.get();
  // Files that know no colours have one for all.
  bool own = false;
  if (known != nullptr)
    for (const auto& colour : known->point_colours) own |= colour != known->point_colours.front();
  std::string out;
  const auto choice = [&](const char* value, const char* text, bool checked) {
    out += std::string("<label><input type=\"radio\" name=\"col\" value=\"") + value + "\"" +
           (checked ? " checked" : "") + "><span>" + text + "</span></label>";
  };
  if (own) choice("rgb", "own", true);
  if (!own || scene.after.counted > 0) choice("err", "error", !own);
  if (scene.after.counted > 0) choice("trk", "track length", false);
  if (sigmas) choice("sig", "σ", false);
  return out;
}

/// Each image's frame neighbour, so that those of one moment hang together.
std::string rigs_script(const Problem& problem) {
  std::string out = "[";
  std::vector<std::uint32_t> first(problem.rigs.num_frames(), Rigs::kNone);
  for (std::uint32_t i = 0; i < problem.num_images(); ++i) {
    if (!in_rig(problem.rigs, i)) continue;
    std::uint32_t& one = first[problem.rigs.image_frame[i]];
    if (one == Rigs::kNone)
      one = i;
    else
      out += (out.size() > 1 ? ",[" : "[") + std::to_string(one) + "," + std::to_string(i) + "]";
  }
  return out + "]";
}

/// Control and check points where they were adjusted, in the view's frame.
std::string marks_script(const RunRecord* run, const SceneView& view) {
  std::string out = "[";
  if (run == nullptr || !run->survey) return "[]";
  const RunSurvey& survey = *run->survey;
  for (const bool control : {true, false})
    for (const RunSurveyResidual& r : control ? survey.control : survey.check) {
      const Vector3<double> at = view(to_local(survey.world, r.adjusted));
      if (!std::isfinite(at[0] + at[1] + at[2])) continue;
      out += out.size() > 1 ? ",[" : "[";
      for (const double x : at) out += script_number(x, 9) + ",";
      out += std::string(control ? "\"control\"," : "\"check\",") + (r.blunder ? "1," : "0,") +
             script_text(r.name) + "]";
    }
  return out + "]";
}

using Part = std::function<std::string()>;

/// What the parts make, one behind the other; each a task of its own.
std::string joined(const std::vector<Part>& parts, int threads) {
  std::vector<std::string> made(parts.size());
  Threads(threads).for_each(parts.size(), [&](std::size_t k) { made[k] = parts[k](); });
  std::string out;
  for (const std::string& text : made) out += text;
  return out;
}

template <class Put>
std::string script_list(std::size_t count, const Put& put) {
  std::string out = "[";
  for (std::size_t i = 0; i < count; ++i) out += (i > 0 ? "," : "") + put(i);
  return out + "]";
}

std::string meta_script(const PageScene& scene, const Problem& result, const SceneView& view,
                        const RunRecord* run, const ScenePack& pack) {
  const std::size_t n = scene.num_images();
  std::string out = "{" + pack.meta;
  const auto put = [&](const char* name, const std::string& value) {
    out += std::string(",\"") + name + "\":" + value;
  };
  put("names", script_list(n, [&](std::size_t i) { return script_text(scene.names[i]); }));
  put("half", script_list(n, [&](std::size_t i) {
        return "[" + script_number(scene.frames[i].half[0]) + "," +
               script_number(scene.frames[i].half[1]) + "]";
      }));
  put("seen", script_list(n, [&](std::size_t i) { return std::to_string(scene.observations(i)); }));
  put("rmsAfter",
      script_list(n, [&](std::size_t i) { return script_number(scene.after.image_rms[i], 4); }));
  if (scene.has_start)
    put("rmsBefore",
        script_list(n, [&](std::size_t i) { return script_number(scene.before.image_rms[i], 4); }));
  put("links", neighbours_script(scene));
  put("enlarged", script_number(vector_scale(scene)));
  put("rigs", rigs_script(result));
  put("marks", marks_script(run, view));
  return out + "}";
}

std::string residual_words(const PageScene& scene) {
  std::vector<std::uint32_t> all(scene.num_images());
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  const double systematic = cell_map(scene, scene.after, all, 12, 12, 10 * scene.sigma).rms();
  return "Noise of " + with_unit(scene.sigma, "px") + "; tails " +
         (share_beyond(scene.after, 4 * scene.sigma) > 0.003 ? "heavier than a Gaussian’s"
                                                             : "as a Gaussian’s") +
         ". What is systematic across the image is " + with_unit(systematic, "px") + ", " +
         percent(systematic / scene.sigma) + " of the noise.";
}

std::string residual_section(const PageScene& scene, int threads) {
  constexpr std::uint64_t kFewest = 40;
  if (scene.after.counted < kFewest || !(scene.sigma > 1e-9)) return "";
  const std::string charts =
      joined({[&] { return distribution_chart(scene); }, [&] { return tail_chart(scene); },
              [&] { return direction_chart(scene); }, [&] { return cell_charts(scene); },
              [&] { return radial_chart(scene); }},
             threads);
  return section("residuals", "Residuals", residual_words(scene),
                 "<div class=\"grid\">" + charts + "</div>" + lens_maps(scene));
}

std::vector<double> point_sigmas(const Covariance& known) {
  std::vector<double> out;
  for (const auto& c : known.points) out.push_back(std::sqrt(c[0] + c[4] + c[8]));
  return out;
}

std::string note_html(const PageScene& scene, const SceneView& view, const ScenePack& pack) {
  std::string out;
  const std::uint64_t near = scene.num_points() - view.far;
  if (pack.points < near)
    out += grouped(std::int64_t(pack.points)) + " of " +
           count_text(near, "point is", "points are") +
           " drawn: those that are off, and a fair sample. ";
  if (view.far > 0)
    out += count_text(view.far, "point lies", "points lie") + " further out than drawn. ";
  if (!scene.sizes_known && scene.after.counted > 0)
    out += "The files state no image sizes: frames are as far as measurements reach. ";
  return out;
}

std::string patches_section(const ReportOptions& options) {
  if (options.photometric == nullptr) return "";
  return section("patches", "Patches", photometric_words(*options.photometric),
                 photometric_section(*options.photometric));
}

std::string images_section(const PageScene& scene, const Problem& result, const PageFacts& facts,
                           const ReportOptions& options) {
  return section("images", "Images", image_words(scene),
                 image_section(scene, thumbnails(scene, result, options.images, options.threads),
                               facts.covariance) +
                     sensor_table(result, facts.covariance));
}

/// What a run was, at the end; nothing of a scene alone.
std::string run_sections(const RunRecord* run) {
  if (run == nullptr) return "";
  return section("run", "The run", run_words(*run), run_section(*run)) +
         section("settings", "Settings",
                 "What made this, to the letter; bold differs from the default.",
                 settings_section(*run));
}

std::string surveyed_section(const RunRecord* run) {
  if (run == nullptr || !run->survey) return "";
  return section("survey", "Survey", survey_words(*run->survey), survey_section(*run->survey));
}

std::string sections(const PageScene& scene, const Problem& result, const PageFacts& facts,
                     const ReportOptions& options) {
  return joined({[&] { return residual_section(scene, options.threads); },
                 [&] { return patches_section(options); },
                 [&] {
                   return section("lenses", "Lenses", lens_words(scene),
                                  lens_section(scene, facts.covariance));
                 },
                 [&] { return surveyed_section(facts.run); },
                 [&] { return images_section(scene, result, facts, options); },
                 [&] {
                   return section("structure", "Structure", structure_words(scene),
                                  structure_section(scene, options.threads));
                 },
                 [&] { return run_sections(facts.run); }},
                options.threads);
}

}  // namespace

std::optional<Covariance> report_precision(const Problem& result, const ReportOptions& options) {
  constexpr std::size_t kMostImages = 500, kMostObservations = 1000000;
  if (!options.sigmas || result.num_observations() == 0 || result.num_images() > kMostImages ||
      result.num_observations() > kMostObservations)
    return {};
  CovarianceOptions wanted;
  wanted.fixed = options.fixed;
  wanted.loss = options.loss;
  wanted.threads = options.threads;
  wanted.lens_motions = result.cameras.size() <= 4;
  wanted.stop = options.stop;
  wanted.time_limit_s = options.time_limit_s;
  Result<Covariance> found = covariance(result, wanted);
  if (!found.ok() || found.value().ending != CovarianceEnding::whole) return {};
  return std::move(found).value();
}

Result<std::string> report_page(const Problem* before, const Problem& after,
                                const ReportOptions& options) {
  for (const Problem* problem : {before, &after})
    if (problem != nullptr)
      if (const Result<void> valid = validate(*problem); !valid.ok()) return valid.error();
  std::optional<RunRecord> run;
  if (!options.summary.empty()) {
    Result<RunRecord> read = read_run(options.summary, options.summary_name);
    if (!read.ok()) return read.error();
    run = std::move(read).value();
  }
  const bool placed = run && run->survey;
  // What is wrong is looked for while the scene is made.
  std::optional<Result<PageScene>> found;
  std::vector<Finding> findings;
  Threads(options.threads).for_each(2, [&](std::size_t task) {
    if (task == 0) found = page_scene(before, after, {options.in_place, options.threads});
    if (task == 1 && after.num_observations() > 0) findings = check(after, options.threads);
  });
  const Result<PageScene>& made = *found;
  if (!made.ok()) return made.error();
  const PageScene& scene = made.value();
  std::optional<Covariance> own;
  if (options.precision == nullptr) own = report_precision(after, options);
  const Covariance* known = own ? &*own : options.precision;
  PageFacts facts{run ? &*run : nullptr, known, std::move(findings)};
  const SceneView view =
      scene_view(scene, placed ? Vector3<double>{0, 0, 1} : Vector3<double>{0, 0, 0});
  const std::vector<double> sigmas = known ? point_sigmas(*known) : std::vector<double>();
  std::optional<Result<ScenePack>> packed;
  std::string told;
  Threads(options.threads).for_each(2, [&](std::size_t task) {
    if (task == 0) packed = pack_scene(scene, view, sigmas, {}, options.threads);
    if (task == 1) told = sections(scene, after, facts, options);
  });
  const Result<ScenePack>& pack = *packed;
  if (!pack.ok()) return pack.error();
  const Verdict words = verdict(scene, facts);
  const std::string script = "(() => {\n'use strict';\n" + std::string(page_script()) + "})();\n";
  const std::string title = escaped(options.title.empty() ? "Adjustment" : options.title);
  const std::string none = scene.has_start ? "" : " hidden";
  return filled(page_template(),
                {{"SCRIPT_HASH", script_hash(script)},
                 {"VERSION", run ? escaped(run->version) : ""},
                 {"TITLE", title},
                 {"STYLE", std::string(page_style())},
                 {"COUNTS", counts_html(after)},
                 {"HEADLINE", headline_html(words.headline)},
                 {"REASONS", words.reasons},
                 {"FIGURES", words.figures},
                 {"COLOURS", colours_html(scene, !sigmas.empty())},
                 {"STARTLESS", none},
                 {"RMS_BEFORE", scene.before.counted > 0 ? with_unit(scene.before.rms, "px") : ""},
                 {"RMS_AFTER", scene.after.counted > 0 ? with_unit(scene.after.rms, "px") : ""},
                 {"NOTE", note_html(scene, view, pack.value())},
                 {"SECTIONS", told},
                 {"META", meta_script(scene, after, view, facts.run, pack.value())},
                 {"DATA", pack.value().data},
                 {"SCRIPT", script}});
}

Result<void> write_report(const Problem* before, const Problem& after,
                          const std::filesystem::path& path, const ReportOptions& options) {
  const Result<std::string> page = report_page(before, after, options);
  if (!page.ok()) return page.error();
  Result<OutputFile> out = OutputFile::create(path, Compression::none);
  if (!out.ok()) return out.error();
  out.value().write(page.value());
  return out.value().commit();
}

}  // namespace sheaf
