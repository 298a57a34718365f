#pragma once
#include <array>
#include <cstdint>

#include "hm/depth_camera/aligned_vector.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Registers depth images to another camera: every reading is projected to the nearest pixel (rounded, not
/// truncated), the nearest reading wins, and holes of one pixel between readings that agree are filled
/// (dissertation 3.1.2). Single precision: a reading within about 1e-3 px of a pixel border may go to either
/// side. Const members are thread-safe; results are bit-identical on every CPU.
class DepthRegistration {
 public:
  /// Both cameras must have no distortion; p_color = T_color_depth * p_depth, metres.
  DepthRegistration(const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                    const SE3& T_color_depth);
  /// Depth along the colour camera's optical axis, in an image of its size and in the same units; 0: no
  /// reading.
  [[nodiscard]] Image<std::uint16_t> apply(const Image<std::uint16_t>& depth, double unit_m) const;
  /// The same into an existing image, whose memory is reused when it has the colour camera's size.
  void apply(const Image<std::uint16_t>& depth, double unit_m, Image<std::uint16_t>& registered) const;

 private:
  int width_, height_;  ///< of the depth camera
  int color_width_, color_height_;
  /// A reading of z units at pixel (x, y) lies at z (of_column_[.][x] + of_row_[.][y]) + origin_m_ / unit_m,
  /// homogeneous, in pixels of the colour camera. Columns are padded to whole blocks.
  std::array<AlignedVector<float>, 3> of_column_, of_row_;
  Vec3 origin_m_;
};

}  // namespace hm
