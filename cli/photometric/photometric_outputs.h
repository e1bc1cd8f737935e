// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "options/option_field.h"
#include "outputs.h"
#include "report/patch_comparison.h"
#include "sheaf/io.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// What `photometric` writes beside its summary; empty: not asked for.
struct PhotometricOutputArguments {
  std::string out, ply, pictures, log, report;
};
std::vector<BoundOption> options_of(PhotometricOutputArguments& arguments);

/// Holds what outputs need of the start until the result is there. Errors are thrown.
class PhotometricOutputs {
 public:
  /// Before anything is computed. others: outputs that it does not write; inputs: what no output
  /// may be.
  PhotometricOutputs(const PhotometricOutputArguments& arguments,
                     const std::vector<NamedOutput>& others,
                     const std::vector<std::string>& inputs);

  void remember(const PhotometricProblem& start, const PhotometricOptions& options);

  /// Of the refined problem; the options with the scale that its loss ended with.
  void write(const PhotometricFolder& folder, const PhotometricDetails& details,
             const PhotometricOptions& options);

  /// --report, last of all. summary: JSON of the run; title: the folder's name.
  void write_page(const PhotometricFolder& folder, const PhotometricDetails& details,
                  const std::string& summary, const std::string& title) const;
  bool wants_page() const { return !arguments_.report.empty(); }

  /// Names of the files in the pictures' folder.
  const std::vector<std::string>& pictures() const { return pictures_; }

 private:
  PhotometricOutputArguments arguments_;
  std::optional<Problem> start_;  ///< for the PLY file
  std::optional<Problem> cloud_;  ///< of the start, for the page
  std::optional<PatchStage> stage_;
  std::optional<PatchComparison> comparison_;
  std::vector<std::string> pictures_;
};

}  // namespace sheaf
