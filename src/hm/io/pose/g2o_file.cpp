#include "hm/io/pose/g2o_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "hm/io/bytes/output_file.hpp"
#include "hm/io/pose/g2o_graph_lines.hpp"

namespace hm {
namespace {

struct PlanarWords {
  using Pose = SE2;
  using Edge = PoseEdge2D;
  using Graph = G2oGraph2D;
  static constexpr std::string_view kVertex = "VERTEX_SE2", kEdge = "EDGE_SE2";
  static constexpr int kDimensions = 3;
  static std::optional<SE2> pose(detail::NumberReader& reader) { return reader.pose(); }
};

struct SpatialWords {
  using Pose = SE3;
  using Edge = PoseEdge3D;
  using Graph = G2oGraph3D;
  static constexpr std::string_view kVertex = "VERTEX_SE3:QUAT", kEdge = "EDGE_SE3:QUAT";
  static constexpr int kDimensions = 6;
  static std::optional<SE3> pose(detail::NumberReader& reader) {
    constexpr double kNormTolerance = 1e-2;
    double numbers[7];
    for (double& one : numbers) one = reader.number();
    const Eigen::Quaterniond q(numbers[6], numbers[3], numbers[4], numbers[5]);
    if (!(std::abs(q.norm() - 1) < kNormTolerance)) return std::nullopt;
    return SE3(q, Vec3(numbers[0], numbers[1], numbers[2]));
  }
};

std::string g2o_pose_text(const SE3& T) {
  const Eigen::Quaterniond q = T.quaternion();
  const Vec3& t = T.translation();
  return fmt::format("{} {} {} {} {} {} {}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

}  // namespace

Result<G2oGraph2D> read_g2o_2d(const std::filesystem::path& path) {
  return detail::read_g2o<PlanarWords>(path);
}

Result<G2oGraph3D> read_g2o_3d(const std::filesystem::path& path) {
  return detail::read_g2o<SpatialWords>(path);
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

Result<void> write_g2o_3d(const PoseGraph3D& graph, const std::filesystem::path& path) {
  OutputFile file(path);
  for (std::size_t i = 0; i < graph.T_map_node.size(); ++i)
    file.write(fmt::format("VERTEX_SE3:QUAT {} {}\n", i, g2o_pose_text(graph.T_map_node[i])));
  if (!graph.T_map_node.empty()) file.write("FIX 0\n");
  for (const PoseEdge3D& edge : graph.edges) {
    file.write(fmt::format("EDGE_SE3:QUAT {} {} {}", edge.from, edge.to, g2o_pose_text(edge.T_from_to)));
    for (int row = 0; row < 6; ++row)
      for (int column = row; column < 6; ++column)
        file.write(fmt::format(" {}", edge.information(row, column)));
    file.write("\n");
  }
  return file.finish();
}

}  // namespace hm
