#include "hm/slam/rgbd/reference_adjustment.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "hm/core/check.hpp"

namespace hm {
namespace {

/// References alone as a bundle, and which keyframes they are.
struct ReferenceBundle {
  Bundle bundle;
  std::vector<std::size_t> keyframes;
};

PoseEdge3D joined(const PoseEdge3D& a, const PoseEdge3D& b) {
  PoseEdge3D whole = a;
  whole.to = b.to;
  whole.T_from_to = a.T_from_to * b.T_from_to;
  const Mat6 covariance = compose_covariance(a.information.inverse(), b.T_from_to, b.information.inverse());
  whole.information = covariance.inverse();
  return whole;
}

/// Edges between references; those over keyframes left out joined, where they follow one another in time.
std::vector<PoseEdge3D> edges_between(const Bundle& bundle, const std::vector<bool>& is_reference,
                                      const std::vector<std::size_t>& number_of) {
  std::vector<PoseEdge3D> edges;
  std::vector<PoseEdge3D> under_way;  // one at most
  for (const PoseEdge3D& edge : bundle.edges) {
    if (!under_way.empty() && under_way[0].to == edge.from)
      under_way[0] = joined(under_way[0], edge);
    else
      under_way = {edge};
    if (!is_reference[under_way[0].from]) under_way.clear();
    if (under_way.empty() || !is_reference[under_way[0].to]) continue;
    under_way[0].from = number_of[under_way[0].from];
    under_way[0].to = number_of[under_way[0].to];
    edges.push_back(under_way[0]);
    under_way.clear();
  }
  return edges;
}

ReferenceBundle references_of(const Bundle& bundle, const std::vector<bool>& is_reference) {
  ReferenceBundle part{{bundle.camera, {}, {}, {}, {}}, {}};
  std::vector<std::size_t> number_of(is_reference.size(), 0);
  for (std::size_t k = 0; k < is_reference.size(); ++k) {
    if (!is_reference[k]) continue;
    number_of[k] = part.keyframes.size();
    part.keyframes.push_back(k);
    part.bundle.T_map_camera.push_back(bundle.T_map_camera[k]);
  }
  for (const BundleLandmark& whole : bundle.landmarks) {
    BundleLandmark landmark{whole.p_map, {}};
    for (BundleObservation seen : whole.observations) {
      if (!is_reference[seen.keyframe]) continue;
      seen.keyframe = static_cast<std::uint32_t>(number_of[seen.keyframe]);
      landmark.observations.push_back(seen);
    }
    if (landmark.observations.size() > 1) part.bundle.landmarks.push_back(std::move(landmark));
  }
  for (const std::size_t keyframe : bundle.fixed) part.bundle.fixed.push_back(number_of[keyframe]);
  part.bundle.edges = edges_between(bundle, is_reference, number_of);
  return part;
}

/// Moves the other keyframes with the last reference before each (the first one before any), and the
/// landmarks of these with the first keyframe that sees them.
void carry(const std::vector<SE3>& T_map_camera_before, const std::vector<bool>& is_reference,
           Bundle& bundle) {
  std::vector<SE3> moves(is_reference.size());
  std::size_t reference =
      static_cast<std::size_t>(std::ranges::find(is_reference, true) - is_reference.begin());
  for (std::size_t k = 0; k < is_reference.size(); ++k) {
    if (is_reference[k]) reference = k;
    moves[k] = bundle.T_map_camera[reference] * T_map_camera_before[reference].inverse();
    if (!is_reference[k]) bundle.T_map_camera[k] = moves[k] * T_map_camera_before[k];
  }
  for (BundleLandmark& landmark : bundle.landmarks)
    if (!landmark.observations.empty())
      landmark.p_map = moves[landmark.observations.front().keyframe] * landmark.p_map;
}

/// What the others see, with the references held.
Bundle others_of(const Bundle& bundle, const std::vector<bool>& is_reference) {
  Bundle others{bundle.camera, bundle.T_map_camera, {}, {}, bundle.edges};
  for (const BundleLandmark& landmark : bundle.landmarks)
    if (std::ranges::any_of(landmark.observations,
                            [&](const BundleObservation& seen) { return !is_reference[seen.keyframe]; }))
      others.landmarks.push_back(landmark);
  for (std::size_t k = 0; k < is_reference.size(); ++k)
    if (is_reference[k]) others.fixed.push_back(k);
  return others;
}

/// The result of both parts as one.
BundleResult together(const BundleResult& first, const BundleResult& second) {
  const auto mean = [&](double a, double b) {
    const auto n = static_cast<double>(first.observations), m = static_cast<double>(second.observations);
    return n + m > 0 ? (n * a + m * b) / (n + m) : 0;
  };
  BundleResult both = second;
  both.interrupted |= first.interrupted;
  both.iterations += first.iterations;
  both.observations += first.observations;
  both.observations_behind += first.observations_behind;
  both.initial_cost += first.initial_cost;
  both.final_cost += first.final_cost;
  both.error_before_px = mean(first.error_before_px, second.error_before_px);
  both.error_after_px = mean(first.error_after_px, second.error_after_px);
  return both;
}

}  // namespace

BundleResult adjust_by_references(Bundle& bundle, std::vector<bool> is_reference, const BundleParams& params,
                                  const RunContext& run) {
  HM_CHECK(is_reference.size() == bundle.T_map_camera.size(), "{} marks for {} keyframes",
           is_reference.size(), bundle.T_map_camera.size());
  for (const std::size_t keyframe : bundle.fixed) is_reference[keyframe] = true;
  if (std::ranges::count(is_reference, false) == 0) return adjust_bundle(bundle, params, run);
  ReferenceBundle part = references_of(bundle, is_reference);
  const BundleResult first = adjust_bundle(part.bundle, params, run);
  if (!first.converged) return first;
  const std::vector<SE3> before = bundle.T_map_camera;
  for (std::size_t i = 0; i < part.keyframes.size(); ++i)
    bundle.T_map_camera[part.keyframes[i]] = part.bundle.T_map_camera[i];
  carry(before, is_reference, bundle);
  if (first.interrupted) return first;
  Bundle others = others_of(bundle, is_reference);
  const BundleResult second = adjust_bundle(others, params, run);
  if (!second.converged) return first;
  bundle.T_map_camera = std::move(others.T_map_camera);
  return together(first, second);
}

}  // namespace hm
