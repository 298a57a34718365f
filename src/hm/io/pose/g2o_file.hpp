#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/pose_graph_2d.hpp"
#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/io/rgbd/recording.hpp"

namespace hm {

/// A pose graph as g2o text has it.
template <class PoseGraph>
struct G2oGraph {
  PoseGraph graph;
  std::vector<std::int64_t> ids;           ///< of the nodes, in their order; ascending
  std::vector<std::size_t> fixed;          ///< nodes that FIX lines name
  std::size_t other_lines = 0;             ///< of kinds that such a pose graph has no use for
  std::vector<SkippedLines> skipped = {};  ///< a last line that is cut off
};
using G2oGraph2D = G2oGraph<PoseGraph2D>;
using G2oGraph3D = G2oGraph<PoseGraph3D>;

/// Reads VERTEX_SE2 `id x y angle`, EDGE_SE2 `from to x y angle` with the upper triangle of the information
/// (6 numbers, row by row) and FIX lines. Edges between consecutive nodes are odometry, others loops. Nodes
/// that only edges name begin where the edge that first reaches them puts them, from the lowest id on. An
/// error names file:line: not a number, an id beyond a million or given twice, an edge from a node to itself,
/// an information with a negative diagonal. An error is also a node that no edge connects to the first one
/// and no vertex places, and a file without nodes.
Result<G2oGraph2D> read_g2o_2d(const std::filesystem::path& path);

/// Writes a graph so, nodes numbered from 0, the first one fixed. Numbers read back as they were.
Result<void> write_g2o_2d(const PoseGraph2D& graph, const std::filesystem::path& path);

/// Reads a pose graph in space, as read_g2o_2d(): VERTEX_SE3:QUAT `id x y z qx qy qz qw` and EDGE_SE3:QUAT
/// with 21 numbers of information. An error is also a quaternion whose norm differs from 1 by a hundredth.
/// The information is taken as that of [translation; rotation vector], as public data sets and solvers other
/// than g2o have it (g2o's own is of the quaternion's vector part: four times as large).
Result<G2oGraph3D> read_g2o_3d(const std::filesystem::path& path);
Result<void> write_g2o_3d(const PoseGraph3D& graph, const std::filesystem::path& path);

}  // namespace hm
