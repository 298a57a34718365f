#pragma once
#include <optional>
#include <string_view>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

enum class BoardKind { kCheckerboard, kCharuco };
inline constexpr std::string_view kBoardKindNames[] = {"checkerboard", "charuco"};

/// Printed calibration board; its size is counted in inner corners, i.e. between squares.
struct BoardParams {
  BoardKind kind = BoardKind::kCheckerboard;
  int corners_x = 9;
  int corners_y = 6;
  double square_m = 0.1;
  double marker_ratio = 0.75;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"kind", {}, "pattern of the calibration board", ParamLevel::kBasic}, self.kind,
      kBoardKindNames);
    v(ParamDoc{"corners_x", {3, 50}, "inner corners of the board along a row", ParamLevel::kBasic},
      self.corners_x);
    v(ParamDoc{"corners_y", {3, 50}, "inner corners of the board along a column", ParamLevel::kBasic},
      self.corners_y);
    v(ParamDoc{"square_m", {0.001, 2}, "edge of a square of the board", ParamLevel::kBasic}, self.square_m);
    v(ParamDoc{"marker_ratio",
               {0.3, 0.9},
               "edge of a ChArUco marker as a ratio of the square's edge (dictionary 4x4)"},
      self.marker_ratio);
  }
};

/// Largest number of markers of a ChArUco board, limited by the marker dictionary.
inline constexpr int kMostCharucoMarkers = 1000;
Result<void> check_params(const BoardParams& board);

/// Position of an inner corner in the board frame, metres: x along a row, y along a column, from the first
/// corner; z = 0.
Vec3 corner_on_board(const BoardParams& board, int index);

/// Draws the board with `square_px` pixels per square and a white margin of half a square.
Image<std::uint8_t> draw_board(const BoardParams& board, int square_px);

/// Corners of a board detected in an image.
struct BoardView {
  std::vector<int> corners;  ///< indices of inner corners, row by row, increasing
  std::vector<Vec2> pixels;  ///< position of each corner
  [[nodiscard]] std::size_t size() const { return corners.size(); }
};

/// Outcome of the search for a board in an image.
enum class BoardSearch { kFound, kNotFound, kTooFewCorners, kFailed };

struct BoardDetection {
  BoardSearch search = BoardSearch::kNotFound;
  BoardView view;       ///< empty unless found
  std::string details;  ///< message of OpenCV if it failed
};

/// Detects the board with subpixel corners (OpenCV). A checkerboard must be completely visible, a ChArUco
/// board at least partly. A checkerboard that is symmetric under rotation by 180 degrees may be numbered from
/// either end. Thread safe.
BoardDetection find_board(const Image<Rgb8>& picture, const BoardParams& board);

/// Renumbers the corners from the other end of a checkerboard.
BoardView turned_by_half(const BoardView& view, const BoardParams& board);

}  // namespace hm
