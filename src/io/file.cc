// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <new>
#include <thread>

#include "io/bal.h"
#include "io/bal_sink.h"
#include "io/byte_source.h"
#include "io/output_file.h"
#include "io/ply.h"
#include "io/sha256.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Hashes a file beside the parser, over a descriptor of its own; empty when it cannot be read.
std::string hash_file(const std::filesystem::path& path) {
  Result<RawBytes> raw = RawBytes::open(path);
  if (!raw.ok()) return {};
  Sha256 hash;
  std::vector<char> block(1 << 17);
  for (;;) {
    const Result<std::size_t> n = raw.value().read(block.data(), block.size());
    if (!n.ok()) return {};
    hash.update(block.data(), n.value());
    if (n.value() < block.size()) return hash.hex_digest();
  }
}

Result<InputFile> read_from(RawBytes raw, const std::filesystem::path& path, bool hash) {
  const auto start = std::chrono::steady_clock::now();
  InputFile file;
  file.format = "bal";
  // A pipe can be read only once: its bytes are hashed as they pass.
  Sha256 passing;
  std::jthread hashing;
  if (hash && raw.size()) hashing = std::jthread([&file, &path] { file.sha256 = hash_file(path); });
  if (hash && !raw.size()) raw.hash_into(&passing);

  Result<ByteSource> source = ByteSource::open(std::move(raw));
  if (!source.ok()) return source.error();
  Result<Problem> problem = read_bal(source.value());
  if (!problem.ok()) return problem.error();
  file.problem = std::move(problem).value();
  file.compression = to_string(source.value().compression());
  file.bytes = source.value().raw().bytes_read();
  file.read_s = seconds_since(start);
  if (hashing.joinable()) {
    hashing.join();
  } else if (hash) {
    file.sha256 = passing.hex_digest();
  }
  return file;
}

/// The name without its compression, which is taken off.
std::filesystem::path strip_compression(std::filesystem::path path, Compression& compression) {
  compression = path.extension() == ".gz"    ? Compression::gzip
                : path.extension() == ".bz2" ? Compression::bzip2
                                             : Compression::none;
  return compression == Compression::none ? path : path.replace_extension();
}

Error out_of_memory(const std::filesystem::path& path) {
  return Error(ErrorCode::memory_limit, path.string() + ": not enough memory for this problem");
}

/// BAL needs one of each; a file that could not be read back is not written.
Result<void> check_bal(const Problem& problem, const std::filesystem::path& path) {
  if (problem.num_images() > 0 && problem.num_points() > 0 && problem.num_observations() > 0)
    return {};
  return Error(ErrorCode::usage, path.string() +
                                     ": a BAL file needs at least one camera, one point and one "
                                     "observation");
}

}  // namespace

Result<InputFile> read_file(const std::filesystem::path& path, const ReadOptions& options) {
  Result<RawBytes> raw = RawBytes::open(path);
  if (!raw.ok()) return raw.error();
  try {
    return read_from(std::move(raw).value(), path, options.hash);
  } catch (const std::bad_alloc&) {
    return out_of_memory(path);
  }
}

Result<Problem> read(const std::filesystem::path& path) {
  Result<InputFile> file = read_file(path);
  if (!file.ok()) return file.error();
  return std::move(file.value().problem);
}

Result<void> write(const Problem& problem, const std::filesystem::path& path) {
  if (Result<void> valid = validate(problem); !valid.ok()) return valid;
  Compression compression;
  const bool ply = strip_compression(path, compression).extension() == ".ply";
  if (!ply)
    if (Result<void> fit = check_bal(problem, path); !fit.ok()) return fit;
  try {
    Result<OutputFile> out = OutputFile::create(path, compression);
    if (!out.ok()) return out.error();
    return ply ? write_ply(problem, out.value()) : write_bal(problem, out.value());
  } catch (const std::bad_alloc&) {
    return out_of_memory(path);
  }
}

Result<OutputFile> create_output(const std::filesystem::path& path) {
  Compression compression;
  strip_compression(path, compression);
  return OutputFile::create(path, compression);
}

Result<void> check_writable(const std::filesystem::path& path) {
  // Opening a pipe would wait for its reader, and closing it would end what that reads.
  std::error_code ignored;
  if (std::filesystem::is_fifo(path, ignored)) return {};
  Result<OutputFile> out = OutputFile::create(path, Compression::none);
  if (!out.ok()) return out.error();
  return {};
}

Result<void> write_ply(const Problem& before, const Problem& after,
                       const std::filesystem::path& path) {
  for (const Problem* problem : {&before, &after})
    if (Result<void> valid = validate(*problem); !valid.ok()) return valid;
  Compression compression;
  strip_compression(path, compression);
  try {
    Result<OutputFile> out = OutputFile::create(path, compression);
    if (!out.ok()) return out.error();
    return write_ply(before, after, out.value());
  } catch (const std::bad_alloc&) {
    return out_of_memory(path);
  }
}

}  // namespace sheaf
