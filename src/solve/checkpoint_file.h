// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "options/option_field.h"
#include "platform/clock.h"
#include "sheaf/error.h"
#include "sheaf/solve.h"

namespace sheaf {

/// What a run is: two runs of which it is the same make the same steps.
struct RunIdentity {
  std::string problem;                     ///< its fingerprint
  std::vector<std::string> names, values;  ///< of options that steps depend on
};

/// Whether steps depend on the option of this name.
bool steps_depend_on(const std::string& option);

/// simd: the name of the instruction set that is used.
template <class Options>
RunIdentity identity_of(std::string fingerprint, const Options& options,
                        const OptionTable<Options>& fields, const std::string& simd) {
  RunIdentity out;
  out.problem = std::move(fingerprint);
  for (const OptionField<Options>& field : fields) {
    if (!steps_depend_on(field.spec.name)) continue;
    out.names.push_back(field.spec.name);
    out.values.push_back(text_of(field.get(options)));
  }
  out.names.push_back("simd");
  out.values.push_back(simd);
  return out;
}

/// Errors: ErrorCode::usage, naming what differs.
Result<void> check_same(const RunIdentity& found, const RunIdentity& expected,
                        const std::string& path);

/// A file of checkpoints of one kind: a mark of eight characters, what archives hold, and its
/// SHA-256.
struct CheckpointKind {
  std::string_view mark;
  std::string_view of;    ///< as in "found no checkpoint of a solve"
  std::uint32_t version;  ///< grows with what is written
  std::string_view noun = "checkpoint";
};

/// Written beside and renamed. Errors: unwritable_output.
Result<void> write_checkpoint_file(const CheckpointKind& kind, std::string_view archived,
                                   const std::string& path);

/// What was archived. Errors: unreadable_input for what is no whole checkpoint of this kind and
/// version.
Result<std::string> read_checkpoint_file(const CheckpointKind& kind, const std::string& path);

/// When a run is written down, and what came of it.
class CheckpointTimes {
 public:
  /// So often as the options say, and where the run is to stop, which leaves where it stands.
  template <class Options>
  bool is_due(const Options& options, const Stopwatch& clock) const {
    if (options.checkpoint.empty()) return false;
    const double now = clock.seconds();
    return options.stop.stop_requested() || now >= options.time_limit_s ||
           now - written_s_ >= options.checkpoint_every_s;
  }
  void note(const Result<void>& written, const Stopwatch& clock, Summary& summary) {
    if (written.ok())
      ++summary.checkpoints;
    else
      summary.checkpoint_failure = written.error().what();
    written_s_ = clock.seconds();
  }

 private:
  double written_s_ = 0;
};

/// Of bytes that are whole and still make no sense.
Error senseless_checkpoint(const std::string& path);

/// SHA-256, hexadecimal.
std::string digest_of(std::string_view bytes);

}  // namespace sheaf
