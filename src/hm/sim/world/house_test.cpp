#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "hm/sim/motion/house_tours.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "hm/sim/sensor/renderer.hpp"
#include "hm/sim/world/house_plan.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {
namespace {

TEST(House, HasAbout300SquareMetres) {
  const Box3 box = bounds(make_house(1));
  const double outer = box.sizes().x() * box.sizes().y();
  EXPECT_GT(outer, 300);
  EXPECT_LT(outer, 320);
  double rooms = kHouseLength_m * (kHallHigh_y - kHallLow_y);
  for (const RoomPlan& room : house_rooms()) rooms += (room.x1 - room.x0) * (room.y1 - room.y0);
  EXPECT_GT(rooms, 285);
  EXPECT_LT(rooms, 300);
}

TEST(House, ConsistsOfClosedSolidsOrientedOutwards) {
  const World house = make_house(1);
  for (const WorldPart& part : house.parts) {
    EXPECT_FALSE(part.mesh.triangles.empty()) << part.material.name;
    EXPECT_TRUE(open_edges(part.mesh).empty()) << part.material.name;
    EXPECT_GT(enclosed_volume(part.mesh), 0) << part.material.name;
  }
  for (const World& world : {make_room(), make_corridor()})
    for (const WorldPart& part : world.parts) {
      EXPECT_TRUE(open_edges(part.mesh).empty());
      EXPECT_GT(enclosed_volume(part.mesh), 0);
    }
}

TEST(House, NobodySeesOutOfIt) {
  const World house = make_house(1);
  const Renderer renderer(house);
  const PinholeCamera wide{200, 200, 100, 100, 99.5, 99.5, {}};
  std::vector<Vec3> places = {{10, 7.5, 1.5}};
  for (std::size_t room = 0; room < house_rooms().size(); ++room) {
    const std::span<const TourStop> tour = room_tour(room);
    const TourStop& stop = tour[tour.size() / 2];
    places.emplace_back(stop.x_m + 0.0137, stop.y_m + 0.0071, 1.5213);
  }
  std::size_t from_inside = 0, all = 0;
  for (const Vec3& place : places) {
    for (int side = 0; side < 6; ++side) {
      const double angle = M_PI / 2 * side;
      const Mat3 turn = side < 4 ? so3_exp({0, 0, angle}) * so3_exp({-M_PI / 2, 0, 0})
                                 : so3_exp({side == 4 ? 0.0 : M_PI, 0, 0});
      const RenderedView view = renderer.render(wide, SE3(turn, place), ParallelLoop());
      for (std::size_t i = 0; i < view.depth_m.size(); ++i) {
        ASSERT_GT(view.depth_m.pixels()[i], 0.1f);
        // Visible surfaces face the viewer: no view point is inside a solid. A ray through the edge along
        // which two solids touch may hit the hidden side.
        const int x = static_cast<int>(i % 200), y = static_cast<int>(i / 200);
        const Vec3 ray = turn * wide.unproject({x, y}, 1.0);
        ++all;
        from_inside += view.normal(x, y).cast<double>().dot(ray) > 1e-6;
      }
    }
  }
  EXPECT_LT(from_inside, all / 20000);
}

TEST(House, SeedChangesThingsButNotThePlan) {
  const TriangleMesh a = merged_mesh(make_house(1)), again = merged_mesh(make_house(1)),
                     b = merged_mesh(make_house(2));
  EXPECT_EQ(a.vertices, again.vertices);
  EXPECT_EQ(a.triangles, again.triangles);
  EXPECT_EQ(a.colors, again.colors);
  EXPECT_NE(a.vertices, b.vertices);
  EXPECT_TRUE(bounds(a).isApprox(bounds(b), 1e-6));
}

TEST(House, HasSurfacesThatReturnNothingAndIsRichlyTextured) {
  const World house = make_house(1);
  double silent = 0, all = 0;
  for (const WorldPart& part : house.parts) {
    const double area = surface_area(part.mesh);
    all += area;
    if (part.material.reflectance == Reflectance::kNoReturn) silent += area;
  }
  EXPECT_GT(silent, 20);
  EXPECT_LT(silent, 0.05 * all);
  // Pictures differ from place to place: the mean neighbour contrast is well above that of plain walls.
  SimulationParams params;
  params.frame_stride = 200;
  const Simulation simulation(params);
  for (std::size_t i = 0; i < simulation.frame_count(); ++i) {
    const RgbdFrame frame = simulation.frame(i);
    double contrast = 0;
    for (int y = 0; y < 180; ++y)
      for (int x = 1; x < 320; ++x) contrast += std::abs(frame.color(x, y).g - frame.color(x - 1, y).g);
    EXPECT_GT(contrast / (319 * 180), 1.0) << i;
  }
}

}  // namespace
}  // namespace hm
