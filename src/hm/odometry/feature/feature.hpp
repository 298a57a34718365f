#pragma once
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Binary descriptor of 256 comparisons (ORB: Rublee et al., ICCV 2011).
using BinaryDescriptor = std::array<std::uint64_t, 4>;

/// Number of differing bits of two descriptors, 0 to 256.
[[nodiscard]] inline int hamming_distance(const BinaryDescriptor& a, const BinaryDescriptor& b) {
  int bits = 0;
  for (std::size_t i = 0; i < a.size(); ++i) bits += std::popcount(a[i] ^ b[i]);
  return bits;
}

/// Corner of the colour image with its 3D position and covariance (dissertation 3.1.4, 3.2).
struct Feature {
  Vec2 pixel = Vec2::Zero();  ///< in the undistorted image, subpixel
  float response = 0;         ///< of the detector; larger is better
  float angle_rad = 0;        ///< orientation of the descriptor's patch
  int octave = 0;             ///< pyramid level: patches are 1.2^octave times as large
  BinaryDescriptor descriptor{};
  bool has_depth = false;  ///< depth valid, in range and certain enough: the two below are set
  Vec3 p_camera = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  ///< of p_camera, m^2, camera frame

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(pixel, response, angle_rad, octave, descriptor, has_depth);
    if (has_depth) archive(p_camera, covariance);
  }
};

using FeatureSet = std::vector<Feature>;

}  // namespace hm
