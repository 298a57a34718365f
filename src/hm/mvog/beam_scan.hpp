#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>

namespace hm {

/// Readings of one moment, from any sensor: the space between origin and end is free, and where a return
/// ends something is.
struct BeamScan {
  Eigen::Vector3d p_world_origin = Eigen::Vector3d::Zero();
  std::span<const Eigen::Vector3f> p_world_returns;     ///< ends of beams that hit something
  std::span<const Eigen::Vector3f> p_world_no_returns;  ///< beams that saw nothing up to this point
};

/// What one insertion did.
struct BeamScanStats {
  std::size_t returns = 0, no_returns = 0;  ///< beams used
  std::size_t not_finite = 0;               ///< beams skipped: NaN or infinite
  std::size_t out_of_bounds = 0;            ///< beams skipped: too long, or beyond what the map can index
  std::size_t columns = 0;                  ///< columns that the scan saw
  std::size_t columns_refused = 0;          ///< of these, not updated: the memory cap was reached
  bool same_view = false;                   ///< taken from (almost) the same place as a scan shortly before
};

}  // namespace hm
