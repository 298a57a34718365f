#include "hm/sim/sensor/laser_sensor.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr double kFar_m = 10;          ///< range_sigma_far_m holds beyond
constexpr std::size_t kRing = 6;       ///< rays around the middle of a beam
constexpr std::size_t kLeastRays = 3;  ///< of a wide beam, must return for a reading

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

SE3 mirror(const Vec3& xyz_m, const Vec3& rpy_deg) {
  const Mat3 rotation = so3_exp({0, 0, radians(rpy_deg.z())}) * so3_exp({0, radians(rpy_deg.y()), 0}) *
                        so3_exp({radians(rpy_deg.x()), 0, 0});
  return {rotation, xyz_m};
}

/// Distance of a hit beyond the plane of another one.
double beyond(const Ray& ray, const RayHit& hit, const Ray& reference_ray, const RayHit& reference) {
  const Vec3 on_plane = reference_ray.origin_world + reference.range_m * reference_ray.direction_world;
  const double along = reference.normal_world.dot(ray.direction_world);
  if (std::abs(along) < 1e-6) return hit.range_m - reference.range_m;
  return hit.range_m - reference.normal_world.dot(on_plane - ray.origin_world) / along;
}

/// Range of a beam whose rays return from different surfaces: the mean if the echoes merge, else the stronger
/// echo; ties go to the nearer.
double mixed_m(std::vector<double>& ranges_m, double mixing_distance_m) {
  const auto mean = [](auto begin, auto end) {
    double sum = 0;
    for (auto it = begin; it != end; ++it) sum += *it;
    return sum / static_cast<double>(end - begin);
  };
  std::sort(ranges_m.begin(), ranges_m.end());
  auto split = ranges_m.begin() + 1;
  for (auto it = ranges_m.begin() + 1; it != ranges_m.end(); ++it)
    if (*it - *(it - 1) > *split - *(split - 1)) split = it;
  const double near_m = mean(ranges_m.begin(), split), far_m = mean(split, ranges_m.end());
  if (far_m - near_m <= mixing_distance_m) return mean(ranges_m.begin(), ranges_m.end());
  return split - ranges_m.begin() >= ranges_m.end() - split ? near_m : far_m;
}

}  // namespace

LaserRig city_flyer_rig(std::size_t beams) {
  constexpr std::size_t kMirrored = 20, kHidden = 36;
  HM_CHECK(beams > 2 * (kMirrored + kHidden), "{} beams", beams);
  LaserRig rig;
  rig.T_base_laser = SE3(Mat3::Identity(), Vec3(0, 0, 0.12));
  rig.horizontal = BeamRange{kMirrored + kHidden, beams - kMirrored - kHidden};
  rig.down =
      LaserRig::Mirror{{0, kMirrored}, rig.T_base_laser * mirror({-0.0474, -0.0474, 0.0670}, {90, -45, -45})};
  rig.up = LaserRig::Mirror{{beams - kMirrored, beams},
                            rig.T_base_laser * mirror({-0.0474, 0.0474, -0.0670}, {90, 45, 45})};
  return rig;
}

LaserSensor::LaserSensor(const World& world, const Renderer& renderer, const Setup& setup)
    : world_(world), renderer_(renderer), setup_(setup) {}

double LaserSensor::sweep_s() const {
  const LaserSensorParams& p = setup_.params;
  return setup_.effects.rolling_sweep ? p.field_of_view_rad / (2 * std::numbers::pi) / p.kScanRate_hz : 0;
}

std::size_t LaserSensor::rays_per_beam() const {
  return setup_.effects.mixed_readings && setup_.params.kBeamWidth_rad > 0 ? 1 + kRing : 1;
}

const SE3* LaserSensor::mount_of(std::size_t beam) const {
  const auto within = [beam](const BeamRange& range) { return beam >= range.begin && beam < range.end; };
  const LaserRig& rig = setup_.rig;
  if (rig.down && within(rig.down->beams)) return &rig.down->T_base_virtual_laser;
  if (rig.up && within(rig.up->beams)) return &rig.up->T_base_virtual_laser;
  return within(rig.horizontal_beams(static_cast<std::size_t>(setup_.params.beams))) ? &rig.T_base_laser
                                                                                     : nullptr;
}

