#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "hm/core/aligned_vector.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/depth_camera/registration_cells.hpp"

namespace hm {

namespace detail {
struct ProjectedRow;
}

/// Brings depth images into the view of another camera: every reading goes to the nearest pixel (rounded, not
/// cut) that sees its point, the nearest reading wins, and holes of one pixel between readings that agree are
/// filled (dissertation 3.1.2). In single precision: a reading within some 1e-3 px of the border between two
/// pixels may go to either. Const members may be used from any thread; the same bits on every CPU.
///
/// Fast for cameras that look the same way. Readings nearer than 0.2 m (up to 1.6 m for cameras far apart)
/// are taken one by one; and so are all where a row of readings is spread over rows of more than 2^16 pixels,
/// borders included: that takes some eight times as long. For two cameras of one size with usual lenses, a
/// few cm apart along x, the most that is fast is a turn about the axis or a distance along y of
///
///      640 x  480: 7.5 degrees, 20 cm
///     1280 x  720: 1.5 degrees, 10 cm (0.9 degrees where the depth camera sees a half more)
///     1920 x 1080: 0.8 degrees,  4 cm (0.5 degrees where they are also some mm apart along y and z)
class DepthRegistration {
 public:
  /// Whether its pictures are not too large for that (some 16 million pixels).
  [[nodiscard]] static bool fits(const PinholeCamera& color_camera);
  /// Both cameras without distortion; T_color_depth takes points of the depth camera into the colour camera,
  /// which fits().
  DepthRegistration(const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                    const SE3& T_color_depth);
  /// Depth along the colour camera's axis, of its size, in the same units.
  [[nodiscard]] Image<std::uint16_t> apply(const Image<std::uint16_t>& depth, double unit_m) const;

  /// Images one after the other, row by row: what apply() consists of. Rows of the result are made as soon as
  /// nothing more can reach them. Not to be shared between threads.
  class Canvas {
   public:
    explicit Canvas(const DepthRegistration& registration);
    Canvas(const Canvas&) = delete;
    Canvas& operator=(const Canvas&) = delete;
    /// Begins an image.
    void begin(double unit_m);
    /// Every row of the depth camera, from the first to the last; `depth` has kRowSlack_px readable pixels
    /// after it, whatever they are.
    void add_row(int y, const std::uint16_t* depth);
    /// After the last row: exchanges `registered` for an image of the colour camera's size.
    void finish(Image<std::uint16_t>& registered);

   private:
    /// Where a row's readings go, with room before and after.
    struct PlacedNumbers {
      AlignedVector<std::uint16_t> cells, closeness;
    };
    [[nodiscard]] detail::ProjectedRow projected(int y) const;
    void take_step(int y, const std::uint16_t* depth);
    void take_each(int y, const std::uint16_t* depth);
    void clear_until(int row);
    void fill_until(int row);

    const DepthRegistration& registration_;
    std::array<float, 3> origin_{};         ///< of the depth camera, in cells and units
    int lowest_ = 1, highest_ = 0;          ///< readings that are within their row's reach
    AlignedVector<std::uint16_t> closest_;  ///< of every cell
    PlacedNumbers row_, next_row_;          ///< row_: of the row before, whose readings are in no cell yet
    int placed_from_row_ = 0;               ///< of cells: what row_ counts from
    int added_ = -1;                        ///< rows; -1 before begin() and after finish()
    int cleared_ = 0, filled_ = 0;          ///< rows of cells, and of the image
    bool holds_back_ = false;               ///< all is filled at the end: some reading may be anywhere
    Image<std::uint16_t> registered_;
  };
  static constexpr int kRowSlack_px = 64;

 private:
  int width_, height_;  ///< of the depth camera
  PinholeCamera color_camera_;
  detail::RegistrationCells cells_;
  std::vector<int> settled_;  ///< rows of cells that only rows of the depth camera before this one go to
  /// A pixel's direction in cells is of_column_ (at column_at()) + of_row_[.][y]; origin_m_ the translation.
  AlignedVector<float> of_column_;
  std::array<std::vector<float>, 3> of_row_;
  Vec3 origin_m_;
};

}  // namespace hm
