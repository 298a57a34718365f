#pragma once
#include <array>
#include <cstdint>
#include <vector>

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

  /// Images one after the other, row by row: what apply() consists of. Not to be shared between threads.
  class Canvas {
   public:
    explicit Canvas(const DepthRegistration& registration);
    Canvas(const Canvas&) = delete;
    Canvas& operator=(const Canvas&) = delete;
    /// Begins an image.
    void begin(double unit_m);
    /// Each row of the depth camera once, in any order; `depth` has kRowSlack_px readable pixels after it.
    void add_row(int y, const std::uint16_t* depth);
    /// After the last row: writes an image of the colour camera's size.
    void finish(Image<std::uint16_t>& registered);

   private:
    void take_step(int y);

    const DepthRegistration& registration_;
    std::array<float, 3> origin_{};         ///< of the depth camera, in cells and units
    AlignedVector<std::uint16_t> nearest_;  ///< depth less 1
    AlignedVector<std::uint16_t> row_;
    AlignedVector<std::uint32_t> cells_, next_cells_;  ///< of the row before: its readings are in no cell yet
    AlignedVector<std::uint16_t> nearness_, next_nearness_;
  };
  static constexpr int kRowSlack_px = 32;

 private:
  int width_, height_;  ///< of the depth camera
  int stride_, rows_;   ///< of cells
  PinholeCamera color_camera_;
  /// A pixel's direction in cells is of_column_[.][x] + of_row_[.][y]; origin_m_ is the translation.
  std::array<AlignedVector<float>, 3> of_column_;
  std::array<std::vector<float>, 3> of_row_;
  Vec3 origin_m_;
};

}  // namespace hm
