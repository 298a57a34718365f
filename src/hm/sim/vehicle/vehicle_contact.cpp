#include "hm/sim/vehicle/vehicle_contact.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace hm {
namespace {

constexpr double kHullRadius_m = 0.34;   ///< arm and rotor
constexpr double kHullTop_m = 0.15;      ///< of the laser above the base
constexpr double kTopRadius_m = 0.08;    ///< of the laser
constexpr double kFootSpread_m = 0.15;   ///< of the feet from the axes
constexpr double kStiffness_n_m = 2000;  ///< of a point: four feet give way 1.7 mm under the weight
constexpr double kDamping_n_s_m = 40;    ///< of a point: 0.75 of the critical damping of the whole vehicle
constexpr double kFriction = 0.6;        ///< rubber on wood
constexpr double kMaxNormal_n = 400;     ///< of a point: of an arm that breaks
constexpr double kSideDepth_m = 0.04;    ///< of a foot that did not touch before: it came from the side
constexpr double kHardLanding_m_s = 2;
constexpr double kLookAhead_m = 0.3;       ///< surfaces this far beyond a point are kept
constexpr double kCollisionApart_s = 0.5;  ///< hits within this time are one collision
constexpr double kRotorLook_m = 3;         ///< beyond, surfaces change the thrust by less than 0.02 %

SurfacePlane plane_of(const Ray& ray, const RayHit& hit) {
  const Vec3 facing = hit.normal_world.dot(ray.direction_world) > 0 ? -hit.normal_world : hit.normal_world;
  return {ray.origin_world + hit.range_m * ray.direction_world, facing};
}

}  // namespace

CastRays cast_into(const Renderer& renderer) {
  return [&renderer](std::span<const Ray> rays, std::span<RayHit> hits) { renderer.cast(rays, hits); };
}

CastRays cast_into_nothing() {
  return [](std::span<const Ray>, std::span<RayHit> hits) { std::fill(hits.begin(), hits.end(), RayHit{}); };
}

VehicleContact::VehicleContact(const VehicleParams& params, const Vec3& com_base_m, CastRays surroundings)
    : rotor_positions_(rotor_positions(params.airframe)),
      com_base_m_(com_base_m),
      surroundings_(std::move(surroundings)) {
  constexpr double kQuarter = std::numbers::pi / 2;
  const auto around = [](double radius, double angle, double height) {
    return Vec3(radius * std::cos(angle), radius * std::sin(angle), height);
  };
  for (std::size_t i = 0; i < 4; ++i) {
    const double turn = kQuarter * static_cast<double>(i);
    const double spread = kFootSpread_m * std::numbers::sqrt2;
    points_[i].tip_base = around(spread, turn + kQuarter / 2, -kBaseOverGround_m);
    points_[i].is_foot = true;
    points_[kFeet + i].tip_base = around(kTopRadius_m, turn, kHullTop_m);
    for (std::size_t k = 0; k < 2; ++k)
      points_[2 * kFeet + 2 * i + k].tip_base =
          around(kHullRadius_m, turn + static_cast<double>(k) * kQuarter / 2, params.airframe.kRotorHeight_m);
  }
}

void VehicleContact::look(const QuadrotorState& state, Time now) {
  constexpr std::size_t kRays = kFeet + kHullPoints + 2 * kRotors;
  std::array<Ray, kRays> rays;
  std::array<RayHit, kRays> hits;
  const Mat3 R = state.R_world_base();
  const Vec3 base = state.com_world_m - R * com_base_m_;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Vec3 arm = R * points_[i].tip_base;
    if (points_[i].is_foot)
      rays[i] = {base + arm + Vec3(0, 0, kBaseOverGround_m), -Vec3::UnitZ()};
    else
      rays[i] = {base, arm.normalized()};
  }
  for (std::size_t i = 0; i < kRotors; ++i) {
    const Vec3 rotor = base + R * rotor_positions_[i];
    rays[points_.size() + 2 * i] = {rotor, -R.col(2)};
    rays[points_.size() + 2 * i + 1] = {rotor, R.col(2)};
  }
  surroundings_(rays, hits);
  set_surfaces(rays, hits);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Point& point = points_[i];
    if (!point.surface) continue;
    const Touch touch = touch_of(point, state, R);
    if (is_collision(point, touch, hits[i].range_m < point.tip_base.norm()))
      count_collision(point, touch, now);
    if (point.is_foot && !point.is_touching && touch.depth_m > kSideDepth_m) point.surface.reset();
  }
}

