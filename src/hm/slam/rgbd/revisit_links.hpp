#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/slam/rgbd/bundle_adjustment.hpp"
#include "hm/slam/rgbd/place_params.hpp"

namespace hm {

/// A keyframe, where it is, and the map that it belongs to.
struct PlacedKeyframe {
  const Keyframe* keyframe = nullptr;
  SE3 T_map_camera;
  int map = 0;
};

using KeyframePair = std::pair<std::uint32_t, std::uint32_t>;

/// Nearer ones of a submap are of one visit: they share odometry's landmarks.
inline constexpr std::size_t kKeyframesOfVisit = 12;
/// Earlier keyframes that one is compared with at most: the work grows with the keyframes, not their square.
inline constexpr std::size_t kMostVisits = 100;

/// Pairs (earlier, later) of keyframes of one map that look at the same surfaces from about the same side on
/// different visits. Where there are more than kMostVisits, they are spread over all visits.
std::vector<KeyframePair> pairs_of_visits(std::span<const PlacedKeyframe> placed,
                                          const PinholeCamera& camera);

/// Poses are taken to be right by this: further apart two sights are not one point.
inline constexpr double kMaxOffset_m = 0.05;

/// Features of different visits that are one point. Place recognition compares a keyframe with a few others
/// and knows features by their look; where the graph has put the keyframes, all visits of a place can be
/// compared, and a feature is looked for where it must be (match_guided). Pairs of keyframes with so few
/// matches that they may be chance give none.
std::vector<FeatureLink> link_visits(std::span<const PlacedKeyframe> placed, const PinholeCamera& camera,
                                     const PlaceVerifierParams& params);

}  // namespace hm
