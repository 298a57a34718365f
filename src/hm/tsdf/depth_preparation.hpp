#pragma once
#include "hm/core/parallel.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/depth_edges.hpp"
#include "hm/tsdf/projection_scan.hpp"

namespace hm {

/// Turns a depth image into metres with range limits, edges and tile extremes; `prepared` keeps its memory
/// from scan to scan.
void prepare_depth(const DepthImage& depth, const TsdfParams& params, const EdgeRule& edges,
                   const ParallelLoop& loop, PreparedDepth& prepared);

}  // namespace hm
