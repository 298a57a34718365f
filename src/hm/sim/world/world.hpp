#pragma once
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "hm/geometry/box.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/sim/world/material.hpp"

namespace hm {

/// All surfaces of one material. The mesh is a set of closed solids, oriented outwards, that may touch or
/// intersect.
struct WorldPart {
  Material material;
  TriangleMesh mesh;
};

/// Generated scene, metres, z up, the upper side of the lowest floor at z = 0.
struct World {
  std::string name;
  std::vector<WorldPart> parts;
};

/// Generates a furnished single-floor house of 20 x 15 m (300 m2) around a hallway: nine rooms, doors,
/// windows, thin-legged furniture, plants, railings, glass and black surfaces. The seed changes colours,
/// objects and plants, never the floor plan.
World make_house(std::uint64_t seed);
/// Generates a room of 6 x 4 x 2.8 m with boxes, spheres and a wedge, whose distance function is room_sdf()
/// (hm/sim/world/room_scene.hpp).
World make_room();
/// Generates a featureless corridor of 30 x 2 x 2.5 m.
World make_corridor();

enum class WorldKind { kHouse, kRoom, kCorridor };
inline constexpr std::string_view kWorldKindNames[] = {"house", "room", "corridor"};
/// Generates a world; the seed is used for the house only.
World make_world(WorldKind kind, std::uint64_t seed);

/// Merges all parts into one mesh, with the colours of the materials at the vertices.
TriangleMesh merged_mesh(const World& world);
Box3 bounds(const World& world);

}  // namespace hm
