#include <algorithm>

#include "hm/sim/world/house_builder.hpp"
#include "hm/sim/world/house_plan.hpp"

namespace hm {
namespace {

constexpr double kSlab_m = 0.2, kTrim_m = 0.015;

std::vector<Box3> all_openings() {
  std::vector<Box3> all = house_doors();
  for (const Box3& arch : house_arches()) all.push_back(arch);
  for (const Box3& window : house_windows()) all.push_back(window);
  all.push_back(front_door());
  return all;
}

/// Appends a wall (or skirting) along `axis` (0: x, 1: y), with its openings.
void append_wall(TriangleMesh& mesh, const Box3& wall, int axis) {
  constexpr double kTouch_m = 0.03;  // skirting lies on the wall: openings are widened across it
  const int across = 1 - axis;
  std::vector<Box3> holes;
  for (const Box3& opening : all_openings()) {
    const bool reaches = opening.max()[across] + kTouch_m > wall.min()[across] &&
                         opening.min()[across] - kTouch_m < wall.max()[across];
    const bool along = opening.max()[axis] > wall.min()[axis] && opening.min()[axis] < wall.max()[axis];
    if (reaches && along && opening.min().z() < wall.max().z()) holes.push_back(opening);
  }
  std::sort(holes.begin(), holes.end(),
            [&](const Box3& a, const Box3& b) { return a.min()[axis] < b.min()[axis]; });
  const auto piece = [&](double from, double to, double low, double high) {
    Vec3 a = wall.min(), b = wall.max();
    a[axis] = from, b[axis] = to;
    a.z() = std::max(low, a.z()), b.z() = std::min(high, b.z());
    if (to - from > 1e-6 && b.z() - a.z() > 1e-6) append_box(mesh, a, b);
  };
  double at = wall.min()[axis];
  for (const Box3& hole : holes) {
    const double from = std::max(at, hole.min()[axis]), to = std::min(hole.max()[axis], wall.max()[axis]);
    piece(at, from, wall.min().z(), wall.max().z());
    piece(from, to, wall.min().z(), hole.min().z());
    piece(from, to, hole.max().z(), wall.max().z());
    at = to;
  }
  piece(at, wall.max()[axis], wall.min().z(), wall.max().z());
}

/// Appends four walls of a thickness and height around a rectangle; the walls along x include the corners.
void append_ring(TriangleMesh& mesh, const Box3& inner, double thickness_m) {
  const Vec3 a = inner.min(), b = inner.max();
  const double t = thickness_m, top = b.z();
  append_wall(mesh, Box3(Vec3(a.x() - t, a.y() - t, a.z()), Vec3(b.x() + t, a.y(), top)), 0);
  append_wall(mesh, Box3(Vec3(a.x() - t, b.y(), a.z()), Vec3(b.x() + t, b.y() + t, top)), 0);
  append_wall(mesh, Box3(Vec3(a.x() - t, a.y(), a.z()), Vec3(a.x(), b.y(), top)), 1);
  append_wall(mesh, Box3(Vec3(b.x(), a.y(), a.z()), Vec3(b.x() + t, b.y(), top)), 1);
}

/// Appends skirting boards along the inside of a rectangle.
void append_skirting(TriangleMesh& mesh, const Box3& inner) {
  Box3 core(inner.min() + Vec3(kTrim_m, kTrim_m, 0), inner.max() - Vec3(kTrim_m, kTrim_m, 0));
  core.max().z() = 0.09;
  append_ring(mesh, core, kTrim_m);
}

/// Appends a frame around a hole in a wall along `axis`, protruding slightly on both sides; windows have one
/// at the bottom too.
void append_frame(TriangleMesh& mesh, const Box3& hole, int axis, double width_m) {
  const int across = 1 - axis;
  Vec3 low = hole.min(), high = hole.max();
  low[across] -= kTrim_m, high[across] += kTrim_m;
  const auto bar = [&](double from, double to, double bottom, double top) {
    Vec3 a = low, b = high;
    a[axis] = from, b[axis] = to, a.z() = bottom, b.z() = top;
    append_box(mesh, a, b);
  };
  const double from = hole.min()[axis], to = hole.max()[axis];
  const bool window = hole.min().z() > 0;
  bar(from, from + width_m, hole.min().z(), hole.max().z());
  bar(to - width_m, to, hole.min().z(), hole.max().z());
  bar(from + width_m, to - width_m, hole.max().z() - width_m, hole.max().z());
  if (window) bar(from + width_m, to - width_m, hole.min().z(), hole.min().z() + width_m);
}

void build_window(HouseBuilder& builder, const Box3& hole) {
  const int axis = hole.sizes().x() > hole.sizes().y() ? 0 : 1, across = 1 - axis;
  append_frame(builder.mesh(HouseMaterial::kTrim), hole, axis, 0.05);
  Vec3 a = hole.min() + Vec3(0, 0, 0.05), b = hole.max() - Vec3(0, 0, 0.05);
  const double middle = 0.5 * (hole.min()[across] + hole.max()[across]);
  a[across] = middle - 0.012, b[across] = middle + 0.012;
  a[axis] += 0.05, b[axis] -= 0.05;
  append_box(builder.mesh(HouseMaterial::kGlass), a, b);
  // A mullion in the middle.
  const double center = 0.5 * (a[axis] + b[axis]);
  a[axis] = center - 0.025, b[axis] = center + 0.025, a[across] -= 0.02, b[across] += 0.02;
  append_box(builder.mesh(HouseMaterial::kTrim), a, b);
}

/// Adds an open door leaf at one side of its hole, at a right angle to the wall inside the room.
void build_door_leaf(HouseBuilder& builder, const Box3& hole, bool south) {
  const double hinge_x = hole.min().x() + 0.045;
  const Place place{&builder, Vec3(hinge_x, south ? hole.min().y() : hole.max().y(), 0), 0};
  const double way = south ? -1 : 1;
  const double y0 = std::min(way * 0.03, way * 0.9), y1 = std::max(way * 0.03, way * 0.9);
  place.box(HouseMaterial::kDoor, {0, y0, 0.01}, {0.04, y1, 2.02});
  place.box(HouseMaterial::kOak, {0.04, y0 + 0.12, 0.2}, {0.048, y1 - 0.12, 0.9});
  place.box(HouseMaterial::kOak, {0.04, y0 + 0.12, 1.1}, {0.048, y1 - 0.12, 1.85});
  const double y = way * 0.83;
  place.rod(HouseMaterial::kBrass, {-0.05, y, 1.02}, {0.09, y, 1.02}, 0.011);
  place.rod(HouseMaterial::kBrass, {0.09, y, 1.02}, {0.09, y - way * 0.11, 1.02}, 0.011);
}

void build_front_door(HouseBuilder& builder) {
  const Box3 hole = front_door();
  append_frame(builder.mesh(HouseMaterial::kTrim), hole, 1, 0.07);
  const Place place{&builder, Vec3(-0.12, hole.center().y(), 0), 0};
  place.box(HouseMaterial::kFrontDoor, {0, -0.43, 0}, {0.06, 0.43, 2.03});
  for (const double z : {0.25, 0.85, 1.45}) {
    place.box(HouseMaterial::kWalnut, {0.06, -0.33, z}, {0.075, -0.04, z + 0.45});
    place.box(HouseMaterial::kWalnut, {0.06, 0.04, z}, {0.075, 0.33, z + 0.45});
  }
  place.ellipsoid(HouseMaterial::kBrass, {0.12, 0.36, 1.02}, {0.035, 0.035, 0.035});
  place.rod(HouseMaterial::kBrass, {0.06, 0.36, 1.02}, {0.12, 0.36, 1.02}, 0.012);
}

}  // namespace

void build_shell(HouseBuilder& builder) {
  const std::vector<RoomPlan>& rooms = house_rooms();
  for (std::size_t i = 0; i < rooms.size(); ++i) {
    const RoomPlan& r = rooms[i];
    const Box3 inner(Vec3(r.x0, r.y0, 0), Vec3(r.x1, r.y1, kHouseHeight_m));
    append_ring(builder.mesh(HouseBuilder::room_wall(i)), inner, kHalfWall_m);
    append_skirting(builder.mesh(HouseMaterial::kTrim), inner);
    append_box(builder.mesh(HouseBuilder::room_floor(i)), {r.x0 - kHalfWall_m, r.y0 - kHalfWall_m, -kSlab_m},
               {r.x1 + kHalfWall_m, r.y1 + kHalfWall_m, 0});
  }
  const Box3 hall(Vec3(0, kHallLow_y, 0), Vec3(kHouseLength_m, kHallHigh_y, kHouseHeight_m));
  append_ring(builder.mesh(HouseMaterial::kHallWall), hall, kHalfWall_m);
  append_skirting(builder.mesh(HouseMaterial::kTrim), hall);
  append_box(builder.mesh(HouseMaterial::kHallFloor), {-kHalfWall_m, kHallLow_y - kHalfWall_m, -kSlab_m},
             {kHouseLength_m + kHalfWall_m, kHallHigh_y + kHalfWall_m, 0});
  append_box(
      builder.mesh(HouseMaterial::kCeiling), {-kWholeOuterWall_m, -kWholeOuterWall_m, kHouseHeight_m},
      {kHouseLength_m + kWholeOuterWall_m, kHouseWidth_m + kWholeOuterWall_m, kHouseHeight_m + kSlab_m});
  const Box3 outer(Vec3(-kHalfWall_m, -kHalfWall_m, -kSlab_m),
                   Vec3(kHouseLength_m + kHalfWall_m, kHouseWidth_m + kHalfWall_m, kHouseHeight_m));
  append_ring(builder.mesh(HouseMaterial::kOutside), outer, kOuterWall_m);
  const std::vector<Box3> doors = house_doors();
  for (std::size_t i = 0; i < doors.size(); ++i) {
    append_frame(builder.mesh(HouseMaterial::kTrim), doors[i], 0, 0.04);
    if (i != 1) build_door_leaf(builder, doors[i], rooms[i].y1 < kHallCenter_y);
  }
  for (const Box3& arch : house_arches()) append_frame(builder.mesh(HouseMaterial::kWalnut), arch, 1, 0.05);
  for (const Box3& window : house_windows()) build_window(builder, window);
  build_front_door(builder);
}

}  // namespace hm
