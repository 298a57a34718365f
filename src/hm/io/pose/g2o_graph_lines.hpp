#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "hm/geometry/pose_edge_kind.hpp"
#include "hm/io/bytes/skip_counter.hpp"
#include "hm/io/bytes/text_lines.hpp"
#include "hm/io/laser/laser_log.hpp"
#include "hm/io/pose/g2o_file.hpp"

namespace hm::detail {

/// Collects the lines of a g2o file, by the ids of the file. The traits class `Words` defines the kind of
/// graph: Pose, Edge, Graph (a G2oGraph), kVertex, kEdge, kDimensions and pose(NumberReader&), which returns
/// nothing for invalid numbers.
template <class Words>
class G2oLines {
 public:
  using Pose = typename Words::Pose;
  using Edge = typename Words::Edge;

  /// Adds a line; false when it is malformed.
  bool add(const TextLine& line) {
    const auto columns = words(line.text);
    NumberReader reader(columns, 1);
    if (columns[0] == Words::kVertex) return add_vertex(reader);
    if (columns[0] == Words::kEdge) return add_edge(reader);
    if (columns[0] == "FIX") {
      while (reader.remaining() > 0) fixed_.push_back(static_cast<std::int64_t>(reader.count()));
      return reader.ok();
    }
    ++other_lines_;
    return true;
  }
  [[nodiscard]] bool empty() const { return nodes_.empty(); }
  /// Builds the graph with nodes numbered in order of id. Returns the id of a node that has no pose, if there
  /// is one.
  std::optional<std::int64_t> finish(typename Words::Graph& result);

 private:
  bool add_vertex(NumberReader& reader) {
    const auto id = static_cast<std::int64_t>(reader.count());
    const std::optional<Pose> pose = Words::pose(reader);
    if (!reader.ok() || reader.remaining() > 0 || !pose) return false;
    std::optional<Pose>& place = nodes_[id];
    if (place) return false;
    place = pose;
    return true;
  }
  bool add_edge(NumberReader& reader) {
    Edge edge;
    edge.from = reader.count();
    edge.to = reader.count();
    const std::optional<Pose> motion = Words::pose(reader);
    for (int row = 0; row < Words::kDimensions; ++row)
      for (int column = row; column < Words::kDimensions; ++column)
        edge.information(row, column) = edge.information(column, row) = reader.number();
    if (!reader.ok() || reader.remaining() > 0 || !motion || edge.from == edge.to) return false;
    if (edge.information.diagonal().minCoeff() < 0) return false;
    edge.T_from_to = *motion;
    nodes_[static_cast<std::int64_t>(edge.from)];
    nodes_[static_cast<std::int64_t>(edge.to)];
    edges_.push_back(edge);
    return true;
  }

  std::map<std::int64_t, std::optional<Pose>> nodes_;
  std::vector<Edge> edges_;
  std::vector<std::int64_t> fixed_;
  std::size_t other_lines_ = 0;
};

/// Initialises missing poses by composing edges, starting at nodes with a pose (breadth first). Returns the
/// first node that is still without a pose, if any.
template <class Pose, class Edge>
std::optional<std::size_t> place_along_edges(const std::vector<Edge>& edges,
                                             std::vector<std::optional<Pose>>& places) {
  std::vector<std::vector<std::size_t>> edges_of(places.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    edges_of[edges[e].from].push_back(e);
    edges_of[edges[e].to].push_back(e);
  }
  std::queue<std::size_t> open;
  if (!places.front()) places.front() = Pose();
  for (std::size_t i = 0; i < places.size(); ++i)
    if (places[i]) open.push(i);
  for (; !open.empty(); open.pop()) {
    const std::size_t at = open.front();
    for (const std::size_t e : edges_of[at]) {
      const bool forward = edges[e].from == at;
      const std::size_t next = forward ? edges[e].to : edges[e].from;
      if (places[next]) continue;
      places[next] = *places[at] * (forward ? edges[e].T_from_to : edges[e].T_from_to.inverse());
      open.push(next);
    }
  }
  for (std::size_t i = 0; i < places.size(); ++i)
    if (!places[i]) return i;
  return std::nullopt;
}

template <class Words>
std::optional<std::int64_t> G2oLines<Words>::finish(typename Words::Graph& result) {
  std::map<std::int64_t, std::size_t> index_of;
  std::vector<std::optional<Pose>> places;
  for (const auto& [id, place] : nodes_) {
    index_of[id] = places.size();
    result.ids.push_back(id);
    places.push_back(place);
  }
  for (Edge& edge : edges_) {
    edge.from = index_of[static_cast<std::int64_t>(edge.from)];
    edge.to = index_of[static_cast<std::int64_t>(edge.to)];
    edge.kind = edge.to == edge.from + 1 ? PoseEdgeKind::kOdometry : PoseEdgeKind::kLoop;
  }
  if (const auto left = place_along_edges(edges_, places)) return result.ids[*left];
  for (const auto& place : places) result.graph.T_map_node.push_back(*place);
  result.graph.edges = std::move(edges_);
  for (const std::int64_t id : fixed_)
    if (const auto found = index_of.find(id); found != index_of.end()) result.fixed.push_back(found->second);
  result.other_lines = other_lines_;
  return std::nullopt;
}

/// Reads a g2o file of one kind of graph.
template <class Words>
Result<typename Words::Graph> read_g2o(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  typename Words::Graph result;
  G2oLines<Words> lines;
  SkipCounter skips(path);
  for (const TextLine& line : file->lines()) {
    if (lines.add(line)) continue;
    if (line.ended)
      return fail(ErrorCode::kCorrupted, file->where(line), "no valid vertex, edge or FIX line: `{}`",
                  line.text);
    skips.add(SkippedLines::Reason::kCutOff, line.number);
  }
  if (lines.empty())
    return fail(ErrorCode::kNotFound, path, "no {} or {} line in this file", Words::kVertex, Words::kEdge);
  if (const auto left = lines.finish(result))
    return fail(ErrorCode::kCorrupted, path, "nothing says where node {} is: no vertex, no path of edges",
                *left);
  result.skipped = skips.take();
  return result;
}

}  // namespace hm::detail
