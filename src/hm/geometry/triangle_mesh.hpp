#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "hm/geometry/box.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// Indexed triangle mesh in metres; triangles are counter-clockwise seen from outside. `normals` and `colors`
/// are empty or as long as `vertices`.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3f> normals;
  std::vector<Rgb8> colors;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  [[nodiscard]] bool has_normals() const { return !normals.empty() && normals.size() == vertices.size(); }
  [[nodiscard]] bool has_colors() const { return !colors.empty() && colors.size() == vertices.size(); }
};

/// Bounding box of all vertices.
Box3 bounds(const TriangleMesh& mesh);
/// Sum of the triangle areas, square metres.
double surface_area(const TriangleMesh& mesh);
/// Signed volume of a closed mesh in cubic metres (positive when oriented outwards).
double enclosed_volume(const TriangleMesh& mesh);
/// Edges that belong to one triangle only (holes and borders), each once, as vertex indices.
std::vector<std::array<std::uint32_t, 2>> open_edges(const TriangleMesh& mesh);
/// Computes area-weighted vertex normals, replacing existing ones.
void compute_normals(TriangleMesh& mesh);

}  // namespace hm
