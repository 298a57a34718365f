#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/pose_graph_2d.hpp"
#include "hm/io/recording.hpp"

namespace hm {

/// A planar pose graph as g2o text has it.
struct G2oGraph2D {
  PoseGraph2D graph;
  std::vector<std::int64_t> ids;           ///< of the nodes, in their order; ascending
  std::vector<std::size_t> fixed;          ///< nodes that FIX lines name
  std::size_t other_lines = 0;             ///< of kinds that a planar pose graph has no use for
  std::vector<SkippedLines> skipped = {};  ///< a last line that is cut off
};

/// Reads VERTEX_SE2 `id x y angle`, EDGE_SE2 `from to x y angle` with the upper triangle of the information
/// (6 numbers, row by row) and FIX lines. Edges between consecutive nodes are odometry, others loops. Nodes
/// that only edges name begin where the edge that first reaches them puts them, from the lowest id on. An
/// error names file:line: not a number, an id beyond a million or given twice, an edge from a node to itself,
/// an information with a negative diagonal. An error is also a node that no edge connects to the first one
/// and no vertex places, and a file without nodes.
Result<G2oGraph2D> read_g2o_2d(const std::filesystem::path& path);

/// Writes a graph so, nodes numbered from 0, the first one fixed. Numbers read back as they were.
Result<void> write_g2o_2d(const PoseGraph2D& graph, const std::filesystem::path& path);

}  // namespace hm
