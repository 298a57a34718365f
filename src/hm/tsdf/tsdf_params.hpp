#pragma once
#include <array>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/sensors/depth_noise.hpp"

namespace hm {

/// Integration method (dissertation 4.3): voxel projection visits the voxels near the surface and looks up
/// their pixels; voxel traversal follows every ray.
enum class IntegrationMethod { kProjection, kTraversal };
inline constexpr std::array<std::string_view, 2> kIntegrationMethodNames{"projection", "traversal"};

/// Implementation of voxel projection: vectorised, or the scalar reference with identical results.
enum class KernelChoice { kSimd, kScalar };
inline constexpr std::array<std::string_view, 2> kKernelChoiceNames{"simd", "scalar"};

/// Parameters of the distance field (dissertation 4.2, 4.3).
struct TsdfParams {
  double voxel_size_m = 0.02;
  IntegrationMethod method = IntegrationMethod::kProjection;
  KernelChoice kernel = KernelChoice::kSimd;
  double near_m = 0.3;
  double far_m = 4.0;

  bool dynamic_truncation = true;
  double truncation_sigmas_ratio = 4.0;
  double min_truncation_voxel = 3.0;
  /// Widest dynamic truncation; not to be set by a user.
  double max_truncation_voxel = 12.0;
  double fixed_truncation_voxel = 4.0;
  /// Distances are clamped to +-2 voxels, so that the weighted average is robust to outliers.
  static constexpr double kDistanceLimit_voxel = 2.0;

  bool edge_filter = true;
  /// A depth step between neighbouring pixels is an edge beyond this many sigmas ...
  static constexpr double kEdgeSigmasRatio = 4.0;
  /// ... plus this many pixel widths.
  static constexpr double kEdgeSlopeRatio = 4.0;
  /// Weight of an observation at a depth edge; not to be set by a user.
  double edge_weight_ratio = 0.125;

  bool carving = true;
  /// Carving starts this far in front of the truncation band.
  static constexpr double kCarvingMargin_voxel = 3.0;
  double carving_weight_ratio = 1.0;

  bool color = true;
  /// Colour is stored within this distance of the surface.
  static constexpr double kColorBand_voxel = 1.5;

  int weight_cap_observations = 100;
  int color_cap_observations = 24;
  int max_map_mb = 0;

  /// Truncation distance at a depth (4.2.2): truncation_sigmas_ratio * sigma(z), clamped to min and max; the
  /// fixed one when dynamic truncation is off. Metres.
  [[nodiscard]] double truncation_m(const DepthNoise& noise, double depth_m) const;
  /// Widest possible truncation, metres.
  [[nodiscard]] double max_truncation_m() const;
  /// Distance limit of observations, metres: at most the narrowest truncation.
  [[nodiscard]] double distance_limit_m() const;
  /// Distance of one unit of TsdfVoxel::sdf(), metres: the widest truncation fits into 16 bits.
  [[nodiscard]] double sdf_unit_m() const { return max_truncation_m() / 32767.0; }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"voxel_size_m",
               {0.002, 0.5},
               "edge of a voxel; smaller shows more detail, but takes more memory and time",
               ParamLevel::kBasic},
      self.voxel_size_m);
    v(
        ParamDoc{
            "method", {}, "integration method: by projecting voxels into the image, or by traversing rays"},
        self.method, kIntegrationMethodNames);
    v(ParamDoc{"kernel", {}, "implementation of voxel projection; both give identical results"}, self.kernel,
      kKernelChoiceNames);
    v(ParamDoc{"near_m", {0.01, 100}, "readings nearer than this are ignored", ParamLevel::kBasic},
      self.near_m);
    v(ParamDoc{"far_m", {0.1, 200}, "readings farther than this only carve", ParamLevel::kBasic}, self.far_m);
    v(ParamDoc{"dynamic_truncation", {}, "truncation follows the sensor's noise at the measured depth"},
      self.dynamic_truncation);
    v(ParamDoc{"truncation_sigmas_ratio",
               {0.5, 20},
               "dynamic truncation in standard deviations of the noise; larger tolerates more noise, but "
               "thickens thin objects"},
      self.truncation_sigmas_ratio);
    v(ParamDoc{"min_truncation_voxel", {1, 64}, "narrowest dynamic truncation"}, self.min_truncation_voxel);
    v(ParamDoc{"fixed_truncation_voxel", {1, 64}, "truncation if it is not dynamic"},
      self.fixed_truncation_voxel);
    v(ParamDoc{"edge_filter",
               {},
               "drop mixed pixels between two surfaces and reduce the weight of readings at depth edges"},
      self.edge_filter);
    v(
        ParamDoc{
            "carving", {}, "erase surfaces that later rays pass through (space carving)", ParamLevel::kBasic},
        self.carving);
    v(ParamDoc{"carving_weight_ratio",
               {0.1, 100},
               "weight removed by one carving ray, in observations; larger erases faster"},
      self.carving_weight_ratio);
    v(ParamDoc{"color", {}, "store colour where the recording has it", ParamLevel::kBasic}, self.color);
    v(
        ParamDoc{
            "weight_cap_observations",
            {1, 255},
            "upper limit of a voxel's weight; smaller adapts faster to changes, larger averages more noise",
            ParamLevel::kBasic},
        self.weight_cap_observations);
    v(ParamDoc{"color_cap_observations",
               {1, 255},
               "upper limit of a voxel's colour weight; smaller adapts faster, larger averages more"},
      self.color_cap_observations);
    v(ParamDoc{"max_map_mb", {0, 1e6}, "memory limit of the map; 0: none", ParamLevel::kBasic},
      self.max_map_mb);
  }
};

/// Checks for contradictions (near beyond far, narrowest truncation beyond the widest); the error names them.
Result<void> check_params(const TsdfParams& params);

}  // namespace hm
