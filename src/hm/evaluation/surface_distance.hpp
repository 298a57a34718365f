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

/// The point of a triangle that is closest to p (Ericson 2005, section 5.1.5); works for degenerate
/// triangles too.
Vec3 closest_point_on_triangle(const Vec3& p, const std::array<Vec3, 3>& triangle);

/// Exact distances to a triangle mesh, through a bounding volume hierarchy. Queries are thread safe, and
/// give the same bits whatever the number of threads.
class SurfaceDistance {
 public:
  /// Copies what it needs of the mesh. Triangles with a vertex that is not finite or does not exist are
  /// left out; an error when none remains.
  static Result<SurfaceDistance> build(const TriangleMesh& mesh);
  ~SurfaceDistance();
  SurfaceDistance(SurfaceDistance&&) noexcept;
  SurfaceDistance& operator=(SurfaceDistance&&) noexcept;

  struct Closest {
    double distance_m = std::numeric_limits<double>::infinity();
    /// Positive on the side that the triangle's normal points to. Where several triangles are equally
    /// close (edges, corners) the one faced most directly decides.
    double signed_distance_m = std::numeric_limits<double>::infinity();
    Vec3 point = Vec3::Zero();
    std::uint32_t triangle = 0;  ///< index in the mesh given
  };
  [[nodiscard]] Closest closest(const Vec3& p) const;
  /// Distance in metres; infinite for a point that is not finite.
  [[nodiscard]] double distance_m(const Vec3& p) const;
  /// distance_m of many points; fast when neighbours in the list are neighbours in space.
  [[nodiscard]] std::vector<float> distances_m(std::span<const Vec3> points, const ParallelLoop& loop) const;
  /// Lowers each of the distances to the point's distance to this mesh, where that is less.
  void lower_distances_m(std::span<const Vec3> points, std::span<float> distances_m,
                         const ParallelLoop& loop) const;
  [[nodiscard]] std::vector<float> signed_distances_m(std::span<const Vec3> points,
                                                      const ParallelLoop& loop) const;

 private:
  struct Impl;
  explicit SurfaceDistance(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The distance of each point to a mesh, as SurfaceDistance::distances_m, but with the search structure built
/// for `triangles_per_piece` triangles at a time: a house at 2 cm has millions, and the whole structure would
/// take more memory than the map. An error when no triangle is usable.
Result<std::vector<float>> distances_to_mesh_m(const TriangleMesh& mesh, std::span<const Vec3> points,
                                               const ParallelLoop& loop,
                                               std::size_t triangles_per_piece = 125'000);

}  // namespace hm
