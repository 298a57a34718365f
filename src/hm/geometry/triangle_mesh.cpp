#include "hm/geometry/triangle_mesh.hpp"

#include <algorithm>

namespace hm {
namespace {

Vec3 vertex(const TriangleMesh& mesh, std::uint32_t index) { return mesh.vertices[index].cast<double>(); }

}  // namespace

Box3 bounds(const TriangleMesh& mesh) {
  Box3 box;
  for (const auto& v : mesh.vertices) box.extend(v.cast<double>());
  return box;
}

double surface_area(const TriangleMesh& mesh) {
  double twice = 0;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = vertex(mesh, t[0]);
    twice += (vertex(mesh, t[1]) - a).cross(vertex(mesh, t[2]) - a).norm();
  }
  return 0.5 * twice;
}

double enclosed_volume(const TriangleMesh& mesh) {
  double six_times = 0;
  for (const auto& t : mesh.triangles)
    six_times += vertex(mesh, t[0]).dot(vertex(mesh, t[1]).cross(vertex(mesh, t[2])));
  return six_times / 6.0;
}

std::vector<std::array<std::uint32_t, 2>> open_edges(const TriangleMesh& mesh) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  edges.reserve(mesh.triangles.size() * 3);
  for (const auto& t : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3];
      edges.push_back({std::min(a, b), std::max(a, b)});
    }
  std::sort(edges.begin(), edges.end());
  std::vector<std::array<std::uint32_t, 2>> open;
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end] == edges[begin]) ++end;
    if (end - begin == 1) open.push_back(edges[begin]);
  }
  return open;
}

void compute_normals(TriangleMesh& mesh) {
  mesh.normals.assign(mesh.vertices.size(), Eigen::Vector3f::Zero());
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f& a = mesh.vertices[t[0]];
    const Eigen::Vector3f normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a);
    for (const std::uint32_t index : t) mesh.normals[index] += normal;
  }
  for (auto& normal : mesh.normals) {
    const float length = normal.norm();
    normal = length > 0 ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::UnitZ();
  }
}

}  // namespace hm
