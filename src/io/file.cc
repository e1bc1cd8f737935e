// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <future>
#include <new>
#include <optional>

#include "io/bal.h"
#include "io/bal_sink.h"
#include "io/byte_source.h"
#include "io/colmap.h"
#include "io/colmap_lens.h"
#include "io/format.h"
#include "io/line_cursor.h"
#include "io/output_file.h"
#include "io/output_folder.h"
#include "io/ply.h"
#include "io/sba.h"
#include "io/sha256.h"
#include "scene/camera_frame.h"
#include "scene/rigs.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Hashes a file beside the parser, over a descriptor of its own; empty when it cannot be read.
std::string hash_file(const fs::path& path) {
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

/// The format that a JSON text is of, told by what it holds.
Result<const FileFormat*> json_format(const JsonValue& root, const std::string& name) {
  for (const FileFormat& format : file_formats())
    if (format.is_json != nullptr && format.is_json(root)) return &format;
  const bool frames = root.find("frames") != nullptr;
  return Error(ErrorCode::unreadable_input,
               name + ":1: found JSON " +
                   (frames ? "of frames, as nerfstudio trains by, without points or observations"
                           : "of no format that is read") +
                   ", expected a file of one of these: " + readable_formats());
}

Result<Problem> parse(ByteSource& source, const fs::path& path, InputFile& file) {
  const Result<std::string_view> head = source.head();
  if (!head.ok()) return head.error();
  Result<const FileFormat*> format = sniff_format(head.value(), source.name());
  if (!format.ok()) return format.error();
  if (format.value() != nullptr && format.value()->parse == nullptr) {
    file.format = format.value()->name;
    return read_bal(source);
  }
  const Result<std::string> text = source.read_rest();
  if (!text.ok()) return text.error();
  std::optional<Result<JsonValue>> json;
  if (format.value() == nullptr) {
    json = parse_json(text.value(), source.name());
    if (!json->ok()) return json->error();
    format = json_format(json->value(), source.name());
    if (!format.ok()) return format.error();
  }
  file.format = format.value()->name;
  FolderFiles beside = files_in(path.has_parent_path() ? path.parent_path() : fs::path("."));
  return format.value()->parse({text.value(), source.name(), json ? &json->value() : nullptr,
                                std::move(beside), file.notes});
}

Result<InputFile> read_from(RawBytes raw, const fs::path& path, bool hash) {
  const auto start = std::chrono::steady_clock::now();
  InputFile file;
  // A pipe can be read only once: its bytes are hashed as they pass.
  Sha256 passing;
  std::future<std::string> hashing;  // waits for its thread wherever this function returns
  if (hash && raw.size()) hashing = std::async(std::launch::async, hash_file, path);
  if (hash && !raw.size()) raw.hash_into(&passing);

  Result<ByteSource> source = ByteSource::open(std::move(raw));
  if (!source.ok()) return source.error();
  Result<Problem> problem = parse(source.value(), path, file);
  if (!problem.ok()) return problem.error();
  file.problem = std::move(problem).value();
  file.compression = to_string(source.value().compression());
  file.bytes = source.value().raw().bytes_read();
  file.read_s = seconds_since(start);
  if (hashing.valid()) {
    file.sha256 = hashing.get();
  } else if (hash) {
    file.sha256 = passing.hex_digest();
  }
  return file;
}

std::string hash_of(std::initializer_list<const std::string*> parts) {
  Sha256 of_all;
  for (const std::string* part : parts) of_all.update(part->data(), part->size());
  return of_all.hex_digest();
}

Result<void> read_colmap(const fs::path& path, bool hash, InputFile& file) {
  const Result<ColmapFiles> files = load_colmap(path);
  if (!files.ok()) return files.error();
  Result<Problem> problem = parse_colmap(files.value());
  if (!problem.ok()) return problem.error();
  const ColmapFiles& f = files.value();
  file.problem = std::move(problem).value();
  file.format = f.text ? "colmap-text" : "colmap";
  file.bytes = f.bytes;
  if (hash) file.sha256 = hash_of({&f.cameras, &f.images, &f.points, &f.rigs, &f.frames});
  return {};
}

Result<void> read_sba(const SbaFiles& files, bool hash, InputFile& file) {
  Result<Problem> problem = parse_sba(files, file.notes);
  if (!problem.ok()) return problem.error();
  file.problem = std::move(problem).value();
  file.format = "sba";
  const auto& [cameras, points, calib] = files;
  file.bytes = cameras.text.size() + points.text.size() + calib.text.size();
  if (hash) file.sha256 = hash_of({&cameras.text, &points.text, &calib.text});
  return {};
}

/// A model of COLMAP, unless there is none and files of SBA are.
Result<InputFile> read_folder(const fs::path& path, bool hash) {
  const auto start = std::chrono::steady_clock::now();
  InputFile file;
  file.compression = to_string(Compression::none);
  std::optional<SbaFiles> sba;
  std::error_code ignored;
  if (!fs::exists(path / "cameras.bin", ignored) && !fs::exists(path / "cameras.txt", ignored)) {
    Result<std::optional<SbaFiles>> found = load_sba(path);
    if (!found.ok()) return found.error();
    sba = std::move(found).value();
  }
  const Result<void> done = sba ? read_sba(*sba, hash, file) : read_colmap(path, hash, file);
  if (!done.ok()) return done.error();
  file.read_s = seconds_since(start);
  return file;
}

/// The name without its compression, which is taken off.
fs::path strip_compression(fs::path path, Compression& compression) {
  compression = path.extension() == ".gz"    ? Compression::gzip
                : path.extension() == ".bz2" ? Compression::bzip2
                                             : Compression::none;
  return compression == Compression::none ? path : path.replace_extension();
}

Error out_of_memory(const fs::path& path) {
  return Error(ErrorCode::memory_limit, path.string() + ": not enough memory for this problem");
}

Error refused(const fs::path& path, const Error& error) {
  return error.code() == ErrorCode::usage
             ? Error(ErrorCode::usage, path.string() + ": " + error.what())
             : error;
}

Result<void> write_folder(const Problem& problem, const fs::path& path, bool text) {
  Result<OutputFolder> out = OutputFolder::create(path);
  if (!out.ok()) return out.error();
  if (auto r = put_model(problem, text, out.value()); !r.ok()) return r;
  return out.value().commit();
}

/// A file that could not be read back is not written.
Result<void> write_bal_file(const Problem& given, const fs::path& path) {
  if (given.num_images() == 0)
    return Error(ErrorCode::usage, path.string() + ": a BAL file needs at least one camera");
  Problem turned;
  const Result<const Problem*> problem = with_bal_cameras(given, turned);
  if (!problem.ok()) return refused(path, problem.error());
  Result<OutputFile> out = create_output(path);
  if (!out.ok()) return out.error();
  return write_bal(*problem.value(), out.value());
}

Result<void> write_as(const FileFormat& format, const Problem& problem, const fs::path& path) {
  const Result<FormatOutput> made = format.format(problem);
  if (!made.ok()) return refused(path, made.error());
  std::vector<OutputFile> files;
  Result<OutputFile> main = create_output(path);
  if (!main.ok()) return main.error();
  files.push_back(std::move(main).value());
  files.back().write(made.value().text);
  const SourceFiles* source = problem.metadata ? problem.metadata->source.get() : nullptr;
  for (const FormatFile& beside : made.value().beside) {
    const fs::path target = path.parent_path() / beside.name;
    std::error_code ignored;
    if (source != nullptr && fs::equivalent(source->beside, target, ignored) && !ignored)
      return Error(ErrorCode::unwritable_output,
                   target.string() +
                       ": would be written too, and the problem was read from it: name a file in "
                       "another folder");
    Result<OutputFile> file = create_output(target);
    if (!file.ok()) return file.error();
    files.push_back(std::move(file).value());
    files.back().write(beside.bytes);
  }
  for (OutputFile& file : files)
    if (Result<void> done = file.commit(); !done.ok()) return done;
  return {};
}

Result<void> write_ply_file(const Problem& problem, const fs::path& path) {
  Result<OutputFile> out = create_output(path);
  if (!out.ok()) return out.error();
  return write_ply(problem, out.value());
}

template <class Id>
bool occurs_twice(std::vector<Id> ids) {
  std::sort(ids.begin(), ids.end());
  return std::adjacent_find(ids.begin(), ids.end()) != ids.end();
}

/// What `read` would refuse: ids that occur twice, and names that end in their middle or begin a
/// line.
Result<void> check_names(const Problem& problem) {
  if (problem.metadata == nullptr) return {};
  const SceneMetadata& m = *problem.metadata;
  const auto usage = [](const std::string& text) { return Error(ErrorCode::usage, text); };
  if (occurs_twice(m.image_ids)) return usage("an image's id occurs twice in the metadata");
  if (occurs_twice(m.camera_ids)) return usage("a camera's id occurs twice in the metadata");
  if (occurs_twice(m.point_ids)) return usage("a point's id occurs twice in the metadata");
  for (std::size_t i = 0; i < m.image_names.size(); ++i)
    if (m.image_names[i].find_first_of(std::string_view("\0\n\r", 3)) != std::string::npos)
      return usage("the name of image " + std::to_string(i) + ", " +
                   sheaf::quoted(m.image_names[i]) + ", holds a zero byte or a line's end");
  return {};
}

/// The problem with the poses that frames and sensors give: itself, or a copy in `moved`.
const Problem& placed(const Problem& problem, Problem& moved) {
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    if (!in_rig(problem.rigs, i) || same_bits(pose_of(problem, i), problem.poses[i])) continue;
    moved = problem;
    place_images(moved);
    return moved;
  }
  return problem;
}

