#include "hm/sim/world/height_course.hpp"

#include <array>
#include <cmath>

#include "hm/sim/world/solids.hpp"

namespace hm {
namespace {

constexpr double kBegin_m = -1, kEnd_m = 10, kHalfWidth_m = 2, kHeight_m = 3, kCourseWall_m = 0.15;

constexpr std::array kObjects{FlatObject{1.2, 2.2, 0.10}, FlatObject{3.0, 3.7, 0.30},
                              FlatObject{3.7, 4.4, 0.45}, FlatObject{5.2, 6.2, 0.20},
                              FlatObject{7.0, 7.8, 0.60}};

/// Pillars at both walls, unevenly spaced, so that no two places along the hall look alike.
constexpr std::array kPillarsLeft_m{0.6, 2.9, 4.1, 7.4}, kPillarsRight_m{1.7, 3.4, 6.1, 8.6};
constexpr double kPillar_m = 0.3;

void append_walls(TriangleMesh& walls) {
  const double y = kHalfWidth_m + kCourseWall_m;
  append_box(walls, {kBegin_m - kCourseWall_m, -y, 0}, {kEnd_m + kCourseWall_m, -kHalfWidth_m, kHeight_m});
  append_box(walls, {kBegin_m - kCourseWall_m, kHalfWidth_m, 0}, {kEnd_m + kCourseWall_m, y, kHeight_m});
  append_box(walls, {kBegin_m - kCourseWall_m, -kHalfWidth_m, 0}, {kBegin_m, kHalfWidth_m, kHeight_m});
  append_box(walls, {kEnd_m, -kHalfWidth_m, 0}, {kEnd_m + kCourseWall_m, kHalfWidth_m, kHeight_m});
  for (const double x : kPillarsLeft_m)
    append_box(walls, {x, kHalfWidth_m - kPillar_m, 0}, {x + kPillar_m, kHalfWidth_m, kHeight_m});
  for (const double x : kPillarsRight_m)
    append_box(walls, {x, -kHalfWidth_m, 0}, {x + kPillar_m, -kHalfWidth_m + kPillar_m, kHeight_m});
}

}  // namespace

std::span<const FlatObject> height_course_objects() { return kObjects; }

World make_height_course() {
  World world{"height course", {}};
  const auto part = [&](const char* name, Pattern pattern, Rgb8 color) -> TriangleMesh& {
    world.parts.push_back({Material{name, pattern, color, {110, 90, 80}, 0.3f, Reflectance::kNormal}, {}});
    return world.parts.back().mesh;
  };
  const double y = kHalfWidth_m + kCourseWall_m;
  append_box(part("floor", Pattern::kTiles, {150, 145, 140}), {kBegin_m - kCourseWall_m, -y, -kCourseWall_m},
             {kEnd_m + kCourseWall_m, y, 0});
  append_box(part("ceiling", Pattern::kPlain, {235, 235, 235}), {kBegin_m - kCourseWall_m, -y, kHeight_m},
             {kEnd_m + kCourseWall_m, y, kHeight_m + kCourseWall_m});
  append_walls(part("walls", Pattern::kWallpaper, {215, 212, 205}));
  TriangleMesh& objects = part("objects", Pattern::kWoodgrain, {170, 116, 70});
  for (const FlatObject& object : kObjects)
    append_box(objects, {object.from_x_m, -kFlatObjectWidth_m / 2, 0},
               {object.to_x_m, kFlatObjectWidth_m / 2, object.height_m});
  return world;
}

double height_course_level_m(double x_m, double y_m) {
  if (std::abs(y_m) > kFlatObjectWidth_m / 2) return 0;
  for (const FlatObject& object : kObjects)
    if (x_m >= object.from_x_m && x_m <= object.to_x_m) return object.height_m;
  return 0;
}

}  // namespace hm
