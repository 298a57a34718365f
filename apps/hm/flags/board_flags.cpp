#include "flags/board_flags.hpp"

#include <cstdio>

#include "hm/pipeline/calibrate/calibration_set.hpp"
#include "program.hpp"

void BoardFlags::add_to(Command command) {
  const auto group = "Board (default: board.toml of the images, else 9x6 corners of 0.1 m)";
  command.add_option("--board", kind, "checkerboard or charuco")
      .one_of({"checkerboard", "charuco"})
      .group(group);
  command.add_option("--corners", corners, "inner corners, between squares: 8x6").group(group);
  command.add_option("--square", square_m, "edge of a square in metres").above_zero().group(group);
}

hm::Result<void> BoardFlags::apply(const std::filesystem::path& folder, hm::BoardParams& board) const {
  if (const auto read = hm::read_board_of(folder, board); !read) return hm::forward_error(read);
  if (kind == "checkerboard") board.kind = hm::BoardKind::kCheckerboard;
  if (kind == "charuco") board.kind = hm::BoardKind::kCharuco;
  if (square_m > 0) board.square_m = square_m;
  if (corners.empty()) return {};
  int end = 0;
  if (std::sscanf(corners.c_str(), "%dx%d%n", &board.corners_x, &board.corners_y, &end) != 2 ||
      static_cast<std::size_t>(end) != corners.size() || board.corners_x < 3 || board.corners_y < 3 ||
      board.corners_x > 50 || board.corners_y > 50)
    return hm::fail(hm::ErrorCode::kUsage, "--corners", "`{}` is not like 8x6, each from 3 to 50", corners);
  return {};
}
