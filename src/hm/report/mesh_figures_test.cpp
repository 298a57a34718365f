#include "hm/report/mesh_figures.hpp"

#include <gtest/gtest.h>

namespace hm {
namespace {

/// A floor of 4 x 4 m with a wall, grey.
TriangleMesh corner_of_a_room() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {4, 0, 0}, {4, 4, 0}, {0, 4, 0}, {0, 4, 2}, {4, 4, 2}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {3, 2, 5}, {3, 5, 4}};
  mesh.normals.assign(4, Eigen::Vector3f::UnitZ());
  mesh.normals.resize(6, -Eigen::Vector3f::UnitY());
  mesh.colors.assign(6, Rgb8{120, 120, 120});
  return mesh;
}

std::vector<std::string> names_of(const MeshFigureOptions& options) {
  std::vector<std::string> names;
  for (const Figure& figure : make_mesh_figures(corner_of_a_room(), options, ParallelLoop(1))) {
    names.push_back(figure.name);
    EXPECT_EQ(figure.image.width(), options.width_px) << figure.name;
    EXPECT_FALSE(figure.caption.empty()) << figure.name;
  }
  return names;
}

TEST(MeshFigures, ForAComparisonOnlyColourAndPlanAreDrawn) {
  MeshFigureOptions options;
  options.width_px = 140, options.height_px = 90;
  options.T_world_camera = SE3(Mat3::Identity(), Vec3(2, 2, -3));
  EXPECT_EQ(names_of(options), (std::vector<std::string>{"shaded", "color", "height", "camera", "plan"}));
  options.is_for_comparison = true;
  EXPECT_EQ(names_of(options), (std::vector<std::string>{"color", "plan"}));
}

TEST(MeshFigures, WithoutColoursAComparisonIsThePlan) {
  TriangleMesh mesh = corner_of_a_room();
  mesh.colors.clear();
  MeshFigureOptions options;
  options.width_px = 140, options.height_px = 90;
  options.is_for_comparison = true;
  const auto figures = make_mesh_figures(mesh, options, ParallelLoop(1));
  ASSERT_EQ(figures.size(), 1U);
  EXPECT_EQ(figures.front().name, "plan");
}

TEST(MeshFigures, AnEmptyMeshHasNone) { EXPECT_TRUE(make_mesh_figures({}, {}, ParallelLoop(1)).empty()); }

}  // namespace
}  // namespace hm
