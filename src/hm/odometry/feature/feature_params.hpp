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
  double min_distance_px = 6;
  int levels = 1;
  /// Gaussian blur before detection; 0: none.
  static constexpr int kBlurRadius_px = 0;
  bool subpixel = true;
  /// Rotates descriptors with the patch; off: upright.
  bool oriented = true;
  /// Model for the standard deviation of a feature's depth.
  DepthModel depth_model = DepthModel::kCorrectedMixture;
  double pixel_sigma_px = 1.0;
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
    v(ParamDoc{"min_distance_px", {0, 100}, "minimum distance between two corners"}, self.min_distance_px);
    v(ParamDoc{"levels", {1, 8}, "grid: pyramid levels, each 1.2 times smaller"}, self.levels);
    v(ParamDoc{"subpixel", {}, "refine corners to subpixel positions"}, self.subpixel);
    v(ParamDoc{"pixel_sigma_px", {0.01, 10}, "standard deviation of a corner's image position"},
      self.pixel_sigma_px);
    DepthNoise::visit(self.depth_noise, v);
  }
};

}  // namespace hm
