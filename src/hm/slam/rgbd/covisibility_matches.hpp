#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/slam/place_recognition/place_params.hpp"
#include "hm/slam/rgbd/bundle_adjustment.hpp"

namespace hm {

/// Keyframe with its pose and map.
struct PlacedKeyframe {
  const Keyframe* keyframe = nullptr;
  SE3 T_map_camera;
  int map = 0;
};

using KeyframePair = std::pair<std::uint32_t, std::uint32_t>;

/// Minimum index difference of compared keyframes of a submap; closer ones share odometry's landmarks.
inline constexpr std::size_t kKeyframesApart = 12;
/// Maximum number of earlier keyframes that a keyframe is compared with.
inline constexpr std::size_t kMostVisits = 100;

/// Pairs (earlier, later) of keyframes of one map that observe the same surfaces from similar directions and
/// are kKeyframesApart apart or in different submaps; at most kMostVisits per keyframe, evenly selected. (The
/// time is quadratic in the number of keyframes: 0.2 s for 1200, 0.7 s for 2400.)
std::vector<KeyframePair> pairs_of_visits(std::span<const PlacedKeyframe> placed,
                                          const PinholeCamera& camera);

/// Matches features of different visits to a place. Unlike place recognition, which compares a keyframe with
/// few others by descriptor, this compares all visits by the current graph poses and searches for each
/// feature near its predicted position (match_guided), within the features' position uncertainty: half of the
/// matches are found for a relative pose error of 2 cm, few for 4 cm. Skips the pairs in `linked` (sorted)
/// and pairs with so few matches that they may be due to chance.
std::vector<FeatureLink> match_covisible(std::span<const PlacedKeyframe> placed, const PinholeCamera& camera,
                                         const PlaceVerifierParams& params,
                                         std::span<const KeyframePair> linked = {});

}  // namespace hm
