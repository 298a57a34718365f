#pragma once
#include <cstdint>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"

namespace hm {

/// Removes lens distortion: for every pixel of the ideal camera (same size, focal lengths and centre) the
/// place in the distorted picture that sees the same ray, computed once. Depth takes the nearest pixel, since
/// depths on two sides of an edge have no mean; colour is interpolated (8-bit weights). Pixels that see
/// nothing become 0. Const members may be used from any thread.
class LensMap {
 public:
  explicit LensMap(const PinholeCamera& distorted);
  [[nodiscard]] Image<std::uint16_t> undistort(const Image<std::uint16_t>& depth) const;
  [[nodiscard]] Image<Rgb8> undistort(const Image<Rgb8>& color) const;
  /// One row of undistort(depth); `row` has kRowSlack_px pixels of room after it.
  void undistort_row(const Image<std::uint16_t>& depth, int y, std::uint16_t* row) const;
  static constexpr int kRowSlack_px = 32;

 private:
  struct Source {
    bool is_inside;
    std::int32_t upper_left;            ///< index of the upper left one of the four around the place
    std::uint16_t right_256, down_256;  ///< weights of the right and the lower pixels
  };
  /// Pixels of a row whose nearest sources are neighbours too: lenses bend slowly.
  struct Run {
    std::int32_t source;  ///< index of the first one's, or -1: they see nothing
    std::int32_t count;
  };
  [[nodiscard]] static Source source_at(const PinholeCamera& camera, const Vec2& place);
  [[nodiscard]] static std::int32_t nearest_at(const PinholeCamera& camera, const Vec2& place);
  void add_to_runs(std::int32_t source, bool begins_row);
  int width_;
  int height_;
  std::vector<Source> sources_;
  std::vector<Run> runs_;
  std::vector<std::size_t> first_run_;  ///< of each row, and the end
};

}  // namespace hm
