#pragma once
#include <array>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/sensors/depth_noise.hpp"

namespace hm {

/// How scans are written into the grid (dissertation 4.3): voxel projection visits the voxels near the
/// surface and looks up their pixel; voxel traversal walks every ray.
enum class IntegrationMethod { kProjection, kTraversal };
inline constexpr std::array<std::string_view, 2> kIntegrationMethodNames{"projection", "traversal"};

/// Which code runs voxel projection: the fastest that the CPU has, or the plain one that it must match.
enum class KernelChoice { kSimd, kScalar };
inline constexpr std::array<std::string_view, 2> kKernelChoiceNames{"simd", "scalar"};

/// Everything about the distance field (dissertation 4.2, 4.3).
struct TsdfParams {
  double voxel_size_m = 0.02;
  IntegrationMethod method = IntegrationMethod::kProjection;
  KernelChoice kernel = KernelChoice::kSimd;
  double near_m = 0.3;
  double far_m = 4.0;

  bool dynamic_truncation = true;
  double truncation_sigmas_ratio = 4.0;
  double min_truncation_voxel = 3.0;
  /// Widest dynamic truncation.
  double max_truncation_voxel = 12.0;
  double fixed_truncation_voxel = 4.0;
  /// Distances are clamped to this, in front and behind, so that one ray cannot outvote several.
  static constexpr double kDistanceLimit_voxel = 2.0;

  bool edge_filter = true;
  /// A step to a neighbouring pixel is an edge beyond this many sigmas.
  static constexpr double kEdgeSigmasRatio = 4.0;
  /// Plus this many pixel widths.
  static constexpr double kEdgeSlopeRatio = 4.0;
  /// Weight of an observation at a depth edge.
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

  /// The truncation distance at a depth (4.2.2): truncation_sigmas_ratio * sigma(z), kept within
  /// min and max; the fixed one when dynamic truncation is off. Metres.
  [[nodiscard]] double truncation_m(const DepthNoise& noise, double depth_m) const;
  /// The widest truncation that can occur, metres.
  [[nodiscard]] double max_truncation_m() const;
  /// The largest distance that an observation tells, metres: never beyond the narrowest truncation.
  [[nodiscard]] double distance_limit_m() const;
  /// The distance of one unit of TsdfVoxel::sdf(): the widest truncation just fits 16 bits. Metres.
  [[nodiscard]] double sdf_unit_m() const { return max_truncation_m() / 32767.0; }

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"voxel_size_m", {0.002, 0.5}, "edge of a voxel", ParamLevel::kBasic}, self.voxel_size_m);
    v(ParamDoc{"method", {}, "how scans are integrated"}, self.method, kIntegrationMethodNames);
    v(ParamDoc{"kernel", {}, "code for voxel projection; both give the same bits"}, self.kernel,
      kKernelChoiceNames);
    v(ParamDoc{"near_m", {0.01, 100}, "readings nearer than this are ignored", ParamLevel::kBasic},
      self.near_m);
    v(ParamDoc{"far_m", {0.1, 200}, "readings farther than this only carve", ParamLevel::kBasic}, self.far_m);
    v(ParamDoc{"dynamic_truncation",
               {},
               "truncation follows the sensor's noise at the measured depth",
               ParamLevel::kBasic},
      self.dynamic_truncation);
    v(
        ParamDoc{
            "truncation_sigmas_ratio", {0.5, 20}, "dynamic truncation in standard deviations of the noise"},
        self.truncation_sigmas_ratio);
    v(ParamDoc{"min_truncation_voxel", {1, 64}, "narrowest dynamic truncation"}, self.min_truncation_voxel);
    v(ParamDoc{"fixed_truncation_voxel", {1, 64}, "truncation when it is not dynamic"},
      self.fixed_truncation_voxel);
    v(
        ParamDoc{
            "edge_filter", {}, "drop mixed pixels between two surfaces, trust readings at depth edges less"},
        self.edge_filter);
    v(ParamDoc{"carving",
               {},
               "erase surfaces that a later ray passes through on its way to another one",
               ParamLevel::kBasic},
      self.carving);
    v(ParamDoc{"carving_weight_ratio", {0.1, 100}, "weight that one carving ray takes away, in observations"},
      self.carving_weight_ratio);
    v(ParamDoc{"color", {}, "store colour where the recording has it", ParamLevel::kBasic}, self.color);
    v(ParamDoc{"weight_cap_observations",
               {1, 255},
               "a voxel's weight stops growing here, so that it follows change",
               ParamLevel::kBasic},
      self.weight_cap_observations);
    v(ParamDoc{"color_cap_observations", {1, 255}, "the same for its colour"}, self.color_cap_observations);
    v(ParamDoc{"max_map_mb", {0, 1e6}, "memory cap for the map; 0 for none", ParamLevel::kBasic},
      self.max_map_mb);
  }
};

/// An error naming what contradicts (near beyond far, narrowest truncation beyond the widest).
Result<void> check_params(const TsdfParams& params);

}  // namespace hm
