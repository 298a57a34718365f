#include "hm/calibration/depth_reference.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hm {
namespace {

/// The four outermost inner corners, each moved outwards along the diagonal by 0.6 of a cell's diagonal, in
/// board order.
std::array<Vec3, 4> outline(const BoardParams& board) {
  const double out = 0.6 * board.square_m;  // along x and along y: 0.6 of the diagonal
  const double right = (board.corners_x - 1) * board.square_m + out;
  const double bottom = (board.corners_y - 1) * board.square_m + out;
  return {Vec3(-out, -out, 0), Vec3(right, -out, 0), Vec3(right, bottom, 0), Vec3(-out, bottom, 0)};
}

/// Pixels of the image that may lie on the board: the outline's bounding box. Empty when a corner is behind.
Eigen::AlignedBox2i pixels_of(const DepthViewInput& input) {
  Eigen::AlignedBox2i box;
  for (const Vec3& corner : outline(input.board)) {
    const Vec3 p = input.T_depth_board * corner;
    if (p.z() <= 0.05) return {};
    const Vec2 pixel = input.camera.project(p);
    const auto rounded = [](double value) {
      return static_cast<int>(std::lround(std::clamp(value, -1e6, 1e6)));
    };
    box.extend(Eigen::Vector2i(rounded(pixel.x()), rounded(pixel.y())));
  }
  return box.intersection(
      {Eigen::Vector2i(0, 0), Eigen::Vector2i(input.camera.width - 1, input.camera.height - 1)});
}

/// True when a point of the board's plane lies within the outline.
bool within(const BoardParams& board, const Vec3& p_board) {
  const auto corners = outline(board);
  return p_board.x() >= corners[0].x() && p_board.x() <= corners[2].x() && p_board.y() >= corners[0].y() &&
         p_board.y() <= corners[2].y();
}

}  // namespace

double plane_depth_m(const PinholeCamera& camera, const SE3& T_camera_board, const Vec2& pixel) {
  const Vec3 normal = T_camera_board.rotation().col(2);
  const double along = normal.dot(camera.unproject(pixel, 1.0));
  if (std::abs(along) < 1e-9) return 0;
  const double z = normal.dot(T_camera_board.translation()) / along;
  return z > 0 ? z : 0;
}

DepthViewResult compare_with_board(const DepthViewInput& input, double gate_m) {
  HM_CHECK(input.camera.distortion.is_zero(), "rectify first");
  HM_CHECK(input.average.width() == input.camera.width && input.average.height() == input.camera.height,
           "{} x {}", input.average.width(), input.average.height());
  DepthViewResult result;
  result.view.images = input.average.images();
  const SE3 T_board_depth = input.T_depth_board.inverse();
  const Eigen::AlignedBox2i box = pixels_of(input);
  if (box.isEmpty()) return result;
  double sum = 0;
  for (int y = box.min().y(); y <= box.max().y(); ++y) {
    for (int x = box.min().x(); x <= box.max().x(); ++x) {
      const double z = plane_depth_m(input.camera, input.T_depth_board, Vec2(x, y));
      if (z <= 0 || !within(input.board, T_board_depth * input.camera.unproject(Vec2(x, y), z))) continue;
      const int readings = input.average.count(x, y);
      if (readings == 0) {
        ++result.no_reading;
        continue;
      }
      const double measured = input.average.mean_m(x, y);
      if (std::abs(measured - z) > gate_m) {
        ++result.off_plane;
        continue;
      }
      const double sigma = input.average.sigma_m(x, y) / std::sqrt(readings);
      sum += z;
      result.view.samples.push_back({static_cast<std::int16_t>(x), static_cast<std::int16_t>(y),
                                     static_cast<float>(measured), static_cast<float>(z),
                                     static_cast<float>(sigma)});
    }
  }
  if (!result.view.samples.empty())
    result.view.distance_m = sum / static_cast<double>(result.view.samples.size());
  return result;
}

}  // namespace hm
