#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

#include "hm/slam/rgbd/surface_calibration.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm::test {

/// A depth image of a room, by landmark_camera(), and its surfaces as a camera of other intrinsics shows
/// them.
struct DepthView {
  DepthGrid grid;
  std::vector<SurfaceElement> elements;

  DepthView(const Vec3& half_size_m, const SE3& T_world_depth, Rng& rng, const ReadingError& error = {},
            const PinholeCamera& taken_for = landmark_camera())
      : grid(make_depth_grid(depth_in_room(half_size_m, T_world_depth, rng, error), taken_for, {}, 5)),
        elements(sample_surface(grid, {}, 4)) {}
};

/// A camera that walks through a room and looks into its corners, each time from elsewhere; or, not
/// `turning`, always in the same direction.
class DepthWalk {
 public:
  DepthWalk(const Vec3& half_size_m, const ReadingError& error, std::uint64_t seed = 1,
            const PinholeCamera& taken_for = landmark_camera(), bool turning = true) {
    Rng rng(seed);
    for (int i = 0; i < 16; ++i) {
      const double angle = turning ? 0.4 * i : 0.6, nod = turning ? 0.35 * std::sin(1.7 * i) : 0.2;
      const Mat3 R = so3_exp(Vec3(0, angle, 0)) * so3_exp(Vec3(nod, 0, 0));
      poses_.emplace_back(R, Vec3(0.7 * std::sin(2.1 * i), 0.3 * std::sin(1.3 * i), 0.7 * std::cos(1.1 * i)));
      views_.emplace_back(half_size_m, poses_.back(), rng, error, taken_for);
    }
  }
  /// Motions are `off` by some centimetres, as odometry's are with wrong depth.
  [[nodiscard]] std::vector<SurfacePair> pairs(const SE3& off = {}) const {
    std::vector<SurfacePair> pairs;
    for (std::uint32_t a = 0; a + 1 < views_.size(); ++a)
      pairs.push_back({views_[a].elements, views_[a + 1].grid, off * poses_[a + 1].inverse() * poses_[a], a});
    return pairs;
  }

 private:
  std::vector<SE3> poses_;
  std::vector<DepthView> views_;
};

inline const Vec3 kHalfRoom_m(2.0, 1.3, 1.7);
inline const SE3 kOffMotion = SE3::exp((Vec6() << 0.02, -0.01, 0.015, 0.005, 0.004, -0.004).finished());

/// Compares a residual's derivatives by motion and value with differences. Returns how many were compared.
template <class Residual>
std::size_t expect_derivatives(SurfacePair pair, std::initializer_list<double> values,
                               const Residual& residual) {
  constexpr double kStep = 1e-6;
  std::size_t compared = 0;
  const SE3 T = pair.T_grid_element;
  for (const SurfaceElement& element : pair.elements)
    for (const double value : values) {
      pair.T_grid_element = T;
      const auto seen = residual(pair, element, value, DepthNoise());
      for (int k = 0; seen && k < 7; ++k) {
        const auto moved = [&](double step) {
          Vec6 move = Vec6::Zero();
          if (k < 6) move[k] = step;
          pair.T_grid_element = SE3::exp(move) * T;
          return residual(pair, element, value + (k == 6 ? step : 0), DepthNoise());
        };
        const auto more = moved(kStep), less = moved(-kStep);
        // Where a step reaches the next pixel, the reading is another one.
        if (!more || !less || std::abs(more->distance_m - less->distance_m) > 1e-4) continue;
        const double difference = (more->distance_m - less->distance_m) / (2 * kStep);
        EXPECT_NEAR(seen->jacobian[k], difference, 1e-4 * (1 + std::abs(difference))) << k;
        ++compared;
      }
    }
  return compared;
}

}  // namespace hm::test
