#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/slam/places/place_params.hpp"
#include "hm/slam/rgbd/bundle_adjustment.hpp"

namespace hm {

/// A keyframe, where it is, and the map that it belongs to.
struct PlacedKeyframe {
  const Keyframe* keyframe = nullptr;
  SE3 T_map_camera;
  int map = 0;
};

using KeyframePair = std::pair<std::uint32_t, std::uint32_t>;

/// Nearer ones of a submap share odometry's landmarks and are not compared.
inline constexpr std::size_t kKeyframesApart = 12;
/// Earlier keyframes that one is compared with at most.
inline constexpr std::size_t kMostVisits = 100;

/// Pairs (earlier, later) of keyframes of one map that look at the same surfaces from about the same side,
/// and are kKeyframesApart or of different submaps. Where one has more than kMostVisits, they are spread over
/// all. (Finding them takes time by the square of the keyframes: 0.2 s for 1200, 0.7 s for 2400.)
std::vector<KeyframePair> pairs_of_visits(std::span<const PlacedKeyframe> placed,
                                          const PinholeCamera& camera);

/// Features of different visits that are one point. Place recognition compares a keyframe with a few others
/// and knows features by their look; where the graph has put the keyframes, all visits of a place can be
/// compared, and a feature is looked for where it must be (match_guided), within what features know of their
/// places: of two visits that are 2 cm apart half the links are found, of 4 cm few. Pairs of keyframes with
/// so few matches that they may be chance give none; nor do those of `linked` (sorted).
std::vector<FeatureLink> match_covisible(std::span<const PlacedKeyframe> placed, const PinholeCamera& camera,
                                         const PlaceVerifierParams& params,
                                         std::span<const KeyframePair> linked = {});

}  // namespace hm
