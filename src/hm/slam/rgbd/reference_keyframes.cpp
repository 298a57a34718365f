#include "hm/slam/rgbd/reference_keyframes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>

namespace hm {
namespace {

/// Cube and direction of view, which is 1, 2, 3 along the axes and -1, -2, -3 against them.
std::array<std::int64_t, 4> place_of(const SE3& T_map_camera) {
  const Vec3 view = T_map_camera.rotation().col(2);
  Eigen::Index axis = 0;
  view.cwiseAbs().maxCoeff(&axis);
  std::array<std::int64_t, 4> place{0, 0, 0, view[axis] < 0 ? -(axis + 1) : axis + 1};
  for (Eigen::Index i = 0; i < 3; ++i)
    place[static_cast<std::size_t>(i)] =
        static_cast<std::int64_t>(std::floor(T_map_camera.translation()[i] / kPlace_m));
  return place;
}

/// The keyframes [first, end) of the visit that has most of a landmark's observations that are not of
/// reference keyframes; the earliest of equals. Nothing where all are.
std::pair<std::uint32_t, std::uint32_t> longest_visit(const std::vector<BundleObservation>& observations,
                                                      const std::vector<bool>& is_reference) {
  std::vector<std::uint32_t> others;
  for (const BundleObservation& seen : observations)
    if (!is_reference[seen.keyframe]) others.push_back(seen.keyframe);
  std::size_t most = 0, best = 0;
  for (std::size_t begin = 0, end = 0; begin < others.size(); ++begin) {
    while (end < others.size() && others[end] < others[begin] + kVisitKeyframes) ++end;
    if (end - begin <= most) continue;
    most = end - begin;
    best = begin;
  }
  if (others.empty()) return {0, 0};
  return {others[best], others[best] + static_cast<std::uint32_t>(kVisitKeyframes)};
}

}  // namespace

std::vector<bool> reference_keyframes(std::span<const SE3> T_map_camera) {
  std::vector<bool> is_reference;
  std::map<std::array<std::int64_t, 4>, std::size_t> references;
  for (const SE3& T : T_map_camera) is_reference.push_back(references[place_of(T)]++ < kReferencesOfPlace);
  return is_reference;
}

void bound_covisibility(std::vector<BundleObservation>& observations, const std::vector<bool>& is_reference) {
  const auto [first, end] = longest_visit(observations, is_reference);
  std::erase_if(observations, [&, first = first, end = end](const BundleObservation& seen) {
    return !is_reference[seen.keyframe] && (seen.keyframe < first || seen.keyframe >= end);
  });
}

}  // namespace hm
