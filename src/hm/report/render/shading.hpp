#pragma once
#include "hm/report/render/rasteriser.hpp"

namespace hm {

/// Surface at one sample.
struct SurfaceSample {
  Vec3 p_world, normal;  ///< unit normal on the viewer's side
  Vec3 weights;          ///< barycentric
  std::uint32_t triangle = 0;
  bool seen_from_behind = false;
};
SurfaceSample surface_sample(const TriangleMesh& mesh, const VisibilityBuffer& buffer,
                             const ViewProjection& projection, const Vec2& sample);

/// Ambient occlusion from the depth buffer: share of the hemisphere over each pixel's surface that is free of
/// other surfaces in the image (1: all).
Image<float> ambient_light(const TriangleMesh& mesh, const VisibilityBuffer& buffer,
                           const ViewProjection& projection, const ParallelLoop& loop);

/// Brightness of a surface lit softly from the viewer, from above and a little from the left.
double brightness(const SurfaceSample& sample, const Vec3& towards_viewer, const Vec3& up);

}  // namespace hm
