#include "hm/calibration/board.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hm {
namespace {

Image<Rgb8> as_color(const Image<std::uint8_t>& gray, int border) {
  Image<Rgb8> color(gray.width() + 2 * border, gray.height() + 2 * border, {255, 255, 255});
  for (int y = 0; y < gray.height(); ++y)
    for (int x = 0; x < gray.width(); ++x)
      color(x + border, y + border) = {gray(x, y), gray(x, y), gray(x, y)};
  return color;
}

/// Corners of a drawn board are found at their drawn positions, on edges between pixels.
TEST(Board, CheckerboardCornersAreWhereTheyWereDrawn) {
  const BoardParams board{BoardKind::kCheckerboard, 8, 5, 0.03, 0.75};
  const int square = 24, border = 30;
  const auto found = find_board(as_color(draw_board(board, square), border), board);
  ASSERT_EQ(found.search, BoardSearch::kFound);
  ASSERT_EQ(found.view.size(), 40u);
  for (std::size_t i = 0; i < 40; ++i) {
    const Vec2 wanted(border + square * (1.5 + found.view.corners[i] % 8) - 0.5,
                      border + square * (1.5 + found.view.corners[i] / 8) - 0.5);
    // From either end: an 8 x 5 board rotated by 180 degrees differs only in colours.
    const Vec2 turned(border + square * (8.5 - found.view.corners[i] % 8) - 0.5,
                      border + square * (5.5 - found.view.corners[i] / 8) - 0.5);
    EXPECT_LT(std::min((found.view.pixels[i] - wanted).norm(), (found.view.pixels[i] - turned).norm()), 0.05)
        << i;
  }
}

TEST(Board, CharucoIsFoundInPart) {
  const BoardParams board{BoardKind::kCharuco, 6, 4, 0.04, 0.75};
  const int square = 40, border = 30;
  Image<Rgb8> picture = as_color(draw_board(board, square), border);
  const auto whole = find_board(picture, board);
  ASSERT_EQ(whole.search, BoardSearch::kFound);
  EXPECT_EQ(whole.view.size(), 24u);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width() / 3; ++x) picture(x, y) = {128, 128, 128};
  const auto part = find_board(picture, board);
  ASSERT_EQ(part.search, BoardSearch::kFound);
  EXPECT_LT(part.view.size(), 24u);
  for (std::size_t i = 0; i < part.view.size(); ++i) {
    std::size_t same = 0;
    while (whole.view.corners[same] != part.view.corners[i]) ++same;
    EXPECT_LT((part.view.pixels[i] - whole.view.pixels[same]).norm(), 0.3);
  }
  const BoardParams checkerboard{BoardKind::kCheckerboard, 8, 5, 0.04, 0.75};
  EXPECT_EQ(find_board(as_color(draw_board(checkerboard, 30), 20), board).search, BoardSearch::kNotFound);
}

TEST(Board, NothingIsFoundWhereThereIsNothing) {
  const BoardParams board;
  EXPECT_EQ(find_board(Image<Rgb8>(320, 240, {90, 90, 90}), board).search, BoardSearch::kNotFound);
  EXPECT_EQ(find_board(Image<Rgb8>(), board).search, BoardSearch::kNotFound);
  EXPECT_NE(find_board(Image<Rgb8>(3, 2), board).search, BoardSearch::kFound);
}

TEST(Board, TurnedTwiceIsTheSame) {
  const BoardParams board{BoardKind::kCheckerboard, 4, 3, 0.1, 0.75};
  BoardView view;
  for (int i = 0; i < 12; ++i) view.corners.push_back(i), view.pixels.emplace_back(i, 2 * i);
  const BoardView turned = turned_by_half(view, board);
  EXPECT_EQ(turned.corners.front(), 0);
  EXPECT_EQ(turned.pixels.front(), view.pixels.back());
  const BoardView back = turned_by_half(turned, board);
  EXPECT_EQ(back.corners, view.corners);
  EXPECT_EQ(back.pixels, view.pixels);
}

TEST(Board, TooManyMarkersAreRefused) {
  EXPECT_FALSE(check_params({BoardKind::kCharuco, 50, 50, 0.01, 0.75}));
  EXPECT_TRUE(check_params({BoardKind::kCharuco, 12, 9, 0.01, 0.75}));
}

}  // namespace
}  // namespace hm
