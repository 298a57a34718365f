#include "hm/sim/recording/moving_people.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/core/rng.hpp"
#include "hm/sim/world/solids.hpp"

namespace hm {
namespace {

/// A standing person; all dimensions are in the order of a real one's.
World make_person(Rng& rng) {
  const auto tone = [&] { return static_cast<std::uint8_t>(rng.uniform(40, 220)); };
  const auto cloth = [&](const char* name, Pattern pattern) {
    const Rgb8 base{tone(), tone(), tone()}, accent{tone(), tone(), tone()};
    return Material{name, pattern, base, accent, 0.08f, Reflectance::kNormal};
  };
  const double height_m = rng.uniform(1.55, 1.9), hip_m = 0.5 * height_m, neck_m = 0.84 * height_m;
  World person{"person", {}};
  TriangleMesh trousers, shirt, skin, hair;
  for (const double side : {-0.1, 0.1})
    append_rod(trousers, {Vec3(0, side, 0), Vec3(0, side, hip_m), 0.06, 0.09, 12});
  append_ellipsoid(shirt, {0, 0, 0.5 * (hip_m + neck_m)}, {0.13, 0.2, 0.56 * (neck_m - hip_m)}, 10);
  for (const double side : {-0.25, 0.25}) {
    append_rod(shirt, {Vec3(0, side, 0.55 * neck_m), Vec3(0, 0.8 * side, 0.95 * neck_m), 0.04, 0.06, 10});
    append_ellipsoid(skin, {0, side, 0.52 * neck_m}, {0.05, 0.04, 0.08}, 6);
  }
  append_ellipsoid(skin, {0.01, 0, 0.92 * height_m}, {0.1, 0.08, 0.08 * height_m}, 10);
  append_ellipsoid(hair, {-0.03, 0, 0.95 * height_m}, {0.1, 0.09, 0.05 * height_m}, 8);
  person.parts.push_back({cloth("trousers", Pattern::kFabric), std::move(trousers)});
  person.parts.push_back({cloth("shirt", Pattern::kWallpaper), std::move(shirt)});
  person.parts.push_back(
      {Material{"skin", Pattern::kPlain, {224, 172, 140}, {200, 150, 120}, 0.3f, Reflectance::kNormal},
       std::move(skin)});
  person.parts.push_back({cloth("hair", Pattern::kPlain), std::move(hair)});
  return person;
}

/// False if the person is not there, or no part of it is in the image of a camera with this pose.
bool may_be_seen(const PinholeCamera& camera, const SE3& T_person_camera) {
  constexpr double kReach_m = 0.4, kTop_m = 2.0, kNear_m = 0.05;
  if (T_person_camera.translation().head<2>().norm() < MovingPeople::kLeast_m) return false;
  const SE3 T_camera_person = T_person_camera.inverse();
  Vec2 low(1e9, 1e9), high(-1e9, -1e9);
  int before = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p =
        T_camera_person * Vec3((corner & 1) != 0 ? kReach_m : -kReach_m,
                               (corner & 2) != 0 ? kReach_m : -kReach_m, (corner & 4) != 0 ? kTop_m : 0.0);
    if (p.z() < kNear_m) continue;
    const Vec2 pixel = camera.project(p);
    low = low.cwiseMin(pixel), high = high.cwiseMax(pixel);
    ++before;
  }
  if (before < 8) return before > 0;  // partly beside the camera: where it ends in the image is not known
  return high.x() >= 0 && high.y() >= 0 && low.x() < camera.width && low.y() < camera.height;
}

}  // namespace

MovingPeople::MovingPeople(const Walk& walk, int count, std::uint64_t seed) : walk_(walk) {
  for (int i = 0; i < count; ++i) {
    Rng rng(seed, 0x70656f706c65 + static_cast<std::uint64_t>(i));
    auto body = std::make_unique<World>(make_person(rng));
    Renderer renderer(*body);
    const double ahead_s = rng.uniform(6, 10), reach_s = rng.uniform(1, 2), period_s = rng.uniform(20, 40);
    const double phase_rad = rng.uniform(0, 2 * std::numbers::pi);
    people_.push_back({std::move(body), std::move(renderer), ahead_s, reach_s, period_s, phase_rad});
  }
}

SE3 MovingPeople::T_world_person(std::size_t person, double walk_s) const {
  const Person& who = people_.at(person);
  const double change_s =
      who.reach_s * std::sin(2 * std::numbers::pi * walk_s / who.period_s + who.phase_rad);
  const WalkPoint there = walk_.point_at(walk_s + who.ahead_s + change_s);
  return {so3_exp(Vec3(0, 0, there.yaw_rad)), Vec3(there.position.x(), there.position.y(), 0)};
}

void MovingPeople::draw(const PinholeCamera& camera, std::span<const SE3> T_world_camera, double walk_s,
                        RenderedView& view) const {
  for (std::size_t i = 0; i < people_.size(); ++i) {
    const SE3 T_person_world = T_world_person(i, walk_s).inverse();
    std::vector<SE3> T_person_camera;
    for (const SE3& pose : T_world_camera) T_person_camera.push_back(T_person_world * pose);
    if (std::ranges::none_of(T_person_camera, [&](const SE3& T) { return may_be_seen(camera, T); })) continue;
    const RenderedView person = people_[i].renderer.render(camera, T_person_camera, ParallelLoop());
    const auto first = static_cast<std::uint16_t>(view.returns.size());
    view.returns.insert(view.returns.end(), person.returns.begin(), person.returns.end());
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        if (person.part(x, y) == RenderedView::kNoPart) continue;
        if (view.part(x, y) != RenderedView::kNoPart && view.depth_m(x, y) <= person.depth_m(x, y)) continue;
        view.depth_m(x, y) = person.depth_m(x, y);
        view.cos_incidence(x, y) = person.cos_incidence(x, y);
        view.part(x, y) = static_cast<std::uint16_t>(first + person.part(x, y));
        view.normal(x, y) =
            (T_person_world.rotation().transpose() * person.normal(x, y).cast<double>()).cast<float>();
        view.color(x, y) = person.color(x, y);
      }
  }
}

}  // namespace hm
