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
  int cell_px = 40;
  double quality_ratio = 0.002;
  double min_distance_px = 6;
  int levels = 1;
  int blur_radius_px = 0;
  bool subpixel = true;
  bool oriented = true;
  DepthModel depth_model = DepthModel::kCorrectedMixture;
  double pixel_sigma_px = 1.0;
  DepthNoise depth_noise;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"detector", {}, "how corners are found"}, self.detector, kCornerDetectorNames);
    v(ParamDoc{"max_features", {10, 10000}, "corners of a frame at most"}, self.max_features);
    v(ParamDoc{"cell_px", {8, 640}, "grid: cells get equal shares of the corners"}, self.cell_px);
    v(ParamDoc{"quality_ratio", {0, 1}, "corners weaker than this times the best are ignored"},
      self.quality_ratio);
    v(ParamDoc{"min_distance_px", {0, 100}, "between two corners"}, self.min_distance_px);
    v(ParamDoc{"levels", {1, 8}, "grid: pyramid levels, each 1.2 times smaller"}, self.levels);
    v(ParamDoc{"blur_radius_px", {0, 10}, "Gaussian blur before everything else; 0: none"},
      self.blur_radius_px);
    v(ParamDoc{"subpixel", {}, "refine corners to parts of a pixel"}, self.subpixel);
    v(ParamDoc{"oriented", {}, "descriptors turn with the patch; off: upright"}, self.oriented);
    v(ParamDoc{"depth_model", {}, "deviation of a feature's depth: by distance, or from its 3x3 pixels too"},
      self.depth_model, kDepthModelNames);
    v(ParamDoc{"pixel_sigma_px", {0.01, 10}, "deviation of a corner's place in the image"},
      self.pixel_sigma_px);
    DepthNoise::visit(self.depth_noise, v);
  }
};

}  // namespace hm
