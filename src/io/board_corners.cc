// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <charconv>
#include <cmath>
#include <set>

#include "io/byte_source.h"
#include "io/line_cursor.h"
#include "sheaf/board.h"

namespace sheaf {
namespace {

/// From a file that gives the centre of the first pixel (0, 0).
constexpr double kToCorner_px = 0.5;
constexpr int kDeepest = 30;

/// Lines of corners into views; an image's corners are counted along the board.
class CornerLines {
 public:
  CornerLines(std::string_view text, const std::string& name, const Board& board)
      : lines_(text, name), board_(board) {}

  Result<std::vector<BoardView>> read() {
    while (lines_.next_record()) {
      std::string_view word;
      lines_.read_word(word);
      if (views_.empty() || word != views_.back().image)
        if (const Result<void> begun = begin_view(std::string(word)); !begun.ok())
          return begun.error();
      if (const Result<void> read = read_corner(); !read.ok()) return read.error();
    }
    if (const Result<void> whole = end_view(); !whole.ok()) return whole.error();
    if (views_.empty()) return lines_.refuse_at(1, "found no corner, expected IMAGE X Y [LEVEL]");
    return std::move(views_);
  }

 private:
  std::uint32_t all() const { return board_.columns * board_.rows; }

  Result<void> begin_view(std::string image) {
    if (const Result<void> whole = end_view(); !whole.ok()) return whole;
    if (!names_.insert(image).second)
      return lines_.refuse_as("found image " + image +
                              " again, expected its corners to follow one another");
    views_.emplace_back().image = std::move(image);
    next_ = 0;
    missing_ = false;
    return {};
  }

  /// All corners, or one line without any for an image that shows none.
  Result<void> end_view() const {
    if (views_.empty() || next_ == all() || (next_ == 1 && missing_)) return {};
    return lines_.refuse_as("found " + std::to_string(next_) + " corners of image " +
                            views_.back().image + ", expected the board's " +
                            std::to_string(all()));
  }

  Result<void> read_corner() {
    BoardView& view = views_.back();
    if (next_ == all())
      return lines_.refuse_as("found more corners of image " + view.image + " than the board's " +
                              std::to_string(all()));
    std::string_view x_word, y_word, level_word;
    if (!lines_.read_word(x_word) || !lines_.read_word(y_word))
      return lines_.refuse("X and Y, or - of a corner that was not found");
    const bool has_level = lines_.read_word(level_word);
    const std::uint32_t corner = next_++;
    missing_ = x_word == "-" || y_word == "-" || level_word == "-" || level_word == "-1";
    if (missing_) return {};
    std::array<double, 2> xy{};
    if (!number(x_word, xy[0]) || !number(y_word, xy[1]))
      return lines_.refuse_as("found '" + std::string(x_word) + " " + std::string(y_word) +
                              "', expected the numbers X and Y");
    double level = 0;
    if (has_level && (!number(level_word, level) || level < 0 || level > kDeepest))
      return lines_.refuse_as("found '" + std::string(level_word) +
                              "', expected a level from 0 to " + std::to_string(kDeepest));
    view.corners.push_back(corner);
    view.xy.push_back({xy[0] + kToCorner_px, xy[1] + kToCorner_px});
    view.sigma.push_back(std::exp2(level));
    return {};
  }

  static bool number(std::string_view word, double& value) {
    const auto [end, wrong] = std::from_chars(word.data(), word.data() + word.size(), value);
    return wrong == std::errc() && end == word.data() + word.size() && std::isfinite(value);
  }

  LineCursor lines_;
  const Board& board_;
  std::vector<BoardView> views_;
  std::set<std::string> names_;
  std::uint32_t next_ = 0;
  bool missing_ = false;
};

}  // namespace

Result<std::vector<BoardView>> read_board_corners(const std::string& path, const Board& board) {
  const Result<std::string> text = read_text(path);
  if (!text.ok()) return text.error();
  return CornerLines(text.value(), path, board).read();
}

}  // namespace sheaf
