#pragma once
#include <span>
#include <string>
#include <vector>

#include "hm/evaluation/mesh_error.hpp"
#include "hm/pipeline/experiments/common/experiment_frames.hpp"
#include "hm/report/mesh_figures.hpp"
#include "hm/tsdf/integration/integrator.hpp"

namespace hm {

/// One way of integrating scans (dissertation 4.3), with a map of its own.
class IntegrationRun {
 public:
  /// The loop must outlive the run.
  IntegrationRun(std::string name, const TsdfParams& params, const DepthNoise& noise,
                 const PinholeCamera& camera, const ParallelLoop& loop)
      : name_(std::move(name)),
        integrator_(params, noise, camera, loop),
        grid_(Integrator::make_grid(params)) {}

  ScanStats integrate(const RgbdFrame& frame);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const VolumeGrid& grid() const { return grid_; }
  /// Processor time of the calling thread for each scan.
  [[nodiscard]] const std::vector<double>& scan_ms() const { return scan_ms_; }
  [[nodiscard]] TriangleMesh mesh(const ParallelLoop& loop) const;

 private:
  std::string name_;
  Integrator integrator_;
  VolumeGrid grid_;
  std::vector<double> scan_ms_;
};

/// Mean absolute difference (grey levels, over the three channels) between the colours of a mesh's vertices
/// and those of the image pixels that see them: a vertex is seen where it lies within 3 cm of the reading.
class ColorDifference {
 public:
  ColorDifference(const TriangleMesh& mesh, const PinholeCamera& camera) : mesh_(mesh), camera_(camera) {}
  void add(const RgbdFrame& frame);
  [[nodiscard]] double mean_levels() const {
    return count_ == 0 ? 0 : sum_ / (3 * static_cast<double>(count_));
  }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  const TriangleMesh& mesh_;
  PinholeCamera camera_;
  double sum_ = 0;
  std::size_t count_ = 0;
};

/// A mesh and what is written below its picture.
struct CaptionedMesh {
  std::string name, caption;
  const TriangleMesh* mesh = nullptr;
};

/// Draws meshes from the same view above (found from the first one), two side by side.
std::vector<Figure> draw_side_by_side(std::span<const CaptionedMesh> meshes, RenderStyle style, int width_px,
                                      const ParallelLoop& loop);

}  // namespace hm
