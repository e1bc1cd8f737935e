// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>

#include "io/alicevision.h"
#include "io/bundler.h"
#include "io/format.h"
#include "io/g2o.h"
#include "io/libmv.h"
#include "io/line_cursor.h"
#include "io/nerfstudio.h"
#include "io/nvm.h"
#include "io/openmvg.h"
#include "io/opensfm.h"

namespace sheaf {
namespace {

/// Parsers and writers of one text, as the table has them.
template <Result<Problem> (*Parse)(std::string_view, const std::string&, std::vector<std::string>&)>
Result<Problem> parse_text(const FormatInput& input) {
  return Parse(input.text, input.name, input.notes);
}

template <Result<std::string> (*Format)(const Problem&)>
Result<FormatOutput> format_text(const Problem& problem) {
  Result<std::string> text = Format(problem);
  if (!text.ok()) return text.error();
  return FormatOutput{std::move(text).value()};
}

bool is_bundler(std::string_view head) { return head.starts_with(kBundlerMark); }
bool is_nvm(std::string_view head) { return head.starts_with(kNvmMark); }

std::string_view without_blanks(std::string_view head) {
  const std::size_t first = head.find_first_not_of(" \t\r\n\v\f");
  return first == head.npos ? std::string_view() : head.substr(first);
}

/// BAL has no mark: it begins with a number.
bool is_bal(std::string_view head) {
  const std::string_view text = without_blanks(head);
  return !text.empty() && (text[0] == '-' || text[0] == '+' || (text[0] >= '0' && text[0] <= '9'));
}

std::vector<FileFormat> make_formats() {
  // Of what a lens cannot say BAL's formats say the least.
  constexpr FormatHolds kBal{.shared_lenses = false,
                             .principal_points = false,
                             .sizes = false,
                             .names = false,
                             .point_ids = false,
                             .camera_ids = false,
                             .colours = false};
  FormatHolds bundler = kBal, nvm = kBal, libmv = kBal, openmvg;
  bundler.colours = nvm.colours = nvm.names = true;
  libmv.shared_lenses = libmv.principal_points = libmv.point_ids = true;
  libmv.doubles = false;
  openmvg.colours = false;
  return {
      {"bal", "BAL", "", kBal, is_bal},
      {"bundler", "Bundler v0.3", ".out", bundler, is_bundler, nullptr, parse_text<parse_bundler>,
       format_text<format_bundler>},
      {"nvm", "NVM", ".nvm", nvm, is_nvm, nullptr, parse_text<parse_nvm>, format_text<format_nvm>},
      {"libmv", "libmv", ".problem", libmv, is_libmv, nullptr, parse_text<parse_libmv>,
       format_text<format_libmv>},
      {"opensfm",
       "OpenSfM (reconstruction.json, with tracks.csv beside it)",
       "reconstruction.json",
       {},
       nullptr,
       is_opensfm,
       parse_opensfm,
       format_opensfm},
      {"openmvg", "OpenMVG (sfm_data.json)", "sfm_data.json", openmvg, nullptr, is_openmvg,
       parse_openmvg, format_openmvg},
      {"alicevision",
       "AliceVision (.sfm)",
       ".sfm",
       {},
       nullptr,
       is_alicevision,
       parse_alicevision,
       format_alicevision},
      {"g2o", "g2o", "", {}, is_g2o, nullptr, parse_text<parse_g2o>},
      {"nerfstudio",
       "",
       "transforms.json",
       {.observations = false},
       nullptr,
       nullptr,
       nullptr,
       format_nerfstudio},
      {"ply", "", ".ply", {.observations = false}},
  };
}

/// Files that people have, and that hold no problem or not one that can be read, with the way
/// round.
struct KnownStranger {
  std::string_view begins, found, instead;
};
constexpr std::array<KnownStranger, 6> kStrangers{{
    {"SQLite format 3", "a database (COLMAP's holds features and matches, and no model)",
     "the folder of a model that `colmap mapper` made from it"},
    {"<?xml", "XML (Metashape's cameras have no tie points in it)",
     "an export with tie points: in Metashape, File > Export > Export Cameras as Bundler (.out) or "
     "as a COLMAP model"},
    {"PK\x03\x04", "a zip archive (a project of Metashape, or a packed model)",
     "what it holds, unpacked; of a project an export as Bundler (.out) or as a COLMAP model"},
    {"Ogawa", "Alembic (AliceVision's .abc)",
     "a .sfm of it: aliceVision_convertSfMFormat --input x.abc --output x.sfm"},
    {"ply", "PLY, which has no observations", "the model that it was made from"},
    {"\x89HDF", "HDF5, which no structure from motion writes its models in",
     "the model's own files"},
}};

}  // namespace

const std::vector<FileFormat>& file_formats() {
  static const std::vector<FileFormat> formats = make_formats();
  return formats;
}

const FileFormat* format_named(std::string_view name) {
  const std::vector<FileFormat>& all = file_formats();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const FileFormat& f) { return f.name == name; });
  return found == all.end() ? nullptr : &*found;
}

std::string readable_formats() {
  std::string out;
  for (const FileFormat& format : file_formats())
    if (!format.title.empty()) out.append(format.title) += ", ";
  return out + "or the folder of a COLMAP model or of SBA's files";
}

Result<const FileFormat*> sniff_format(std::string_view head, const std::string& name) {
  const auto refuse = [&](const std::string& found, const std::string& expected) {
    return Error(ErrorCode::unreadable_input,
                 name + ":1: found " + found + ", expected " + expected);
  };
  for (const FileFormat& format : file_formats())
    if (format.is != nullptr && format.is(head)) return &format;
  for (const KnownStranger& stranger : kStrangers)
    if (head.starts_with(stranger.begins))
      return refuse(std::string(stranger.found), std::string(stranger.instead));
  const std::string_view text = without_blanks(head);
  if (!text.empty() && (text[0] == '{' || text[0] == '[')) return nullptr;
  const std::string_view word = text.substr(0, text.find_first_of(" \t\r\n"));
  return refuse(word.empty() ? "blanks alone" : sheaf::quoted(word),
                "a file of one of these: " + readable_formats());
}

}  // namespace sheaf
