#pragma once
#include <array>
#include <functional>
#include <span>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/sim/sensor/renderer.hpp"
#include "hm/sim/vehicle/quadrotor_dynamics.hpp"

namespace hm {

/// Casts rays into the vehicle's surroundings, as Renderer::cast() does.
using CastRays = std::function<void(std::span<const Ray> rays, std::span<RayHit> hits)>;
/// Surroundings as a renderer sees them; it must outlive the function.
CastRays cast_into(const Renderer& renderer);
/// Surroundings without any surface.
CastRays cast_into_nothing();

/// Collision of the vehicle's hull.
struct VehicleCollision {
  Time stamp;
  Vec3 position_world = Vec3::Zero();  ///< of the point of the hull that hit
  double speed_m_s = 0;                ///< of this point, just before it touched
};

/// Contact of a quadrotor with its surroundings: four feet and twelve points of its hull (eight around the
/// rotors, four on top) press against the planes of the surfaces in their way, with a spring and a damper
/// along the normal and Coulomb friction with a spring across it, so that a vehicle at rest does not creep.
/// Surfaces are found by rays: from the centre through each point of the hull, down through each foot, and
/// along each rotor's axis.
class VehicleContact {
 public:
  VehicleContact(const VehicleParams& params, const Vec3& com_base_m, CastRays surroundings);

  /// Looks for surfaces anew (at 100 Hz) and counts collisions: segments from the centre to a point of the
  /// hull that a surface cuts, feet that touched down at more than 2 m/s, and feet that are suddenly deep in
  /// a surface, i.e. that came from its side (these feel no force). Hits less than half a second after the
  /// last one belong to the same collision.
  void look(const QuadrotorState& state, Time now);
  /// Forces of all contacts, with the surfaces found last.
  [[nodiscard]] BodyWrench wrench(const QuadrotorState& state) const;
  /// Lets the friction springs of sliding points follow, and those of free ones go; after each step.
  void settle(const QuadrotorState& state);

  /// Surfaces below and above each rotor, for the ground effect.
  [[nodiscard]] const std::array<RotorSurfaces, kRotors>& rotor_surfaces() const { return rotor_surfaces_; }
  [[nodiscard]] const std::vector<VehicleCollision>& collisions() const { return collisions_; }
  /// Number of feet that touch a surface.
  [[nodiscard]] int feet_down() const;
  /// Whether anything is near enough to touch during the next look's interval.
  [[nodiscard]] bool has_surfaces() const { return has_surfaces_; }

 private:
  struct Point {
    Vec3 tip_base = Vec3::Zero();
    bool is_foot = false;
    bool is_touching = false;
    std::optional<SurfacePlane> surface;
    Vec3 anchor_world = Vec3::Zero();  ///< where the point began to touch, or slid to
    /// Speed, and speed towards the surface, when it last did not touch.
    double free_speed_m_s = 0, free_approach_m_s = 0;
  };
  struct Touch {
    double depth_m = 0, normal_n = 0;  ///< depth below the surface, normal force
    double approach_m_s = 0;           ///< speed towards the surface
    Vec3 tip_world = Vec3::Zero(), velocity_world = Vec3::Zero();
    Vec3 friction_world_n = Vec3::Zero(), stretch_world_m = Vec3::Zero();
  };
  static constexpr std::size_t kFeet = 4, kHullPoints = 12;

  [[nodiscard]] Touch touch_of(const Point& point, const QuadrotorState& state, const Mat3& R) const;
  /// Whether a point with a surface collides; `is_cut`: the surface cuts its segment.
  [[nodiscard]] static bool is_collision(const Point& point, const Touch& touch, bool is_cut);
  void count_collision(const Point& point, const Touch& touch, Time now);
  void set_surfaces(std::span<const Ray> rays, std::span<const RayHit> hits);

  std::array<Vec3, kRotors> rotor_positions_;
  Vec3 com_base_m_;
  CastRays surroundings_;
  std::array<Point, kFeet + kHullPoints> points_;
  std::array<RotorSurfaces, kRotors> rotor_surfaces_;
  std::vector<VehicleCollision> collisions_;
  std::optional<Time> last_hit_;
  bool has_surfaces_ = false;
};

}  // namespace hm
