#pragma once
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/sim/world/world.hpp"

namespace hm {

/// Images of an ideal camera. A pixel without a surface has depth 0 and part kNoPart.
struct RenderedView {
  static constexpr std::uint16_t kNoPart = 0xffff;
  Image<float> depth_m;              ///< along the optical axis
  Image<float> cos_incidence;        ///< cosine between ray and surface normal, 0 grazing .. 1 frontal
  Image<std::uint16_t> part;         ///< index into World::parts
  Image<Eigen::Vector3f> normal;     ///< of the surface, world frame
  Image<Rgb8> color;                 ///< diffuse, independent of the view
  std::vector<Reflectance> returns;  ///< reflectance of each part
};

/// Ray with origin, unit direction, and minimum distance of hits.
struct Ray {
  Vec3 origin_world = Vec3::Zero();
  Vec3 direction_world = Vec3::UnitX();
  double near_m = 0;
};

/// First surface on a ray; range infinity: none.
struct RayHit {
  double range_m = std::numeric_limits<double>::infinity();
  Vec3 normal_world = Vec3::Zero();
  std::uint16_t part = RenderedView::kNoPart;
  std::uint32_t triangle = 0;  ///< of the merged mesh
  [[nodiscard]] bool is_hit() const { return part != RenderedView::kNoPart; }
};

/// Casts rays into a world (Embree). Immutable after construction, hence thread safe. The hit triangle comes
/// from Embree, the depth from that triangle's plane in double precision.
class Renderer {
 public:
  /// Keeps a reference: the world must outlive the renderer. Throws std::bad_alloc when memory runs out,
  /// std::runtime_error with Embree's reason when it fails otherwise (a thread that the system refuses).
  explicit Renderer(const World& world);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Renders an undistorted view, in parallel over image rows.
  [[nodiscard]] RenderedView render(const PinholeCamera& camera, const SE3& T_world_camera,
                                    const ParallelLoop& loop) const;
  /// The same with a pose for every image row (rolling exposure).
  [[nodiscard]] RenderedView render(const PinholeCamera& camera, std::span<const SE3> T_world_camera,
                                    const ParallelLoop& loop) const;

  /// Casts rays and returns the first hit of each. Fastest if neighbouring rays are similar.
  void cast(std::span<const Ray> rays, std::span<RayHit> hits) const;
  /// Diffuse colour of the surface that a ray hit.
  [[nodiscard]] Rgb8 color(const Ray& ray, const RayHit& hit) const;

  /// True when the segment between two points is free, except within `margin_m` of its ends.
  [[nodiscard]] bool is_free(const Vec3& a_world, const Vec3& b_world, double margin_m) const;
  /// Distance from a point to the nearest surface, at most `limit_m`.
  [[nodiscard]] double clearance_m(const Vec3& p_world, double limit_m) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
