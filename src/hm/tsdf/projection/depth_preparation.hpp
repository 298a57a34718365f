#pragma once
#include "hm/core/parallel.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/tsdf/projection/depth_edges.hpp"
#include "hm/tsdf/projection/projection_scan.hpp"

namespace hm {

/// A depth image, and how to read it.
struct RawDepth {
  const DepthImage& depth;
  double near_m = 0, far_m = 0;  ///< readings between them are in range
  EdgeRule edges;
  TruncationModel truncation;          ///< with it, how much a reading at an edge weighs
  float edge_weight_numerator = 0;     ///< see ProjectionScan
  const Image<Rgb8>* color = nullptr;  ///< called into the cache meanwhile: projection will look all over it

  RawDepth(const DepthImage& image, const TsdfParams& params, const EdgeRule& rule,
           const ProjectionScan& scan)
      : depth(image),
        near_m(params.near_m),
        far_m(params.far_m),
        edges(rule),
        truncation(scan.truncation),
        edge_weight_numerator(scan.edge_weight_numerator) {}
};

/// Turns a depth image into metres with range limits, edges and tile extremes; `prepared` keeps its memory
/// from scan to scan.
void prepare_depth(const RawDepth& raw, const ParallelLoop& loop, PreparedDepth& prepared);

}  // namespace hm
