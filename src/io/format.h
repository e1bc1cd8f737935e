// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "io/folder_files.h"
#include "io/json_lines.h"
#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// A file as its format's reader gets it.
struct FormatInput {
  const std::string& text;
  std::string name;                 ///< of the file, for messages
  const JsonValue* json = nullptr;  ///< what the text says, of formats that are JSON
  FolderFiles beside{};             ///< its folder, for formats of several files
  std::vector<std::string>& notes;  ///< sentences about what of it is not in the problem
};

/// A file of a format of several files, beside the one that was asked for.
struct FormatFile {
  std::string name;
  std::string bytes;
};

struct FormatOutput {
  std::string text;
  std::vector<FormatFile> beside{};
};

/// What a format holds beside poses, lenses, points and observations.
struct FormatHolds {
  bool shared_lenses = true;     ///< one lens for several images
  bool principal_points = true;  ///< else measurements count from them
  bool sizes = true;             ///< of images
  bool names = true;             ///< of images
  bool point_ids = true;
  bool camera_ids = true;
  bool colours = true;
  bool idle_features = false;  ///< that observe nothing
  bool doubles = true;         ///< all numbers in double precision
  bool observations = true;
};

/// A format of one file, or of one and what lies beside it. A new one is a file with its reader and
/// its writer, and an entry in formats.cc.
struct FileFormat {
  std::string_view name;    ///< as `--format` has it
  std::string_view title;   ///< as messages have it; empty: not in lists of what is read
  std::string_view ending;  ///< of names of files that are written so; empty: of none
  FormatHolds holds{};
  bool (*is)(std::string_view head) = nullptr;       ///< told by the first bytes
  bool (*is_json)(const JsonValue& root) = nullptr;  ///< told by what a JSON text holds
  /// Null: not read, or not as a text (BAL).
  Result<Problem> (*parse)(const FormatInput& input) = nullptr;
  /// Null: not written, or not as a text (BAL, PLY). Errors: usage, for what it cannot hold.
  Result<FormatOutput> (*format)(const Problem& problem) = nullptr;
};

/// All of them; models of COLMAP are folders, and stand by themselves.
const std::vector<FileFormat>& file_formats();

/// The format of that name, or null.
const FileFormat* format_named(std::string_view name);

/// "BAL, Bundler v0.3, ... or the folder of a COLMAP model".
std::string readable_formats();

/// The format of a text, by its beginning; null: JSON, of which more must be known, or a format
/// that is not read. Errors: unreadable_input, for what is known not to be read, with what to do.
Result<const FileFormat*> sniff_format(std::string_view head, const std::string& name);

}  // namespace sheaf
