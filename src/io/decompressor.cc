// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/decompressor.h"

#include <algorithm>

namespace sheaf {
namespace {

constexpr int kGzipWindowBits = 15 + 16;        // zlib: the largest window, a gzip header
constexpr std::size_t kLargestPiece = 1 << 30;  // both libraries count in 32 bits

}  // namespace

const char* to_string(Compression compression) {
  switch (compression) {
    case Compression::gzip:
      return "gzip";
    case Compression::bzip2:
      return "bzip2";
    case Compression::none:
      break;
  }
  return "none";
}

void Decompressor::begin_member() {
  end_member();
  produced_ = 0;
  if (compression_ == Compression::gzip) {
    zlib_ = {};
    open_ = inflateInit2(&zlib_, kGzipWindowBits) == Z_OK;
  } else {
    bzip2_ = {};
    open_ = BZ2_bzDecompressInit(&bzip2_, 0, 0) == BZ_OK;
  }
}

void Decompressor::end_member() {
  if (!open_) return;
  if (compression_ == Compression::gzip) {
    inflateEnd(&zlib_);
  } else {
    BZ2_bzDecompressEnd(&bzip2_);
  }
  open_ = false;
}

Decompressor::Progress Decompressor::advance(std::string_view input, char* output,
                                             std::size_t capacity) {
  if (!open_) return {0, 0, State::failed};
  input = input.substr(0, kLargestPiece);
  capacity = std::min(capacity, kLargestPiece);
  const Progress progress = compression_ == Compression::gzip
                                ? advance_gzip(input, output, capacity)
                                : advance_bzip2(input, output, capacity);
  produced_ += progress.produced;
  if (progress.state == State::member_ended) end_member();
  return progress;
}

Decompressor::Progress Decompressor::advance_gzip(std::string_view input, char* output,
                                                  std::size_t capacity) {
  zlib_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(input.data()));
  zlib_.avail_in = static_cast<uInt>(input.size());
  zlib_.next_out = reinterpret_cast<Bytef*>(output);
  zlib_.avail_out = static_cast<uInt>(capacity);
  const int code = inflate(&zlib_, Z_NO_FLUSH);
  const bool good = code == Z_OK || code == Z_BUF_ERROR;
  return {input.size() - zlib_.avail_in, capacity - zlib_.avail_out,
          code == Z_STREAM_END ? State::member_ended
          : good               ? State::running
                               : State::failed};
}

Decompressor::Progress Decompressor::advance_bzip2(std::string_view input, char* output,
                                                   std::size_t capacity) {
  bzip2_.next_in = const_cast<char*>(input.data());
  bzip2_.avail_in = static_cast<unsigned>(input.size());
  bzip2_.next_out = output;
  bzip2_.avail_out = static_cast<unsigned>(capacity);
  const int code = BZ2_bzDecompress(&bzip2_);
  return {input.size() - bzip2_.avail_in, capacity - bzip2_.avail_out,
          code == BZ_STREAM_END ? State::member_ended
          : code == BZ_OK       ? State::running
                                : State::failed};
}

}  // namespace sheaf
