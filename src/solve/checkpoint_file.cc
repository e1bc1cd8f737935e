// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/checkpoint_file.h"

#include <algorithm>

#include "io/byte_source.h"
#include "io/output_file.h"
#include "io/sha256.h"
#include "platform/archive.h"

namespace sheaf {
namespace {

constexpr std::size_t kDigest = 64;

Error no_checkpoint(const std::string& path, const std::string& why) {
  return Error(ErrorCode::unreadable_input, path + ": " + why);
}

}  // namespace

std::string digest_of(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes.data(), bytes.size());
  return hash.hex_digest();
}

bool steps_depend_on(const std::string& option) {
  for (const char* other : {"threads", "time-limit", "lend-observations", "checkpoint",
                            "checkpoint-every", "resume", "simd"})
    if (option == other) return false;
  return true;
}

Result<void> check_same(const RunIdentity& found, const RunIdentity& expected,
                        const std::string& path) {
  const auto usage = [&](const std::string& text) {
    return Error(ErrorCode::usage, path + ": " + text);
  };
  if (found.problem != expected.problem)
    return usage("the checkpoint is of another problem, or of other priors or held parameters");
  for (std::size_t k = 0; k < expected.names.size(); ++k) {
    const auto at = std::find(found.names.begin(), found.names.end(), expected.names[k]);
    const auto place = static_cast<std::size_t>(at - found.names.begin());
    const std::string before = place < found.values.size() ? found.values[place] : "not there";
    if (before != expected.values[k])
      return usage("the checkpoint's run has --" + expected.names[k] + " " + before +
                   ", this one has " + expected.values[k]);
  }
  return {};
}

Result<void> write_checkpoint_file(const CheckpointKind& kind, std::string_view archived,
                                   const std::string& path) {
  ArchiveWriter a;
  a(kind.version);
  std::string bytes = a.bytes();
  bytes += archived;
  Result<OutputFile> file = OutputFile::create(path, Compression::none);
  if (!file.ok()) return file.error();
  file.value().write(kind.mark.data(), kind.mark.size());
  file.value().write(bytes);
  file.value().write(digest_of(bytes));
  return file.value().commit();
}

Result<std::string> read_checkpoint_file(const CheckpointKind& kind, const std::string& path) {
  const Result<std::string> text = read_text(path);
  if (!text.ok()) return text.error();
  const std::string noun(kind.noun);
  std::string_view bytes = text.value();
  if (!bytes.starts_with(kind.mark))
    return no_checkpoint(path, "found no " + noun + " of a " + std::string(kind.of));
  bytes.remove_prefix(kind.mark.size());
  if (bytes.size() < kDigest) return no_checkpoint(path, "the " + noun + " is cut off");
  const std::string_view digest = bytes.substr(bytes.size() - kDigest);
  bytes.remove_suffix(kDigest);
  if (digest != digest_of(bytes))
    return no_checkpoint(path, "the " + noun + " is damaged: its checksum is another");
  std::uint32_t version = 0;
  if (bytes.size() < sizeof version) return no_checkpoint(path, "the " + noun + " is cut off");
  ArchiveReader a(bytes.substr(0, sizeof version));
  a(version);
  if (version != kind.version)
    return no_checkpoint(path, "found a " + noun + " of version " + std::to_string(version) +
                                   ", expected " + std::to_string(kind.version));
  return std::string(bytes.substr(sizeof version));
}

Error senseless_checkpoint(const std::string& path) {
  return no_checkpoint(path, "the checkpoint does not hold what it should");
}

}  // namespace sheaf
