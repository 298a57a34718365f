#pragma once
#include "hm/core/parallel.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/projection/depth_edges.hpp"
#include "hm/tsdf/projection/projection_scan.hpp"

namespace hm {

/// Depth image and parameters of its preparation.
struct RawDepth {
  const DepthImage& depth;
  double near_m = 0, far_m = 0;  ///< readings between them are in range
  EdgeRule edges;
  TruncationModel truncation;          ///< for the weight of readings at edges
  float edge_weight_numerator = 0;     ///< see ProjectionScan
  const Image<Rgb8>* color = nullptr;  ///< prefetched into the cache for the projection

  RawDepth(const DepthImage& image, const TsdfParams& params, const EdgeRule& rule,
           const ProjectionScan& scan)
      : depth(image),
        near_m(params.near_m),
        far_m(params.far_m),
        edges(rule),
        truncation(scan.truncation),
        edge_weight_numerator(scan.edge_weight_numerator) {}
};

/// Converts a depth image to metres with range limits, edges and tile extremes; reuses the memory of
/// `prepared`.
void prepare_depth(const RawDepth& raw, const ParallelLoop& loop, PreparedDepth& prepared);

}  // namespace hm
