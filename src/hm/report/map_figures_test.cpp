#include "hm/report/map_figures.hpp"

#include <gtest/gtest.h>

namespace hm {
namespace {

OccupancyVoxel voxel(float x, float y, float z, Occupancy state = Occupancy::kOccupied) {
  return {{x, y, z}, 0.1F, state == Occupancy::kOccupied ? 0.9F : 0.1F, state};
}

TEST(OccupiedFaces, AreTheSurfaceOfWhatIsOccupied) {
  const std::vector<OccupancyVoxel> one{voxel(-0.05F, 0.05F, 0.35F),
                                        voxel(0.05F, 0.05F, 0.35F, Occupancy::kFree)};
  const TriangleMesh cube = occupied_faces(one, 0.1);
  EXPECT_EQ(cube.triangles.size(), 12U);
  EXPECT_NEAR(surface_area(cube), 0.06, 1e-6);
  EXPECT_NEAR(enclosed_volume(cube), 1e-3, 1e-6);  // positive: the faces look outwards
  EXPECT_EQ(cube.colors.size(), cube.vertices.size());
  const std::vector<OccupancyVoxel> bar{voxel(0.05F, 0.05F, 0.05F), voxel(0.15F, 0.05F, 0.05F),
                                        voxel(0.25F, 0.05F, 0.05F)};
  const TriangleMesh faces = occupied_faces(bar, 0.1);
  EXPECT_EQ(faces.triangles.size(), 28U);
  EXPECT_NEAR(enclosed_volume(faces), 3e-3, 1e-6);
  EXPECT_TRUE(occupied_faces({}, 0.1).triangles.empty());
}

TEST(OccupancyFigure, ShowsWallsUpwards) {
  OccupancyGrid2D grid;
  grid.cells = Image<std::uint8_t>(40, 30, OccupancyGrid2D::kUnknown);
  for (int x = 0; x < 40; ++x)
    for (int y = 10; y < 30; ++y) grid.cells(x, y) = y == 29 ? 100 : 0;
  const auto figure = draw_occupancy_grid(grid, {});
  ASSERT_TRUE(figure);
  EXPECT_EQ(figure->width(), 12 * 40);
  EXPECT_LT((*figure)(400, 2).r, 60);     // the highest y is at the top: the wall
  EXPECT_GT((*figure)(400, 100).r, 240);  // free
  EXPECT_LT((*figure)(400, 300).r, 220);  // unknown
  EXPECT_FALSE(draw_occupancy_grid({}, {}));
}

TEST(OccupancyFigure, APictureSmallerThanTheGridKeepsItsWalls) {
  OccupancyGrid2D grid;
  grid.cells = Image<std::uint8_t>(5000, 40, 0);
  for (int y = 0; y < 40; ++y) grid.cells(2500, y) = 100;
  const auto figure = draw_occupancy_grid(grid, {});
  ASSERT_TRUE(figure);
  ASSERT_EQ(figure->width(), 1400);
  EXPECT_LT((*figure)(700, 0).r, 60);
  EXPECT_GT((*figure)(650, 0).r, 240);
}

/// The same map in a frame with y down gives the same figure, but for the rows in between.
TEST(HeightFigure, HeightsAreMeasuredAlongUp) {
  std::vector<OccupancyVoxel> upright, y_down;
  for (int x = 0; x < 12; ++x)
    for (int y = 0; y < 8; ++y) {
      const float z = static_cast<float>(x < 6 ? 0 : y % 3) + 0.05F;
      const float u = 0.1F * static_cast<float>(x) + 0.05F, v = 0.1F * static_cast<float>(y) + 0.05F;
      upright.push_back(voxel(u, v, z));
      y_down.push_back(voxel(u, -z, v));
    }
  const auto a = draw_heights(upright, 0.1), b = draw_heights(y_down, 0.1, -Vec3::UnitY());
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->width(), b->width());
  ASSERT_EQ(a->height(), b->height());
  const auto wrong = draw_heights(y_down, 0.1);
  EXPECT_NE(wrong->height(), a->height());
  std::size_t same = 0;
  for (std::size_t i = 0; i < a->size(); ++i) {
    const Rgb8 p = a->pixels()[i], q = b->pixels()[i];
    same += std::abs(p.r - q.r) + std::abs(p.g - q.g) + std::abs(p.b - q.b) < 60;
  }
  EXPECT_GT(same, a->size() * 9 / 10);
}

TEST(HeightFigure, NothingForAnEmptyMap) {
  EXPECT_FALSE(draw_heights({}, 0.1));
  const std::vector<OccupancyVoxel> two{voxel(0.05F, 0.05F, 0.05F), voxel(0.05F, 0.05F, 2.05F)};
  EXPECT_TRUE(draw_heights(two, 0.1));
}

}  // namespace
}  // namespace hm
