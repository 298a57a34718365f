#pragma once
#include <cstdint>

#include "hm/tsdf/grid/volume.hpp"

namespace hm {

/// Discrete update filters (dissertation 4.2.6): weighted running means in integers, free of drift (round to
/// nearest even) and of stalls (an observation of weight 1 that differs moves the mean by at least one unit;
/// one of weight w < 1 if it differs by at least 0.5 / w units). Weight 0 changes nothing. Scalar reference
/// for the vector code, which must match it bit by bit: single precision, no fused multiply-add.

/// Nearest integer, ties to even; |x| < 2^22.
inline float round_to_even(float x) {
  constexpr float kMagic = 12582912.0f;  // 1.5 * 2^23: adding it leaves no bits for a fraction
  return (x + kMagic) - kMagic;
}

/// Step of a mean towards a sample at `difference`, with gain in [0, 1]; `weight` of the sample in
/// 1/kWeightOne.
inline float filter_step(float difference, float gain, float weight) {
  constexpr float kLeast = 0.5f * static_cast<float>(kWeightOne);
  const float step = round_to_even(difference * gain);
  if (step != 0.0f) return step;
  if (difference * weight >= kLeast) return 1.0f;
  if (difference * weight <= -kLeast) return -1.0f;
  return 0.0f;
}

/// Adds an observation: `sample` in sdf units (within 16 bits), `weight` and `cap` in 1/kWeightOne.
inline TsdfVoxel add_observation(TsdfVoxel voxel, float sample, float weight, float cap) {
  const auto mean = static_cast<float>(voxel.sdf());
  const auto old_weight = static_cast<float>(voxel.weight());
  const float new_weight = old_weight + weight;
  // Weights are integers, at least 1 if not zero.
  const float step = filter_step(sample - mean, weight / (new_weight > 1.0f ? new_weight : 1.0f), weight);
  return TsdfVoxel::make(static_cast<std::int16_t>(mean + step),
                         static_cast<std::uint16_t>(new_weight < cap ? new_weight : cap));
}

/// Removes weight (space carving, 4.2.3); the voxel becomes unknown when none is left.
inline TsdfVoxel take_weight(TsdfVoxel voxel, float weight) {
  const float left = static_cast<float>(voxel.weight()) - weight;
  if (left <= 0.0f) return {};
  return TsdfVoxel::make(voxel.sdf(), static_cast<std::uint16_t>(left));
}

/// Gain of a colour observation, 1 / (weight + 1), in 1/16384.
inline std::int32_t color_gain(std::uint32_t old_weight) {
  return static_cast<std::int32_t>(round_to_even(16384.0f / static_cast<float>(old_weight + 1)));
}

/// Adds a colour observation; `cap` in observations. Computed in 16-bit integers, so that vector code
/// processes two channels per lane: step = round(difference * gain), at least one level if there is a
/// difference.
inline ColorVoxel add_color(ColorVoxel voxel, std::uint32_t rgb, std::uint32_t cap) {
  const std::uint32_t old_weight = voxel.bits >> 24u;
  const std::int32_t gain = color_gain(old_weight);
  std::uint32_t bits = (old_weight < cap ? old_weight + 1 : cap) << 24u;
  for (unsigned shift = 0; shift < 24; shift += 8) {
    const auto mean = static_cast<std::int32_t>(voxel.bits >> shift & 0xffu);
    const std::int32_t difference = static_cast<std::int32_t>(rgb >> shift & 0xffu) - mean;
    std::int32_t step = (2 * difference * gain + 0x4000) >> 15;
    if (step == 0) step = (difference > 0) - (difference < 0);
    bits |= static_cast<std::uint32_t>(mean + step) << shift;
  }
  return {bits};
}

}  // namespace hm