/// Casts rays, through transparent surfaces. Non-reflecting surfaces are no hit. Beyond a surface seen at a
/// grazing angle the renderer may find the same surface again, whose distance is computed more precisely.
std::vector<RayHit> LaserSensor::cast(const std::vector<Ray>& rays) const {
  std::vector<RayHit> hits(rays.size());
  renderer_.cast(rays, hits);
  if (!setup_.effects.material_dropout) return hits;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    Ray ray = rays[i];
    while (hits[i].is_hit() && world_.parts[hits[i].part].material.clear) {
      ray.near_m = std::max(ray.near_m, hits[i].range_m) + 1e-4;
      renderer_.cast({&ray, 1}, {&hits[i], 1});
    }
    if (hits[i].is_hit() && world_.parts[hits[i].part].material.reflectance == Reflectance::kNoReturn)
      hits[i] = {};
  }
  return hits;
}

/// Noise-free range of a beam from its rays, central ray first; infinity: none.
double LaserSensor::reading_m(std::span<const Ray> rays, std::span<const RayHit> hits) const {
  if (hits.size() == 1) return hits[0].range_m;
  std::vector<double> ranges_m;
  std::size_t reference = hits.size();
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].is_hit()) continue;
    ranges_m.push_back(hits[i].range_m);
    reference = std::min(reference, i);
  }
  if (ranges_m.size() < kLeastRays) return kNothing;
  double furthest_m = 0;
  for (std::size_t i = 0; i < hits.size(); ++i)
    if (hits[i].is_hit())
      furthest_m = std::max(furthest_m, std::abs(beyond(rays[i], hits[i], rays[reference], hits[reference])));
  if (furthest_m > setup_.params.kEdgeStep_m) return mixed_m(ranges_m, setup_.params.kMixingDistance_m);
  if (reference == 0) return hits[0].range_m;
  double sum_m = 0;
  for (const double range_m : ranges_m) sum_m += range_m;
  return sum_m / static_cast<double>(ranges_m.size());
}

/// Rays of all visible beams, central rays first. The ring's radius divides the beam's area in half.
std::vector<Ray> LaserSensor::rays_of(const LaserScan& scan, const PoseAfter& T_world_base) const {
  const std::size_t each = rays_per_beam();
  std::vector<Ray> rays;
  rays.reserve(scan.size() * each);
  SE3 pose = T_world_base(0);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const SE3* mount = mount_of(i);
    if (mount == nullptr) continue;
    if (setup_.effects.rolling_sweep) pose = T_world_base(static_cast<double>(i) * scan.time_increment_s);
    const SE3 T_world_mount = pose * *mount;
    for (std::size_t k = 0; k < each; ++k) {
      const double turn = 2 * std::numbers::pi * static_cast<double>(k) / kRing;
      const double off = k == 0 ? 0 : setup_.params.kBeamWidth_rad / 2 / std::numbers::sqrt2;
      const double angle = scan.angle_rad(i) + off * std::cos(turn), lift = off * std::sin(turn);
      const Vec3 along(std::cos(lift) * std::cos(angle), std::cos(lift) * std::sin(angle), std::sin(lift));
      rays.push_back({T_world_mount.translation(), T_world_mount.rotation() * along, 0});
    }
  }
  return rays;
}

/// Measured value of a range, given standard normal noise.
float LaserSensor::sensed_m(double range_m, double noise) const {
  const LaserSensorParams& p = setup_.params;
  if (setup_.effects.range_noise)
    range_m += noise * (range_m > kFar_m ? p.kRangeSigmaFar_m : p.range_sigma_m);
  if (setup_.effects.range_rounding) range_m = std::round(range_m / p.kRangeStep_m) * p.kRangeStep_m;
  if (!(range_m < p.range_max_m)) return LaserScan::kNoReturn;
  return range_m > p.range_min_m ? static_cast<float>(range_m) : LaserScan::kInvalid;
}

LaserScan LaserSensor::scan(Time stamp, const PoseAfter& T_world_base, Rng rng) const {
  const LaserSensorParams& p = setup_.params;
  LaserScan scan;
  scan.stamp = stamp;
  scan.angle_min_rad = -p.field_of_view_rad / 2;
  scan.angle_increment_rad = p.field_of_view_rad / (p.beams - 1);
  scan.time_increment_s = sweep_s() / (p.beams - 1);
  scan.range_min_m = p.range_min_m;
  scan.range_max_m = p.range_max_m;
  scan.ranges_m.assign(static_cast<std::size_t>(p.beams), LaserScan::kInvalid);

  const std::vector<Ray> rays = rays_of(scan, T_world_base);
  const std::vector<RayHit> hits = cast(rays);
  const std::size_t each = rays_per_beam();
  std::size_t ray = 0;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const double noise = rng.normal();
    if (mount_of(i) == nullptr) continue;
    const double range_m = reading_m(std::span(rays).subspan(ray, each), std::span(hits).subspan(ray, each));
    scan.ranges_m[i] = sensed_m(range_m, noise);
    ray += each;
  }
  return scan;
}

}  // namespace hm