/// Whether COLMAP's binary form can say of the lens what it is.
bool is_numbered(const Camera& camera) {
  return camera.model == CameraModel::bal || colmap_lens(camera).has_value();
}

}  // namespace

Result<InputFile> read_file(const fs::path& path, const ReadOptions& options) {
  try {
    std::error_code ignored;
    if (fs::is_directory(path, ignored)) return read_folder(path, options.hash);
    Result<RawBytes> raw = RawBytes::open(path);
    if (!raw.ok()) return raw.error();
    return read_from(std::move(raw).value(), path, options.hash);
  } catch (const std::bad_alloc&) {
    return out_of_memory(path);
  }
}

Result<Problem> read(const fs::path& path) {
  Result<InputFile> file = read_file(path);
  if (!file.ok()) return file.error();
  return std::move(file.value().problem);
}

std::string write_format(const Problem& problem, const fs::path& path) {
  Compression compression;
  const std::string name = strip_compression(path, compression).filename().string();
  for (const FileFormat& format : file_formats())
    if (!format.ending.empty() && name.ends_with(format.ending)) return std::string(format.name);
  const std::string read_as =
      problem.metadata && problem.metadata->source ? problem.metadata->source->format : "";
  if (name.ends_with(".json")) {
    const FileFormat* own = format_named(read_as);
    return own != nullptr && own->is_json != nullptr ? read_as : "json";
  }
  const bool from_colmap = read_as.starts_with("colmap");
  std::error_code ignored;
  const bool folder = !path.empty() && (!path.has_filename() || fs::is_directory(path, ignored));
  if (!folder && !(from_colmap && path.extension().empty())) return "bal";
  if (from_colmap) return read_as;
  return std::all_of(problem.cameras.begin(), problem.cameras.end(), is_numbered) ? "colmap"
                                                                                  : "colmap-text";
}

