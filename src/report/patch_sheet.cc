// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/patch_sheet.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "chart/svg_file.h"
#include "image/png.h"
#include "report/palette.h"

namespace sheaf {
namespace {

constexpr int kMargin = 24, kTop = 112, kFoot = 100;
constexpr int kCell = 48, kPair = 2 * kCell + 4, kPairGap = 20;
constexpr int kWords = 170;  // left of the reference
constexpr int kLine = 24;    // text and what is below it
constexpr int kRow = 3 * kLine + 2 * kCell + 24;
constexpr int kLeastWidth = 1080;
constexpr std::size_t kMostImages = 8;
constexpr double kLeastRange = 24, kLeastScale = 4;  // grey levels

std::string number(double x) {
  char text[32];
  if (std::isnan(x)) return "-";
  std::snprintf(text, sizeof text, x < 99.95 ? "%.1f" : "%.0f", x);
  return text;
}

/// A patch in an image, in both stages.
struct Column {
  std::uint32_t image;
  PatchGreys before, after;
};

struct Row {
  PatchFit fit;
  std::vector<Column> columns;
  std::size_t left_out = 0;  ///< images that show the patch and are not drawn
  double low = 0, high = 0;  ///< grey levels drawn black and white
};

/// The images that show the point before or after.
std::vector<std::uint32_t> images_of(const PatchComparison& comparison, std::uint32_t point) {
  std::vector<std::uint32_t> images;
  for (const PatchStage* stage : {&comparison.before, &comparison.after}) {
    const auto first = std::partition_point(stage->seen.begin(), stage->seen.end(),
                                            [&](const PatchSight& s) { return s.point < point; });
    for (auto sight = first; sight != stage->seen.end() && sight->point == point; ++sight)
      images.push_back(sight->image);
  }
  std::sort(images.begin(), images.end());
  images.erase(std::unique(images.begin(), images.end()), images.end());
  return images;
}

std::vector<double> reference_of(const PatchScene& scene, std::uint32_t point) {
  std::vector<double> greys;
  for (const std::uint32_t cell : scene.grid.place)
    greys.push_back(scene.references[scene.grid.cells() * point + cell]);
  return greys;
}

Row make_row(const PatchComparison& comparison, const PatchFit& fit) {
  Row row{fit, {}, 0, 0, 0};
  std::vector<std::uint32_t> images = images_of(comparison, fit.point);
  if (images.size() > kMostImages) {
    row.left_out = images.size() - kMostImages;
    images.resize(kMostImages);
  }
  std::vector<double> all = reference_of(comparison.scene, fit.point);
  for (const std::uint32_t image : images) {
    const Sight sight{fit.point, image};
    Column column{image, greys_of(comparison.scene, comparison.before, sight),
                  greys_of(comparison.scene, comparison.after, sight)};
    all.insert(all.end(), column.after.grey.begin(), column.after.grey.end());
    row.columns.push_back(std::move(column));
  }
  const auto [least, most] = std::minmax_element(all.begin(), all.end());
  const double spare = std::max(0.0, kLeastRange - (*most - *least)) / 2;
  row.low = *least - spare, row.high = *most + spare;
  return row;
}

/// The size of residual that nine in ten of those drawn stay below.
double residual_scale(const std::vector<Row>& rows) {
  std::vector<double> sizes;
  for (const Row& row : rows)
    for (const Column& column : row.columns)
      for (const PatchGreys* greys : {&column.before, &column.after})
        for (double r : greys->residual) sizes.push_back(std::abs(r));
  if (sizes.empty()) return kLeastScale;
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(0.9 * double(sizes.size() - 1));
  std::nth_element(sizes.begin(), at, sizes.end());
  return std::max(kLeastScale, std::ceil(*at));
}

double rms(const std::vector<double>& residuals) {
  if (residuals.empty()) return std::nan("");
  double sum = 0;
  for (double r : residuals) sum += r * r;
  return std::sqrt(sum / static_cast<double>(residuals.size()));
}

class Sheet {
 public:
  Sheet(const PatchComparison& comparison, const std::vector<PatchFit>& fits)
      : scene_(comparison.scene) {
    for (const PatchFit& fit : fits) rows_.push_back(make_row(comparison, fit));
    scale_ = residual_scale(rows_);
    zoom_ = std::max(1, kCell / std::max(scene_.grid.width, scene_.grid.rows));
  }

  Result<PatchSheet> draw(const std::string& title) {
    std::size_t most = 0;
    for (const Row& row : rows_) most = std::max(most, row.columns.size());
    const int columns = static_cast<int>(most), rows = static_cast<int>(rows_.size());
    const int width =
        std::max(kLeastWidth, 2 * kMargin + kWords + kPair + columns * (kPair + kPairGap));
    const int height = kTop + rows * kRow + kFoot;
    PatchSheet sheet;
    sheet.image = Image(width, kTop + rows * kRow, kPaper);
    for (int i = 0; i < rows; ++i) draw_row(rows_[std::size_t(i)], kTop + i * kRow, sheet);
    const Result<std::string> png = encode_png(sheet.image);
    if (!png.ok()) return png.error();
    Drawing out;
    out.picture(0, 0, width, sheet.image.height, png.value());
    out.text(kMargin, 44, title, "h");
    out.text(kMargin, 78,
             "the reference, then what the images show (their brightness taken out), beside it",
             "m");
    out.text(kMargin, 98, "the residuals; greys in brackets are black and white", "m");
    out.raw(words_.content());
    const Result<void> bar =
        draw_colour_bar(out, kMargin, kTop + rows * kRow + 12, signed_shade, -1, 1,
                        "−" + number(scale_), "+" + number(scale_), "residual, grey levels");
    if (!bar.ok()) return bar.error();
    sheet.svg = svg_file(out, width, height, title);
    return sheet;
  }

