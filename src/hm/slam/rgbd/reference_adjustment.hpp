#pragma once
#include <vector>

#include "hm/slam/rgbd/bundle_adjustment.hpp"

namespace hm {

/// adjust_bundle in two parts: first the reference keyframes of all places (reference_keyframes; their number
/// is bounded by the places, not by the time spent there), with the motions between them over the keyframes
/// left out, then the others, carried along and adjusted with the references held. Landmarks must be bounded
/// (bound_covisibility): the second part then joins keyframes of one visit only, and its time is linear in
/// keyframes. Where all keyframes are references this is adjust_bundle, to the bit. Fixed keyframes count as
/// references.
///
/// Landmarks are carried along with the first keyframe that sees them. Costs and iterations are sums over
/// both parts. Stopped in the first part, the others are carried along and not adjusted. When the first part
/// fails nothing moves; when only the second does, its keyframes stay where they were carried.
BundleResult adjust_by_references(Bundle& bundle, std::vector<bool> is_reference,
                                  const BundleParams& params = {}, const RunContext& run = {});

}  // namespace hm
