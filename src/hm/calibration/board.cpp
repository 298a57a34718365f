#include "hm/calibration/board.hpp"

#include <algorithm>
#include <numeric>

#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace hm {
namespace {

constexpr int kDictionary = cv::aruco::DICT_4X4_1000;

cv::Ptr<cv::aruco::CharucoBoard> charuco_board(const BoardParams& board) {
  return cv::aruco::CharucoBoard::create(board.corners_x + 1, board.corners_y + 1,
                                         static_cast<float>(board.square_m),
                                         static_cast<float>(board.square_m * board.marker_ratio),
                                         cv::aruco::getPredefinedDictionary(kDictionary));
}

cv::Mat gray_of(const Image<Rgb8>& picture) {
  // OpenCV does not write to what it reads; its Mat has no const form.
  const cv::Mat color(picture.height(), picture.width(), CV_8UC3, const_cast<Rgb8*>(picture.data()));
  cv::Mat gray;
  cv::cvtColor(color, gray, cv::COLOR_RGB2GRAY);
  return gray;
}

/// The shortest distance between neighbouring corners, pixels.
double corner_distance_px(const std::vector<cv::Point2f>& corners, const BoardParams& board) {
  double least = 1e9;
  for (int y = 0; y < board.corners_y; ++y)
    for (int x = 0; x < board.corners_x; ++x) {
      const auto i = static_cast<std::size_t>(y * board.corners_x + x);
      if (x + 1 < board.corners_x) least = std::min(least, cv::norm(corners[i] - corners[i + 1]));
      if (y + 1 < board.corners_y)
        least =
            std::min(least, cv::norm(corners[i] - corners[i + static_cast<std::size_t>(board.corners_x)]));
    }
  return least;
}

BoardView view_of(const std::vector<cv::Point2f>& corners, std::vector<int> indices) {
  BoardView view;
  view.corners = std::move(indices);
  for (const cv::Point2f& corner : corners)
    view.pixels.emplace_back(static_cast<double>(corner.x), static_cast<double>(corner.y));
  return view;
}

BoardDetection find_checkerboard(const cv::Mat& gray, const BoardParams& board) {
  const cv::Size size(board.corners_x, board.corners_y);
  constexpr int kBase = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE;
  std::vector<cv::Point2f> corners;
  if (!cv::findChessboardCorners(gray, size, corners, kBase | cv::CALIB_CB_FAST_CHECK) &&
      !cv::findChessboardCorners(gray, size, corners, kBase))
    return {};
  // A refinement window that contains a neighbouring corner is attracted to it.
  const int half = std::clamp(static_cast<int>(corner_distance_px(corners, board) * 0.4), 1, 11);
  // Edges sharper than a pixel bias corners towards pixel positions.
  cv::Mat smooth;
  cv::GaussianBlur(gray, smooth, cv::Size(), half >= 4 ? 1.0 : 0.6);
  cv::cornerSubPix(smooth, corners, cv::Size(half, half), cv::Size(-1, -1),
                   cv::TermCriteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 60, 0.001));
  std::vector<int> indices(corners.size());
  std::iota(indices.begin(), indices.end(), 0);
  return {BoardSearch::kFound, view_of(corners, std::move(indices)), {}};
}

BoardDetection find_charuco(const cv::Mat& gray, const BoardParams& board) {
  constexpr int kFewestCorners = 6;
  const auto charuco = charuco_board(board);
  std::vector<std::vector<cv::Point2f>> markers;
  std::vector<int> ids;
  cv::aruco::detectMarkers(gray, charuco->dictionary, markers, ids);
  if (ids.empty()) return {};
  std::vector<cv::Point2f> corners;
  std::vector<int> indices;
  cv::aruco::interpolateCornersCharuco(markers, ids, gray, charuco, corners, indices);
  if (static_cast<int>(indices.size()) < kFewestCorners) return {BoardSearch::kTooFewCorners, {}, {}};
  return {BoardSearch::kFound, view_of(corners, std::move(indices)), {}};
}

}  // namespace

Result<void> check_params(const BoardParams& board) {
  if (board.kind == BoardKind::kCharuco &&
      (board.corners_x + 1) * (board.corners_y + 1) / 2 > kMostCharucoMarkers)
    return fail(ErrorCode::kUsage, "board", "a ChArUco board of {} x {} corners needs more than {} markers",
                board.corners_x, board.corners_y, kMostCharucoMarkers);
  return {};
}

Vec3 corner_on_board(const BoardParams& board, int index) {
  return {index % board.corners_x * board.square_m, index / board.corners_x * board.square_m, 0};
}

Image<std::uint8_t> draw_board(const BoardParams& board, int square_px) {
  const int margin = square_px / 2;
  const int squares_x = board.corners_x + 1, squares_y = board.corners_y + 1;
  Image<std::uint8_t> picture(squares_x * square_px + 2 * margin, squares_y * square_px + 2 * margin, 255);
  if (board.kind == BoardKind::kCharuco) {
    const cv::Size size(squares_x * square_px, squares_y * square_px);
    cv::Mat drawn;
    charuco_board(board)->draw(size, drawn, 0, 1);
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) picture(x + margin, y + margin) = drawn.at<std::uint8_t>(y, x);
    return picture;
  }
  for (int y = 0; y < squares_y * square_px; ++y)
    for (int x = 0; x < squares_x * square_px; ++x)
      if ((x / square_px + y / square_px) % 2 == 0) picture(x + margin, y + margin) = 0;
  return picture;
}

BoardDetection find_board(const Image<Rgb8>& picture, const BoardParams& board) {
  if (picture.empty()) return {};
  try {
    const cv::Mat gray = gray_of(picture);
    return board.kind == BoardKind::kCharuco ? find_charuco(gray, board) : find_checkerboard(gray, board);
  } catch (const cv::Exception& error) {
    return {BoardSearch::kFailed, {}, error.what()};
  }
}

BoardView turned_by_half(const BoardView& view, const BoardParams& board) {
  const int last = board.corners_x * board.corners_y - 1;
  BoardView turned;
  for (std::size_t i = view.size(); i-- > 0;) {
    turned.corners.push_back(last - view.corners[i]);
    turned.pixels.push_back(view.pixels[i]);
  }
  return turned;
}

}  // namespace hm
