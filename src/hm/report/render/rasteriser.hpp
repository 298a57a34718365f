#pragma once
#include <cstdint>
#include <limits>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {

inline constexpr std::uint32_t kNoTriangle = 0xffffffffU;

/// Projection of a view: maps between world, camera and the samples of an image.
class ViewProjection {
 public:
  /// `samples_per_px`: samples along each side of a pixel; width and height in pixels.
  ViewProjection(const RenderView& view, int width, int height, int samples_per_px);

  [[nodiscard]] Vec3 to_camera(const Vec3& p_world) const { return T_camera_world_ * p_world; }
  /// Projects a camera point in front of the near plane to sample coordinates (integer at sample centres) and
  /// nearness, which is linear over the image: 1/z, or -z for an orthographic view.
  [[nodiscard]] Vec3 project(const Vec3& p_camera) const {
    if (orthographic_)
      return {scale_ * p_camera.x() + centre_.x(), scale_ * p_camera.y() + centre_.y(), -p_camera.z()};
    const double inverse = 1 / p_camera.z();
    return {scale_ * p_camera.x() * inverse + centre_.x(), scale_ * p_camera.y() * inverse + centre_.y(),
            inverse};
  }
  /// World point of a sample at this nearness.
  [[nodiscard]] Vec3 unproject(double x, double y, double nearness) const;
  /// Unit vector from a world point towards the viewer.
  [[nodiscard]] Vec3 towards_viewer(const Vec3& p_world) const;
  [[nodiscard]] double near_m() const { return near_m_; }
  /// Number of samples per metre at this nearness.
  [[nodiscard]] double samples_per_m(double nearness) const {
    return orthographic_ ? scale_ : scale_ * nearness;
  }

 private:
  SE3 T_world_camera_, T_camera_world_;
  bool orthographic_ = false;
  double scale_ = 1, near_m_ = 0.02;
  Vec2 centre_;
};

/// Visible surface at each sample of an image.
struct VisibilityBuffer {
  Image<float> nearness;          ///< see ViewProjection::project; lowest float without a surface
  Image<std::uint32_t> triangle;  ///< kNoTriangle without a surface
  [[nodiscard]] bool hit(int x, int y) const { return triangle(x, y) != kNoTriangle; }
};

/// Finds the nearest triangle of each sample with a depth buffer, in bands of rows; ties go to the lowest
/// index. Clips at the near plane and at the view's cut height.
VisibilityBuffer rasterise(const TriangleMesh& mesh, const RenderView& view, const ViewProjection& projection,
                           const RenderOptions& size_in_samples, const ParallelLoop& loop);

/// Barycentric coordinates of p in a triangle, clamped to it; thirds for a triangle without area.
Vec3 barycentric(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c);

}  // namespace hm
