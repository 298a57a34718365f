#pragma once
#include <array>
#include <cstdint>

#include "hm/core/aligned_vector.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Brings depth images into the view of another camera: every reading goes to the nearest pixel (rounded, not
/// cut) that sees its point, the nearest reading wins, and holes of one pixel between readings that agree are
/// filled (dissertation 3.1.2). In single precision: a reading within some 1e-3 px of the border between two
/// pixels may go to either. Const members may be used from any thread; the same bits on every CPU.
class DepthRegistration {
 public:
  /// Both cameras without distortion; T_color_depth takes points of the depth camera into the colour camera.
  DepthRegistration(const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                    const SE3& T_color_depth);
  /// Depth along the colour camera's axis, of its size, in the same units.
  [[nodiscard]] Image<std::uint16_t> apply(const Image<std::uint16_t>& depth, double unit_m) const;
  /// Registers into an image that is given, whose memory is used again where it has the colour camera's size.
  void apply(const Image<std::uint16_t>& depth, double unit_m, Image<std::uint16_t>& registered) const;

 private:
  int width_, height_;  ///< of the depth camera
  int color_width_, color_height_;
  /// A reading of z units at pixel (x, y) lies at z (of_column_[.][x] + of_row_[.][y]) + origin_m_ / unit_m,
  /// homogeneous, in pixels of the colour camera. Columns go on to the end of a block.
  std::array<AlignedVector<float>, 3> of_column_, of_row_;
  Vec3 origin_m_;
};

}  // namespace hm
