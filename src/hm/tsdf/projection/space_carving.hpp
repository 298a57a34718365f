#pragma once
#include "hm/tsdf/projection/projection_scan.hpp"
#include "hm/tsdf/projection/voxel_observation.hpp"

namespace hm {

/// Space carving (4.2.3, Fig. 4.7) in a volume that no surface measured by the scan passes: rays that end
/// well behind a voxel contradict a surface remembered there. A solid voxel (distance <= 0) loses weight
/// until it is unknown, where all readings around its pixel lie behind it. Where only its own reading does,
/// and just in front of a remembered surface (distance below ProjectionScan::stale_below), a voxel is
/// observed as free. Freer voxels stay as they are. Adds to `update` what was carved. Scalar reference;
/// `CarveVector` in projection_simd.cpp gives the same bits.
void carve_volume(const ProjectionScan& scan, const ProjectionTask& task,
                  const VolumeObservations& observations, VolumeUpdate& update);

}  // namespace hm
