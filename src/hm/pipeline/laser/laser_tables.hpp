#pragma once
#include <span>
#include <string>

#include "hm/pipeline/laser/laser_run.hpp"

namespace hm {

/// Height of every scan that was asked for one, a line each, with a header; empty when there is none.
std::string heights_csv(std::span<const LaserScanRecord> records);
/// The floors that were found, lowest first.
std::string floors_csv(std::span<const FloorLevel> floors);
/// The fused state at every scan; empty without an IMU.
std::string states_csv(std::span<const LaserScanRecord> records);

}  // namespace hm
