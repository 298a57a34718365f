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

/// A calibration board, as it is printed: counted in inner corners, between squares.
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
    v(ParamDoc{"marker_ratio", {0.3, 0.9}, "edge of a ChArUco marker by that of a square (dictionary 4x4)"},
      self.marker_ratio);
  }
};

/// A ChArUco board has at most so many squares: its markers come from a dictionary.
inline constexpr int kMostCharucoMarkers = 1000;
Result<void> check_params(const BoardParams& board);

/// An inner corner on the board: x along a row, y along a column, from the first corner; z = 0. Metres.
Vec3 corner_on_board(const BoardParams& board, int index);

/// The board as a picture, `square_px` pixels a square with a margin of half a square of white around it.
Image<std::uint8_t> draw_board(const BoardParams& board, int square_px);

/// Corners of a board seen in a picture.
struct BoardView {
  std::vector<int> corners;  ///< indices of inner corners, row by row, increasing
  std::vector<Vec2> pixels;  ///< where each is seen
  [[nodiscard]] std::size_t size() const { return corners.size(); }
};

/// Why no board was found in a picture.
enum class BoardSearch { kFound, kNotFound, kTooFewCorners, kFailed };

struct BoardDetection {
  BoardSearch search = BoardSearch::kNotFound;
  BoardView view;       ///< empty unless found
  std::string details;  ///< of the library, when it failed
};

/// Looks for the board (OpenCV), corners to a fraction of a pixel. A checkerboard must be seen whole, a
/// ChArUco board at least in part. A checkerboard that looks the same turned by half a turn may be numbered
/// from either end. Thread safe.
BoardDetection find_board(const Image<Rgb8>& picture, const BoardParams& board);

/// The same corners numbered from the other end of a checkerboard.
BoardView turned_by_half(const BoardView& view, const BoardParams& board);

}  // namespace hm
