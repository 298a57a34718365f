#pragma once
#include <array>
#include <optional>
#include <vector>

#include "hm/pipeline/checks/recording_check.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Sum of the absolute differences of brightness across a pixel, in x and y, at most 60, so that a few strong
/// edges of texture do not outvote the rest.
Image<std::uint8_t> color_gradient(const Image<Rgb8>& color);

/// Tiles of an image. Edges of one thing may match the borders of another by chance: what is right shows in
/// most of the tiles, and needs at least half of them.
struct ImageTiles {
  static constexpr int kAcross = 6, kDown = 4;
  static constexpr std::size_t kCount = kAcross * kDown, kMinSeen = 12;
  [[nodiscard]] static std::size_t at(double x, double y, int width, int height) {
    return static_cast<std::size_t>(static_cast<int>(y * kDown / height) * kAcross +
                                    static_cast<int>(x * kAcross / width));
  }
};

/// Finds the shift and scale between colour and depth: sums the colour gradient found at depth edges for
/// every shift of up to kReach_px pixels, and for scales about the image's middle, which two cameras of
/// different focal lengths have. Where colour is registered the sum is largest at no shift and scale 1.
class ColorShiftEstimator {
 public:
  static constexpr int kReach_px = 12;
  static constexpr double kScaleStep = 0.02;  ///< down to 1 - kScales kScaleStep, and up as far
  static constexpr int kScales = 8;
  ColorShiftEstimator();
  /// Takes a frame into account; frames without colour are ignored.
  void add(const RgbdFrame& frame);
  /// The best shift so far; none, with gain 1, when there were too few edges, or only in some of the image.
  [[nodiscard]] ColorShift best() const;

 private:
  static constexpr int kSide = 2 * kReach_px + 1;
  [[nodiscard]] std::optional<ColorShift> best_scaled() const;
  void add_scales(const std::vector<std::pair<int, int>>& edges, const Image<std::uint8_t>& colors);
  static constexpr int kCoarseStep_px = 2;
  static constexpr int kCoarseSide = 2 * (kReach_px / kCoarseStep_px) + 1;
  std::vector<double> sums_;
  std::vector<double> scaled_sums_;  ///< [scale][down][right], coarse shifts
  double scaled_none_ = 0;           ///< of the same edges at no shift and scale 1
  std::size_t edges_ = 0;
  std::array<std::size_t, ImageTiles::kCount> edges_of_tile_{};
};

}  // namespace hm
