#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/pose_graph_2d.hpp"
#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/io/bytes/skipped_lines.hpp"

namespace hm {

/// Pose graph read from g2o text.
template <class PoseGraph>
struct G2oGraph {
  PoseGraph graph;
  std::vector<std::int64_t> ids;           ///< g2o id of each node, ascending
  std::vector<std::size_t> fixed;          ///< nodes listed in FIX lines
  std::size_t other_lines = 0;             ///< lines of other kinds, ignored
  std::vector<SkippedLines> skipped = {};  ///< a truncated last line
};
using G2oGraph2D = G2oGraph<PoseGraph2D>;
using G2oGraph3D = G2oGraph<PoseGraph3D>;

/// Reads VERTEX_SE2 `id x y angle`, EDGE_SE2 `from to x y angle` with the upper triangle of the information
/// matrix (6 numbers, row by row) and FIX lines. Edges between consecutive nodes are odometry, others loops.
/// Nodes without a vertex are initialised along the edges, from the lowest id on. Errors name file:line: not
/// a number, an id beyond a million or repeated, an edge from a node to itself, a negative diagonal of the
/// information; also a node that has no vertex and is not connected to the first one, and a file without
/// nodes.
Result<G2oGraph2D> read_g2o_2d(const std::filesystem::path& path);

/// Writes a graph in the same format, nodes numbered from 0, the first one fixed. Numbers round-trip exactly.
Result<void> write_g2o_2d(const PoseGraph2D& graph, const std::filesystem::path& path);

/// The same in 3D: VERTEX_SE3:QUAT `id x y z qx qy qz qw` and EDGE_SE3:QUAT with 21 numbers of information. A
/// quaternion whose norm differs from 1 by more than 0.01 is also an error. The information is that of
/// [translation; rotation vector], as in public data sets and solvers other than g2o (g2o's own refers to the
/// quaternion's vector part: four times as large).
Result<G2oGraph3D> read_g2o_3d(const std::filesystem::path& path);
Result<void> write_g2o_3d(const PoseGraph3D& graph, const std::filesystem::path& path);

}  // namespace hm
