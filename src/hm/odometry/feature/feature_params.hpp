#pragma once
#include <array>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/odometry/feature/depth_uncertainty.hpp"

namespace hm {

/// Corner detector: FAST-9 per cell, ranked by Shi-Tomasi score (default), or Shi and Tomasi's good features
/// over all pixels with depth readings, as in the dissertation.
enum class CornerDetector { kGrid, kShiTomasi };
inline constexpr std::array<std::string_view, 2> kCornerDetectorNames{"grid", "shi_tomasi"};

struct FeatureParams {
  CornerDetector detector = CornerDetector::kGrid;
  int max_features = 500;
  /// Grid: edge of a cell; all cells get equal shares of the corners.
  static constexpr int kCell_px = 40;
  /// Corners weaker than this times the best are ignored.
  double quality_ratio = 0.002;
  /// Minimum distance between two corners.
  double min_distance_px = 6;
  /// Grid: pyramid levels, each 1.2 times smaller.
  int levels = 1;
  /// Gaussian blur before detection; 0: none.
  static constexpr int kBlurRadius_px = 0;
  /// Refine corners to subpixel positions.
  bool subpixel = true;
  /// Rotates descriptors with the patch; off: upright.
  bool oriented = true;
  /// Model for the standard deviation of a feature's depth.
  DepthModel depth_model = DepthModel::kCorrectedMixture;
  /// Standard deviation of a corner's image position.
  static constexpr double kPixelSigma_px = 1.0;
  DepthNoise depth_noise;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"detector",
               {},
               "corner detector: grid: FAST per cell, covers the image; shi_tomasi: as in the dissertation"},
      self.detector, kCornerDetectorNames);
    v(ParamDoc{"max_features",
               {10, 10000},
               "maximum number of corners per frame; larger is more robust but slower"},
      self.max_features);
    v(ParamDoc{"quadratic_per_m", {0, 1}, "axial depth noise of features: factor of z^2"},
      self.depth_noise.quadratic_per_m);
    v(ParamDoc{"linear_ratio", {-1, 1}, "axial depth noise of features: factor of z"},
      self.depth_noise.linear_ratio);
    v(ParamDoc{"constant_m", {0, 1}, "axial depth noise of features: constant part"},
      self.depth_noise.constant_m);
  }
};

}  // namespace hm
