#include "hm/tsdf/alignment/dense_alignment.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/core/check.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/tsdf/alignment/alignment_run.hpp"

namespace hm {
namespace {

/// Minimum number of readings for an alignment.
constexpr std::size_t kFewestReadings = 100;
/// Given poses farther out than this (metres) are invalid.
constexpr double kFarthestPrior_m = 1e5;
}  // namespace

std::string_view to_string(AlignmentStatus status) {
  constexpr std::array<std::string_view, 5> names{"accepted", "unusable", "too little overlap",
                                                  "too little geometry", "rejected"};
  return names[static_cast<std::size_t>(status)];
}

AlignmentPrior prior_of_given_pose(const AlignmentParams& params, const SE3& T_world_camera) {
  Vec6 information;
  information << Vec3::Constant(std::pow(params.prior_shift_sigma_m, -2)),
      Vec3::Constant(std::pow(params.prior_turn_sigma_rad, -2));
  const Mat6 from_origin = TurningCentre{T_world_camera.translation(), 1}.to_origin().inverse();
  return {T_world_camera, from_origin.transpose() * information.asDiagonal() * from_origin, {}};
}

struct DenseAligner::Impl {
  Impl(const AlignmentParams& alignment, const TsdfParams& its_tsdf, const DepthNoise& noise,
       const PinholeCamera& its_camera)
      : params(alignment),
        tsdf(its_tsdf),
        camera(its_camera),
        sampler(alignment, its_tsdf, noise, its_camera) {}

  AlignmentParams params;
  TsdfParams tsdf;
  PinholeCamera camera;
  AlignmentSampler sampler;
  AlignmentPoints points;
};

namespace {

/// Reason why a scan cannot be aligned regardless of the map, or empty.
std::string unusable_because(const DepthImage& depth, const PinholeCamera& camera,
                             const AlignmentPrior& prior) {
  if (!is_rigid(prior.T_world_camera)) return "the prior pose is not a finite rigid motion";
  if (prior.T_world_camera.translation().cwiseAbs().maxCoeff() > kFarthestPrior_m)
    return fmt::format("the prior pose is {:.3g} m from the origin",
                       prior.T_world_camera.translation().norm());
  if (!prior.information.allFinite()) return "the prior's information is not finite";
  if (depth.width() != camera.width || depth.height() != camera.height)
    return fmt::format("the depth image is {} x {}, the camera {} x {}", depth.width(), depth.height(),
                       camera.width, camera.height);
  if (!(depth.unit_m > 0)) return fmt::format("the depth unit is {} m", depth.unit_m);
  return {};
}

}  // namespace

DenseAligner::DenseAligner(const AlignmentParams& params, const TsdfParams& tsdf, const DepthNoise& noise,
                           const PinholeCamera& camera)
    : impl_(std::make_unique<Impl>(params, tsdf, noise, camera)) {
  HM_CHECK(camera.distortion.is_zero(), "the camera still has lens distortion");
}
DenseAligner::~DenseAligner() = default;
DenseAligner::DenseAligner(DenseAligner&&) noexcept = default;
DenseAligner& DenseAligner::operator=(DenseAligner&&) noexcept = default;

AlignmentResult DenseAligner::align(const VolumeGrid& grid, const DepthImage& depth,
                                    const AlignmentPrior& prior) {
  HM_CHECK(grid.voxel_size_m() == impl_->tsdf.voxel_size_m, "voxels of {} m, parameters for {} m",
           grid.voxel_size_m(), impl_->tsdf.voxel_size_m);
  const Stopwatch watch;
  AlignmentResult result;
  result.T_world_camera = result.T_world_found = prior.T_world_camera;
  result.reason = unusable_because(depth, impl_->camera, prior);
  if (!result.reason.empty()) return result;
  impl_->sampler.choose(depth, impl_->points);
  if (const std::size_t readings = impl_->points.round_end.front(); readings < kFewestReadings)
    result.reason = fmt::format("{} usable readings; {} are needed", readings, kFewestReadings);
  else
    AlignmentRun(impl_->params, impl_->tsdf, grid, impl_->points, prior).run(result);
  result.milliseconds = watch.milliseconds();
  return result;
}

}  // namespace hm
