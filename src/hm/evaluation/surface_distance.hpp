#pragma once
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/result.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

/// Point of a triangle closest to p (Ericson 2005, section 5.1.5); also for degenerate triangles.
Vec3 closest_point_on_triangle(const Vec3& p, const std::array<Vec3, 3>& triangle);

/// Exact distances to a triangle mesh with a bounding volume hierarchy. Queries are thread safe and
/// bit-identical for any number of threads.
class SurfaceDistance {
 public:
  /// Copies the data it needs. Triangles with missing or non-finite vertices are skipped; error when none
  /// remains.
  static Result<SurfaceDistance> build(const TriangleMesh& mesh);
  ~SurfaceDistance();
  SurfaceDistance(SurfaceDistance&&) noexcept;
  SurfaceDistance& operator=(SurfaceDistance&&) noexcept;

  struct Closest {
    double distance_m = std::numeric_limits<double>::infinity();
    /// Positive on the side of the triangle's normal. If several triangles are equally close (edges,
    /// corners), the one faced most directly determines the sign.
    double signed_distance_m = std::numeric_limits<double>::infinity();
    Vec3 point = Vec3::Zero();
    std::uint32_t triangle = 0;  ///< index in the original mesh
  };
  [[nodiscard]] Closest closest(const Vec3& p) const;
  /// Distance in metres; infinite for a point that is not finite.
  [[nodiscard]] double distance_m(const Vec3& p) const;
  /// Distances of many points; fast if neighbours in the list are neighbours in space.
  [[nodiscard]] std::vector<float> distances_m(std::span<const Vec3> points, const ParallelLoop& loop) const;
  /// Replaces each distance by the minimum of itself and the point's distance to this mesh.
  void lower_distances_m(std::span<const Vec3> points, std::span<float> distances_m,
                         const ParallelLoop& loop) const;
  [[nodiscard]] std::vector<float> signed_distances_m(std::span<const Vec3> points,
                                                      const ParallelLoop& loop) const;

 private:
  struct Impl;
  explicit SurfaceDistance(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Distances of points to a mesh, as SurfaceDistance::distances_m, but with the search structure built for
/// `triangles_per_piece` triangles at a time, to limit memory for meshes of millions of triangles. Error when
/// no triangle is valid.
Result<std::vector<float>> distances_to_mesh_m(const TriangleMesh& mesh, std::span<const Vec3> points,
                                               const ParallelLoop& loop,
                                               std::size_t triangles_per_piece = 125'000);

}  // namespace hm
