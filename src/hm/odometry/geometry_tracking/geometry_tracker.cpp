#include "hm/odometry/geometry_tracking/geometry_tracker.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hm/core/check.hpp"
#include "hm/odometry/geometry_tracking/reference_registration.hpp"
#include "hm/odometry/registration/pose_equations.hpp"

namespace hm {
namespace {

constexpr std::size_t kMostReferences = 40, kMostSurfaces = 16;
constexpr std::uint64_t kOwn = std::uint64_t{1}
                               << 62;  // identities of own references, apart from the keyframes'
constexpr double kLeastCompared = 0.25, kLeastFitting = 0.7;
constexpr double kSureCompared = 0.5, kSureFitting = 0.85, kSureSigma_m = 0.05;
constexpr double kUsableCells = 0.1;  // with depth
constexpr double kMostUncertain_m = 0.25;
// Deviations of a pose where neither images nor surfaces showed the motion.
constexpr double kGuessedSigma_m = 0.3, kGuessedSigma_rad = 0.3;

double position_sigma_m(const Mat6& covariance_in_camera) {
  return std::sqrt(std::max(0.0, covariance_in_camera.topLeftCorner<3, 3>().trace()));
}

SE3 motion_until_color(const GeometryFrame& frame, const Vec6& twist_s) {
  return SE3::exp(frame.color_delay_s * twist_s);
}

std::string refusal_of(const ReferenceRegistration& found, double sigma_m) {
  if (found.compared_ratio < kLeastCompared)
    return fmt::format("{:.0f} % of the depth image is on known surfaces, {:.0f} % needed",
                       100 * found.compared_ratio, 100 * kLeastCompared);
  if (found.fitting_ratio < kLeastFitting)
    return fmt::format("{:.0f} % of the depth image agrees with the surfaces, {:.0f} % needed",
                       100 * found.fitting_ratio, 100 * kLeastFitting);
  if (!(sigma_m < kMostUncertain_m))
    return fmt::format("position by surfaces alone uncertain by {:.2f} m", sigma_m);
  return {};
}

}  // namespace

double GeometryAttempt::sigma_m() const { return position_sigma_m(covariance_since_model); }

bool GeometryAttempt::is_sure() const {
  return compared_ratio > kSureCompared && fitting_ratio > kSureFitting && sigma_m() < kSureSigma_m;
}

bool GeometryTracker::is_usable(const DepthGrid& grid) {
  const auto cells = std::count_if(grid.depth_m.pixels().begin(), grid.depth_m.pixels().end(),
                                   [](float z) { return z > 0; });
  return static_cast<double>(cells) > kUsableCells * static_cast<double>(grid.depth_m.size());
}

void GeometryTracker::begin(const GeometryStart& start, const GeometryFrame& frame) {
  end();
  active_ = true;
  filter_ = PoseVelocityFilter(start.T_odom_camera, start.twist_s);
  start_covariance_ = start.covariance;
  add_reference(frame, start.T_odom_camera, Mat6::Zero());
}

GeometryAttempt GeometryTracker::attempt(const GeometryStart& start, const GeometryFrame& frame,
                                         std::span<const SurfaceReference> keyframes) const {
  GeometryAttempt out;
  out.start_covariance = active_ ? start_covariance_ : start.covariance;
  const SE3 T_camera_depth = motion_until_color(frame, start.twist_s.value_or(Vec6::Zero())).inverse();
  out.filter = active_ ? filter_ : PoseVelocityFilter(start.T_odom_camera * T_camera_depth, start.twist_s);
  std::vector<SurfaceReference> all(keyframes.begin(), keyframes.end());
  for (const OwnReference& own : references_)
    all.push_back({own.identity, own.T_odom_depth, own.covariance, &own.grid});
  const auto prediction = out.filter.predict(frame.since_last_s, frame.R_last_current);
  const ChosenReferences chosen = choose_references(all, *frame.grid, prediction.T_odom_camera);
  std::vector<ReferenceSurface> surfaces;
  if (surfaces_.size() > kMostSurfaces) surfaces_.clear();
  for (const std::size_t index : chosen.indices)
    surfaces.push_back({&surface_of(all[index]), all[index].T_odom_depth, all[index].covariance});
  ReferenceRegistration found;
  for (const RegistrationReach reach : {RegistrationReach::kNear, RegistrationReach::kFar}) {
    found = register_to_references(surfaces, *frame.grid, prediction, reach, noise_);
    out.compared_ratio = found.compared_ratio, out.fitting_ratio = found.fitting_ratio;
    out.refusal = refusal_of(found, 0);
    if (out.refusal.empty()) break;
  }
  if (!active_ && !out.refusal.empty()) surfaces_.clear();  // nothing is kept of a failed frame
  if (!out.refusal.empty()) return out;
  out.filter.update(frame.since_last_s, frame.R_last_current, found.T_odom_depth, found.information);
  out.motion_covariance = out.filter.covariance();
  out.covariance_in_model =
      covariance_by_adjoint(out.motion_covariance, found.T_odom_depth) + found.reference_covariance;
  out.covariance_since_model = covariance_by_adjoint(out.covariance_in_model, found.T_odom_depth.inverse());
  out.covariance = out.start_covariance + out.covariance_in_model;
  out.refusal = refusal_of(found, out.sigma_m());
  if (!active_ && !out.refusal.empty()) surfaces_.clear();
  const SE3 T_depth_camera = motion_until_color(frame, out.filter.twist_s());
  out.T_odom_camera = found.T_odom_depth * T_depth_camera;
  out.T_camera_depth = T_depth_camera.inverse();
  out.keyframe_due = !chosen.has_close;
  return out;
}

void GeometryTracker::accept(const GeometryAttempt& attempt, const GeometryFrame& frame) {
  HM_CHECK(attempt.refusal.empty(), "{}", attempt.refusal);
  active_ = true;
  filter_ = attempt.filter;
  start_covariance_ = attempt.start_covariance;
  if (attempt.keyframe_due) add_reference(frame, filter_.T_odom_camera(), attempt.covariance_in_model);
}

std::optional<DepthArrival> GeometryTracker::arrival(const std::optional<GeometryAttempt>& attempt,
                                                     const SE3& T_odom_guess) const {
  if (!active_ || references_.empty()) return std::nullopt;
  if (attempt && attempt->refusal.empty())
    return DepthArrival{attempt->T_odom_camera, attempt->motion_covariance};
  Vec6 sigmas;
  sigmas << Vec3::Constant(kGuessedSigma_m), Vec3::Constant(kGuessedSigma_rad);
  return DepthArrival{T_odom_guess, sigmas.cwiseAbs2().asDiagonal()};
}

void GeometryTracker::end() {
  active_ = false;
  references_.clear();
  surfaces_.clear();
}

void GeometryTracker::add_reference(const GeometryFrame& frame, const SE3& T_odom_depth,
                                    const Mat6& covariance) {
  if (references_.size() >= kMostReferences) references_.pop_front();
  references_.push_back({kOwn + next_identity_++, frame.index, T_odom_depth, covariance, *frame.grid});
}

const SurfaceGrid& GeometryTracker::surface_of(const SurfaceReference& reference) const {
  const auto known = surfaces_.find(reference.identity);
  if (known != surfaces_.end()) return known->second;
  return surfaces_.emplace(reference.identity, make_surface_grid(*reference.grid, noise_)).first->second;
}

std::size_t GeometryTracker::memory_bytes() const {
  std::size_t bytes = 0;
  for (const OwnReference& own : references_)
    bytes += sizeof(OwnReference) + own.grid.depth_m.size() * sizeof(float);
  for (const auto& [identity, surface] : surfaces_) bytes += surface.memory_bytes();
  return bytes;
}

Result<void> GeometryTracker::restore(
    const std::function<Result<DepthGrid>(std::size_t frame_index)>& read_grid) {
  for (OwnReference& own : references_) {
    auto grid = read_grid(own.frame_index);
    if (!grid) return forward_error(grid);
    own.grid = std::move(*grid);
  }
  return {};
}

}  // namespace hm