 private:
  /// (x, y): the top left corner of the letters.
  void say(int x, int y, const std::string& text, const char* classes = "") {
    words_.text(x, y + 14, text, classes);
  }

  void draw_row(const Row& row, int y, PatchSheet& sheet) {
    words_.path("M" + std::to_string(kMargin) + " " + std::to_string(y) + ".5H" +
                    std::to_string(sheet.image.width - kMargin),
                "gr");
    const int first = y + 8 + kLine, second = first + kCell + kLine;
    const std::uint32_t point = row.fit.point;
    say(kMargin, y + 8, "point " + std::to_string(point), "b");
    say(kMargin, first + 4, "before: rms", "m");
    say(kMargin, first + 26, number(row.fit.before));
    say(kMargin, second + 4, "after: rms", "m");
    say(kMargin, second + 26, number(row.fit.after), "b");
    const int x = kMargin + kWords;
    say(x, y + 8, scene_.has_rays() ? "host " + std::to_string(scene_.host[point]) : "stored");
    SheetCell cell{point, 0, SheetCell::Kind::reference, x, first, zoom_, row.low, row.high};
    draw_greys(reference_of(scene_, point), cell, sheet);
    say(x, first + kCell + 4,
        "(" + std::to_string(std::lround(row.low)) + "–" + std::to_string(std::lround(row.high)) +
            ")",
        "m");
    for (std::size_t c = 0; c < row.columns.size(); ++c)
      draw_column(row, row.columns[c], x + (static_cast<int>(c) + 1) * (kPair + kPairGap), y,
                  sheet);
    if (row.left_out > 0) say(x, second + 4, "+" + std::to_string(row.left_out) + " more", "m");
  }

  void draw_column(const Row& row, const Column& column, int x, int y, PatchSheet& sheet) {
    const int first = y + 8 + kLine, second = first + kCell + kLine;
    say(x, y + 8, "image " + std::to_string(column.image));
    SheetCell cell{row.fit.point, column.image, SheetCell::Kind::before, x, first, zoom_,
                   row.low,       row.high};
    draw_seen(column.before, cell, sheet);
    cell.kind = SheetCell::Kind::after;
    cell.y = second;
    draw_seen(column.after, cell, sheet);
  }

  /// Grey levels and residuals side by side, with the rms below.
  void draw_seen(const PatchGreys& seen, const SheetCell& cell, PatchSheet& sheet) {
    if (seen.grey.empty()) {
      words_.rectangle(cell.x, cell.y, kPair, kCell, "mx");
      say(cell.x + 6, cell.y + kCell / 2 - 9, "not seen", "m");
      return;
    }
    draw_greys(seen.grey, cell, sheet);
    for (std::size_t k = 0; k < seen.residual.size(); ++k)
      fill_pixel(k, cell.x + kCell + 4, cell, signed_shade(seen.residual[k] / scale_), sheet.image);
    say(cell.x, cell.y + kCell + 4, number(rms(seen.residual)));
  }

  void draw_greys(const std::vector<double>& greys, const SheetCell& cell, PatchSheet& sheet) {
    for (std::size_t k = 0; k < greys.size(); ++k)
      fill_pixel(k, cell.x, cell, grey_shade(255 * (greys[k] - cell.low) / (cell.high - cell.low)),
                 sheet.image);
    words_.rectangle(cell.x, cell.y, cell.zoom * scene_.grid.width, cell.zoom * scene_.grid.rows,
                     "mx");
    sheet.cells.push_back(cell);
  }

  void fill_pixel(std::size_t k, int left, const SheetCell& cell, Color color, Image& image) const {
    const PatchGrid& grid = scene_.grid;
    const std::uint32_t at = grid.place[k];
    const int x = left + cell.zoom * (static_cast<int>(grid.dx[at]) - grid.left);
    const int y = cell.y + cell.zoom * (static_cast<int>(grid.dy[at]) - grid.top);
    for (int v = y; v < y + cell.zoom; ++v)
      for (int u = x; u < x + cell.zoom; ++u)
        if (image.contains(u, v)) image.set(u, v, color);
  }

  Drawing words_;
  const PatchScene& scene_;
  std::vector<Row> rows_;
  double scale_ = 1;
  int zoom_ = 1;
};

}  // namespace

Result<PatchSheet> draw_patch_sheet(const PatchComparison& comparison,
                                    const std::vector<PatchFit>& rows, const std::string& title) {
  return Sheet(comparison, rows).draw(title);
}

}  // namespace sheaf
