#pragma once
#include <array>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/odometry/feature/depth_uncertainty.hpp"

namespace hm {

/// How corners are found: FAST-9 per cell, ranked by their Shi-Tomasi score (default), or Shi and Tomasi's
/// good features over the whole image with readings of depth, as the dissertation had it.
enum class CornerDetector { kGrid, kShiTomasi };
inline constexpr std::array<std::string_view, 2> kCornerDetectorNames{"grid", "shi_tomasi"};

struct FeatureParams {
  CornerDetector detector = CornerDetector::kGrid;
  int max_features = 500;
  /// Grid: cells get equal shares of the corners.
  static constexpr int kCell_px = 40;
  /// Corners weaker than this times the best are ignored.
  double quality_ratio = 0.002;
  double min_distance_px = 6;
  int levels = 1;
  /// Gaussian blur before everything else; 0: none.
  static constexpr int kBlurRadius_px = 0;
  bool subpixel = true;
  /// Descriptors turn with the patch; off: upright.
  bool oriented = true;
  /// Deviation of a feature's depth: by distance, or from its 3x3 pixels too.
  DepthModel depth_model = DepthModel::kCorrectedMixture;
  double pixel_sigma_px = 1.0;
  DepthNoise depth_noise;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"detector", {}, "how corners are found"}, self.detector, kCornerDetectorNames);
    v(ParamDoc{"max_features", {10, 10000}, "corners of a frame at most"}, self.max_features);
    v(ParamDoc{"min_distance_px", {0, 100}, "between two corners"}, self.min_distance_px);
    v(ParamDoc{"levels", {1, 8}, "grid: pyramid levels, each 1.2 times smaller"}, self.levels);
    v(ParamDoc{"subpixel", {}, "refine corners to parts of a pixel"}, self.subpixel);
    v(ParamDoc{"pixel_sigma_px", {0.01, 10}, "deviation of a corner's place in the image"},
      self.pixel_sigma_px);
    DepthNoise::visit(self.depth_noise, v);
  }
};

}  // namespace hm