Result<void> write(const Problem& given, const fs::path& path, const WriteOptions& options) {
  if (Result<void> valid = validate(given); !valid.ok()) return valid;
  if (Result<void> named = check_names(given); !named.ok()) return refused(path, named.error());
  Problem moved;
  const Problem& problem = placed(given, moved);
  const std::string format = options.format.empty() ? write_format(problem, path) : options.format;
  try {
    if (format == "colmap" || format == "colmap-text")
      return write_folder(problem, path, format == "colmap-text");
    if (format == "bal") return write_bal_file(problem, path);
    if (format == "ply") return write_ply_file(problem, path);
    const FileFormat* known = format_named(format);
    if (known != nullptr && known->format != nullptr) return write_as(*known, problem, path);
  } catch (const std::bad_alloc&) {
    return out_of_memory(path);
  }
  if (format == "json")
    return Error(ErrorCode::usage,
                 path.string() +
                     ": JSON may be OpenSfM's, OpenMVG's or nerfstudio's: name it "
                     "reconstruction.json, sfm_data.json or transforms.json, or "
                     "say which (convert --format)");
  std::string names = "colmap, colmap-text, bal and ply";
  for (const FileFormat& known : file_formats())
    if (known.format != nullptr) names = std::string(known.name) + ", " + names;
  return Error(ErrorCode::usage, "Sheaf writes " + names + ", not '" + format + "'");
}

Result<void> put_model(const Problem& given, bool text, OutputFolder& out) {
  if (Result<void> valid = validate(given); !valid.ok()) return valid;
  if (Result<void> named = check_names(given); !named.ok())
    return refused(out.shown(), named.error());
  Problem moved;
  const Result<ColmapFiles> files = format_colmap(placed(given, moved), text);
  if (!files.ok()) return refused(out.shown(), files.error());
  return put_colmap(files.value(), out);
}

Result<OutputFile> create_output(const fs::path& path) {
  Compression compression;
  strip_compression(path, compression);
  return OutputFile::create(path, compression);
}

Result<void> check_writable(const fs::path& path, bool model) {
  // Opening a pipe would wait for its reader, and closing it would end what that reads.
  std::error_code ignored;
  if (fs::is_fifo(path, ignored)) return {};
  if (model && (fs::is_directory(path, ignored) || (!path.empty() && !path.has_filename()))) {
    const Result<OutputFolder> out = OutputFolder::create(path);
    if (!out.ok()) return out.error();
    return {};
  }
  Result<OutputFile> out = OutputFile::create(path, Compression::none);
  if (!out.ok()) return out.error();
  return {};
}

Result<void> write_ply(const Problem& before, const Problem& after, const fs::path& path) {
  for (const Problem* problem : {&before, &after})
    if (Result<void> valid = validate(*problem); !valid.ok()) return valid;
  try {
    Result<OutputFile> out = create_output(path);
    if (!out.ok()) return out.error();
    return write_ply(before, after, out.value());
  } catch (const std::bad_alloc&) {
    return out_of_memory(path);
  }
}

}  // namespace sheaf
