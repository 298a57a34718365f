#include "hm/sim/world/world.hpp"

#include <algorithm>
#include <cmath>

#include "hm/sim/world/solids.hpp"

namespace hm {

World make_world(WorldKind kind, std::uint64_t seed) {
  switch (kind) {
    case WorldKind::kHouse:
      return make_house(seed);
    case WorldKind::kRoom:
      return make_room();
    case WorldKind::kCorridor:
      break;
  }
  return make_corridor();
}

TriangleMesh merged_mesh(const World& world) {
  TriangleMesh all;
  for (const WorldPart& part : world.parts) {
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), part.mesh.vertices.begin(), part.mesh.vertices.end());
    all.colors.insert(all.colors.end(), part.mesh.vertices.size(), part.material.base);
    for (const auto& t : part.mesh.triangles)
      all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  return all;
}

Box3 bounds(const World& world) {
  Box3 box;
  for (const WorldPart& part : world.parts) box.extend(bounds(part.mesh));
  return box;
}

World make_corridor() {
  World world{"corridor", {}};
  const auto plain = [&](const char* name, Rgb8 color) -> TriangleMesh& {
    world.parts.push_back({Material{name, Pattern::kPlain, color, color, 0.3f, Reflectance::kNormal}, {}});
    return world.parts.back().mesh;
  };
  constexpr double kWall_m = 0.15, kLength_m = 30, kHalfWidth_m = 1, kHeight_m = 2.5;
  TriangleMesh& floor = plain("floor", {150, 145, 140});
  append_box(floor, {-kWall_m, -kHalfWidth_m - kWall_m, -kWall_m},
             {kLength_m + kWall_m, kHalfWidth_m + kWall_m, 0});
  TriangleMesh& ceiling = plain("ceiling", {235, 235, 235});
  append_box(ceiling, {-kWall_m, -kHalfWidth_m - kWall_m, kHeight_m},
             {kLength_m + kWall_m, kHalfWidth_m + kWall_m, kHeight_m + kWall_m});
  TriangleMesh& walls = plain("walls", {215, 212, 205});
  append_box(walls, {-kWall_m, -kHalfWidth_m - kWall_m, 0}, {kLength_m + kWall_m, -kHalfWidth_m, kHeight_m});
  append_box(walls, {-kWall_m, kHalfWidth_m, 0}, {kLength_m + kWall_m, kHalfWidth_m + kWall_m, kHeight_m});
  append_box(walls, {-kWall_m, -kHalfWidth_m, 0}, {0, kHalfWidth_m, kHeight_m});
  append_box(walls, {kLength_m, -kHalfWidth_m, 0}, {kLength_m + kWall_m, kHalfWidth_m, kHeight_m});
  return world;
}

}  // namespace hm
