#pragma once
#include <string>
#include <vector>

#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {

/// Most bytes that a model may take in a page.
inline constexpr std::size_t kMaxModelBytes = 2'000'000;

/// A mesh to be looked at in a report. It should be small: model_view_html() makes about 12 bytes a triangle
/// of it.
struct ModelView {
  TriangleMesh mesh;
  std::vector<float>
      errors_m;            ///< signed distance of each vertex to the truth, metres; NaN unknown; or empty
  std::vector<Vec3> path;  ///< of the camera, world; at most a few thousand points
  SceneExtent extent;      ///< of the whole mesh: up, main directions, floor, ceiling
};

/// The positions of a path, thinned to at most `most` points.
std::vector<Vec3> path_points(const Trajectory& trajectory, std::size_t most = 2000);

/// The element <div class="model"> that model_view_js() turns into a view of WebGL: positions in 16 bits of
/// the box (axes of the scene, z up), colours in 8, errors in 8, indices as distances from the first use of
/// each vertex (Chun, "WebGL Models: End-to-End", OpenGL Insights 2012, section 30.4), all base64 in JSON.
/// Empty for a mesh without triangles. Vertices that are not finite and their triangles are left out.
std::string model_view_html(const ModelView& view);

}  // namespace hm
