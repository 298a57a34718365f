#include "hm/tsdf/alignment/alignment_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace hm {
namespace {

/// Local plane of the map's surface.
struct Plane {
  Vec3 p_world;
  Vec3 normal;
  double distance_m;  ///< of p_world
};

/// Surface at a point, if there is one that faces `ray`.
std::optional<Plane> surface_at(const Vec3& p_world, const Vec3& ray, double near_surface_m,
                                VoxelLookup& lookup) {
  const auto sample = lookup.sample(p_world);
  if (!sample || std::abs(sample->distance_m) > near_surface_m) return std::nullopt;
  const double slope = sample->gradient.norm();
  if (slope < kLeastSlope || sample->gradient.dot(ray) >= 0) return std::nullopt;
  return Plane{p_world, sample->gradient / slope, sample->distance_m / slope};
}

/// Surface on the ray nearest to the reading.
std::optional<Plane> find_surface(const SurfaceSearch& search, const Vec3& p_world, const Vec3& ray,
                                  VoxelLookup& lookup) {
  if (auto plane = surface_at(p_world, ray, search.near_surface_m, lookup)) return plane;
  for (double s = search.near_surface_m; s <= search.reach_m; s += search.near_surface_m)
    for (const double along : {s, -s})
      if (auto plane = surface_at(p_world + along * ray, ray, search.near_surface_m, lookup)) return plane;
  return std::nullopt;
}

}  // namespace

AlignmentTerms sum_search_terms(const SurfaceSearch& search, const AlignmentPoints& points,
                                const SearchPose& pose, VoxelLookup& lookup) {
  AlignmentTerms terms;
  for (std::size_t i = 0; i < search.count; i += search.every) {
    const Vec3 p_camera(points.x_m[i], points.y_m[i], points.z_m[i]);
    const Vec3 p_world = pose.T_world_camera * p_camera;
    const Vec3 ray = (p_world - pose.T_world_camera.translation()).normalized();
    const auto plane = find_surface(search, p_world, ray, lookup);
    terms.cost += 1.0;
    if (!plane) continue;
    const double distance_m = plane->distance_m + plane->normal.dot(p_world - plane->p_world);
    const double ratio2 = std::pow(distance_m / search.width_m, 2);
    const double weight = 1.0 / ((1.0 + ratio2) * (1.0 + ratio2));  // Geman and McClure's
    Vec6 jacobian;
    jacobian << plane->normal, (p_world - pose.p_world_centre).cross(plane->normal);
    terms.H += weight * jacobian * jacobian.transpose();
    terms.b += weight * distance_m * jacobian;
    terms.weight += weight;
    terms.agreeing += 1.0;
    terms.cost -= 1.0 / (1.0 + ratio2);
  }
  return terms;
}

}  // namespace hm
