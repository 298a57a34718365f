#include "hm/io/g2o_file.hpp"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <queue>

#include "hm/io/laser_log.hpp"
#include "hm/io/output_file.hpp"
#include "hm/io/skip_counter.hpp"
#include "hm/io/text_lines.hpp"

namespace hm {
namespace {

/// What the lines hold, by the ids of the file.
class G2oLines {
 public:
  /// False when the line cannot be understood.
  bool add(const TextLine& line) {
    const auto columns = words(line.text);
    detail::NumberReader reader(columns, 1);
    if (columns[0] == "VERTEX_SE2") return add_vertex(reader);
    if (columns[0] == "EDGE_SE2") return add_edge(reader);
    if (columns[0] == "FIX") {
      while (reader.remaining() > 0) fixed_.push_back(static_cast<std::int64_t>(reader.count()));
      return reader.ok();
    }
    ++other_lines_;
    return true;
  }
  /// The graph with nodes numbered in order of id; the id of one that has no place, if there is one.
  std::optional<std::int64_t> finish(G2oGraph2D& result);

 private:
  bool add_vertex(detail::NumberReader& reader) {
    const auto id = static_cast<std::int64_t>(reader.count());
    const SE2 pose = reader.pose();
    if (!reader.ok() || reader.remaining() > 0) return false;
    std::optional<SE2>& place = nodes_[id];
    if (place) return false;
    place = pose;
    return true;
  }
  bool add_edge(detail::NumberReader& reader) {
    PoseEdge2D edge;
    edge.from = reader.count();
    edge.to = reader.count();
    edge.T_from_to = reader.pose();
    for (int row = 0; row < 3; ++row)
      for (int column = row; column < 3; ++column)
        edge.information(row, column) = edge.information(column, row) = reader.number();
    if (!reader.ok() || reader.remaining() > 0 || edge.from == edge.to) return false;
    if (edge.information.diagonal().minCoeff() < 0) return false;
    nodes_[static_cast<std::int64_t>(edge.from)];
    nodes_[static_cast<std::int64_t>(edge.to)];
    edges_.push_back(edge);
    return true;
  }

  std::map<std::int64_t, std::optional<SE2>> nodes_;
  std::vector<PoseEdge2D> edges_;
  std::vector<std::int64_t> fixed_;
  std::size_t other_lines_ = 0;
};

/// Places nodes along the edges, from those that have a place. The first node without one, if any is left.
std::optional<std::size_t> place_along_edges(const std::vector<PoseEdge2D>& edges,
                                             std::vector<std::optional<SE2>>& places) {
  std::vector<std::vector<std::size_t>> edges_of(places.size());
  for (std::size_t e = 0; e < edges.size(); ++e) {
    edges_of[edges[e].from].push_back(e);
    edges_of[edges[e].to].push_back(e);
  }
  std::queue<std::size_t> open;
  if (!places.front()) places.front() = SE2();
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

std::optional<std::int64_t> G2oLines::finish(G2oGraph2D& result) {
  std::map<std::int64_t, std::size_t> index_of;
  std::vector<std::optional<SE2>> places;
  for (const auto& [id, place] : nodes_) {
    index_of[id] = places.size();
    result.ids.push_back(id);
    places.push_back(place);
  }
  for (PoseEdge2D& edge : edges_) {
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

}  // namespace

Result<G2oGraph2D> read_g2o_2d(const std::filesystem::path& path) {
  const auto file = TextFile::read(path);
  if (!file) return forward_error(file);
  G2oGraph2D result;
  G2oLines lines;
  detail::SkipCounter skips(path);
  bool any = false;
  for (const TextLine& line : file->lines()) {
    if (lines.add(line))
      any = any || line.text.starts_with("VERTEX_SE2") || line.text.starts_with("EDGE_SE2");
    else if (line.ended)
      return fail(ErrorCode::kCorrupted, file->where(line), "no valid vertex, edge or FIX line: `{}`",
                  line.text);
    else
      skips.add(SkippedLines::Reason::kCutOff, line.number);
  }
  if (!any) return fail(ErrorCode::kNotFound, path, "no VERTEX_SE2 or EDGE_SE2 line in this file");
  if (const auto left = lines.finish(result))
    return fail(ErrorCode::kCorrupted, path, "nothing says where node {} is: no vertex, no path of edges",
                *left);
  result.skipped = skips.take();
  return result;
}

Result<void> write_g2o_2d(const PoseGraph2D& graph, const std::filesystem::path& path) {
  OutputFile file(path);
  for (std::size_t i = 0; i < graph.T_map_node.size(); ++i) {
    const SE2& node = graph.T_map_node[i];
    file.write(fmt::format("VERTEX_SE2 {} {} {} {}\n", i, node.x(), node.y(), node.angle()));
  }
  if (!graph.T_map_node.empty()) file.write("FIX 0\n");
  for (const PoseEdge2D& edge : graph.edges) {
    const SE2& T = edge.T_from_to;
    const Mat3& w = edge.information;
    file.write(fmt::format("EDGE_SE2 {} {} {} {} {} {} {} {} {} {} {}\n", edge.from, edge.to, T.x(), T.y(),
                           T.angle(), w(0, 0), w(0, 1), w(0, 2), w(1, 1), w(1, 2), w(2, 2)));
  }
  return file.finish();
}

}  // namespace hm
