// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// A flat, rigid board of corners in rows and columns. Corner k stands at
/// ((k % columns) spacing, (k / columns) spacing, 0) in the board's own frame.
struct Board {
  std::uint32_t columns = 0, rows = 0;
  double spacing = 1;  ///< between neighbours: the unit of all lengths
};

/// The corners of a board that one image shows.
struct BoardView {
  std::string image;
  std::vector<std::uint32_t> corners;     ///< by their numbers on the board
  std::vector<std::array<double, 2>> xy;  ///< px; (0.5, 0.5) is the centre of the first pixel
  std::vector<double> sigma;              ///< px
};

/// Views from a list of corners: lines of image, x, y and, where there is a fourth column, the
/// level of the image pyramid at which the corner was found (its sigma is 2^level px); `-` in the
/// place of numbers is a corner that was not found. The corners of an image follow one another by
/// rows of the board, all of them. Comments begin with #. In the file (0, 0) is the centre of the
/// first pixel. Errors: unreadable_input with file and line.
Result<std::vector<BoardView>> read_board_corners(const std::string& path, const Board& board);

/// A calibration as a problem: one lens for all views, the board's corners as points, which are to
/// be held in the solve, and cam_from_board as the pose of each view. The start is a homography of
/// each view. `lens` states the model and the size of the images; its focal length, where it is 0,
/// is the one of a geometric ladder that fits best, with the principal point in the middle and no
/// distortion. Views of fewer than six corners, or whose corners stand in a line, have no start:
/// they are left out, and `left_out` names them. Errors: usage for a board, a lens or views that
/// cannot be.
Result<Problem> calibration_of(const Board& board, const std::vector<BoardView>& views,
                               const Camera& lens, std::vector<std::string>* left_out = nullptr);

}  // namespace sheaf
