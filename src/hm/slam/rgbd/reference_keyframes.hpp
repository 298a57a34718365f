#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "hm/slam/rgbd/bundle_adjustment.hpp"

namespace hm {

/// Keyframes of one place (a cube of kPlace_m, looking along one of the six directions of the axes) that
/// stand for it, the first ones that came.
inline constexpr double kPlace_m = 1;
inline constexpr std::size_t kReferencesOfPlace = 12;

/// Which keyframes stand for their places; all where no place has more than kReferencesOfPlace. However long
/// a camera stays, their number is bounded by the places there are.
std::vector<bool> reference_keyframes(std::span<const SE3> T_map_camera);

/// Observations of a landmark that were made one after another, within so many keyframes: a visit.
inline constexpr std::size_t kVisitKeyframes = 30;

/// Leaves a landmark the observations of reference keyframes and, of the others, those of the visit with
/// most; they are in the order of keyframes. So visits of a place share landmarks with those that stand for
/// it and not all with all, as adjust_by_references needs it.
void bound_covisibility(std::vector<BundleObservation>& observations, const std::vector<bool>& is_reference);

}  // namespace hm