bool VehicleContact::is_collision(const Point& point, const Touch& touch, bool is_cut) {
  if (!point.is_foot) return is_cut;
  return point.is_touching ? point.free_approach_m_s > kHardLanding_m_s : touch.depth_m > kSideDepth_m;
}

void VehicleContact::set_surfaces(std::span<const Ray> rays, std::span<const RayHit> hits) {
  has_surfaces_ = false;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Point& point = points_[i];
    const double reach_m = (point.is_foot ? kBaseOverGround_m : point.tip_base.norm()) + kLookAhead_m;
    point.surface.reset();
    if (hits[i].range_m < reach_m) point.surface = plane_of(rays[i], hits[i]);
    has_surfaces_ |= point.surface.has_value();
  }
  for (std::size_t i = 0; i < kRotors; ++i) {
    const std::size_t down = points_.size() + 2 * i, up = down + 1;
    rotor_surfaces_[i] = {};
    if (hits[down].range_m < kRotorLook_m) rotor_surfaces_[i].below = plane_of(rays[down], hits[down]);
    if (hits[up].range_m < kRotorLook_m) rotor_surfaces_[i].above = plane_of(rays[up], hits[up]);
  }
}

void VehicleContact::count_collision(const Point& point, const Touch& touch, Time now) {
  const bool is_new = !last_hit_ || (now - *last_hit_).seconds() > kCollisionApart_s;
  last_hit_ = now;
  if (!is_new) return;
  collisions_.push_back({now, touch.tip_world, point.free_speed_m_s});
}

VehicleContact::Touch VehicleContact::touch_of(const Point& point, const QuadrotorState& state,
                                               const Mat3& R) const {
  const SurfacePlane& plane = *point.surface;
  const Vec3& normal = plane.normal_world;
  const Vec3 arm_base = point.tip_base - com_base_m_;
  Touch touch;
  touch.tip_world = state.com_world_m + R * arm_base;
  touch.velocity_world = state.com_velocity_world_m_s + R * state.angular_velocity_base_rad_s.cross(arm_base);
  touch.depth_m = (plane.point_world - touch.tip_world).dot(normal);
  touch.approach_m_s = -touch.velocity_world.dot(normal);
  if (touch.depth_m <= 0) return touch;
  touch.normal_n =
      std::clamp(kStiffness_n_m * touch.depth_m + kDamping_n_s_m * touch.approach_m_s, 0.0, kMaxNormal_n);
  const auto across = [&normal](const Vec3& v) -> Vec3 { return v - v.dot(normal) * normal; };
  if (point.is_touching) touch.stretch_world_m = across(point.anchor_world - touch.tip_world);
  touch.friction_world_n =
      kStiffness_n_m * touch.stretch_world_m - kDamping_n_s_m * across(touch.velocity_world);
  const double limit_n = kFriction * touch.normal_n, friction_n = touch.friction_world_n.norm();
  if (friction_n > limit_n) touch.friction_world_n *= limit_n / friction_n;
  return touch;
}

BodyWrench VehicleContact::wrench(const QuadrotorState& state) const {
  BodyWrench sum;
  const Mat3 R = state.R_world_base();
  for (const Point& point : points_) {
    if (!point.surface) continue;
    const Touch touch = touch_of(point, state, R);
    if (touch.normal_n <= 0) continue;
    const Vec3 force = touch.normal_n * point.surface->normal_world + touch.friction_world_n;
    sum.force_world_n += force;
    sum.torque_base_nm += (point.tip_base - com_base_m_).cross(R.transpose() * force);
  }
  return sum;
}

void VehicleContact::settle(const QuadrotorState& state) {
  const Mat3 R = state.R_world_base();
  for (Point& point : points_) {
    const Touch touch = point.surface ? touch_of(point, state, R) : Touch{};
    const bool was_touching = std::exchange(point.is_touching, touch.normal_n > 0);
    if (!point.is_touching) {
      point.free_speed_m_s = touch.velocity_world.norm();
      point.free_approach_m_s = touch.approach_m_s;
      continue;
    }
    if (!was_touching) point.anchor_world = touch.tip_world;
    const double stretch_m = touch.stretch_world_m.norm();
    const double limit_m = kFriction * touch.normal_n / kStiffness_n_m;
    if (was_touching && stretch_m > limit_m)
      point.anchor_world = touch.tip_world + touch.stretch_world_m * (limit_m / stretch_m);
  }
}

int VehicleContact::feet_down() const {
  return static_cast<int>(std::count_if(points_.begin(), points_.end(),
                                        [](const Point& p) { return p.is_foot && p.is_touching; }));
}

}  // namespace hm
