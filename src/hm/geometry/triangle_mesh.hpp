#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "hm/geometry/box.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"

namespace hm {

/// An indexed triangle mesh in metres, counter-clockwise seen from outside. `normals` and `colors` are
/// empty or as long as `vertices`.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector3f> normals;
  std::vector<Rgb8> colors;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  [[nodiscard]] bool has_normals() const { return !normals.empty() && normals.size() == vertices.size(); }
  [[nodiscard]] bool has_colors() const { return !colors.empty() && colors.size() == vertices.size(); }
};

/// The box around all vertices.
Box3 bounds(const TriangleMesh& mesh);
/// The sum of the triangles' areas, square metres.
double surface_area(const TriangleMesh& mesh);
/// The signed volume enclosed by a closed mesh (positive when it is oriented outwards), cubic metres.
double enclosed_volume(const TriangleMesh& mesh);
/// Edges that belong to one triangle only (holes and borders), each once, as vertex indices.
std::vector<std::array<std::uint32_t, 2>> open_edges(const TriangleMesh& mesh);
/// Area-weighted vertex normals, replacing those that are there.
void compute_normals(TriangleMesh& mesh);

}  // namespace hm
