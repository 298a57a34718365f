#pragma once
#include <memory>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/result.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {

/// Renders depth images of a mesh by ray casting. Triangles are visible from both sides.
class DepthCaster {
 public:
  /// Copies the data it needs. Invalid triangles are skipped; error when none remains.
  static Result<DepthCaster> build(const TriangleMesh& mesh);
  ~DepthCaster();
  DepthCaster(DepthCaster&&) noexcept;
  DepthCaster& operator=(DepthCaster&&) noexcept;

  /// Distance along the optical axis (z, metres) at each pixel centre, with lens distortion; 0 without a hit.
  /// Exact ray intersections, without interpolation.
  [[nodiscard]] Image<float> render(const PinholeCamera& camera, const SE3& T_world_camera,
                                    const ParallelLoop& loop) const;

 private:
  struct Impl;
  explicit DepthCaster(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Agreement of a mesh with the depth images it was built from, accumulated over frames.
class DepthAgreement {
 public:
  /// Readings outside [min_depth_m, max_depth_m] are ignored.
  DepthAgreement(double min_depth_m, double max_depth_m)
      : min_depth_m_(min_depth_m), max_depth_m_(max_depth_m) {}

  struct FrameResult {
    std::size_t valid = 0;              ///< pixels with a reading in range
    std::size_t covered = 0;            ///< of these, pixels where the mesh is visible
    double median_mm = 0, mean_mm = 0;  ///< of |rendered - measured| over the covered ones
  };
  /// Adds one frame: measured depth in metres, row by row (0 or not finite: no reading), and the mesh's
  /// rendered depth of the same size.
  FrameResult add(std::span<const float> measured_m, std::span<const float> rendered_m);

  [[nodiscard]] std::size_t frames() const { return frames_; }
  /// Over all pixels of all frames so far; zeros before the first.
  [[nodiscard]] FrameResult total() const;
  [[nodiscard]] double covered_ratio() const;

 private:
  double min_depth_m_, max_depth_m_;
  std::size_t frames_ = 0, valid_ = 0;
  std::vector<float> differences_m_;
};

}  // namespace hm
