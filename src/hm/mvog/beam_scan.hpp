#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>

namespace hm {

/// Range measurements from one origin, of any sensor: the space between origin and end is free, the end of a
/// return is occupied.
struct BeamScan {
  Eigen::Vector3d p_world_origin = Eigen::Vector3d::Zero();
  std::span<const Eigen::Vector3f> p_world_returns;     ///< end points of beams with a return
  std::span<const Eigen::Vector3f> p_world_no_returns;  ///< points up to which beams without return are free
};

/// Statistics of one insertion.
struct BeamScanStats {
  std::size_t returns = 0, no_returns = 0;  ///< beams used
  std::size_t not_finite = 0;               ///< beams skipped: NaN or infinite
  std::size_t out_of_bounds = 0;            ///< beams skipped: too long, or outside the map's index range
  std::size_t columns = 0;                  ///< columns observed by the scan
  std::size_t columns_refused = 0;          ///< of these, not updated because of the memory limit
  bool same_view = false;                   ///< taken from (almost) the same position as a recent scan
};

}  // namespace hm
