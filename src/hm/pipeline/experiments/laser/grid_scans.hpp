#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {

/// The returns of one scan in the world.
struct GridScan {
  Vec3 p_world_origin = Vec3::Zero();
  std::vector<Eigen::Vector3f> p_world_points;
};

/// Scans of lasers that a vehicle carries, in order of time.
struct GridScans {
  std::string words;  ///< of the page
  std::vector<GridScan> scans;
  [[nodiscard]] std::size_t beams() const;
};

/// The scans of a recording with the poses of its odometry. Errors: those of open_laser_recording(); no
/// scan with a pose.
Result<GridScans> recorded_grid_scans(const std::filesystem::path& recording, std::size_t most);

/// Scans as the New College set has them, of two vertical lasers of 181 beams to the left and right, along
/// the walk through a simulated world; ranges have a noise of 1 cm and reach 20 m.
GridScans simulated_grid_scans(WorldKind world, std::size_t most, std::uint64_t seed);

}  // namespace hm
