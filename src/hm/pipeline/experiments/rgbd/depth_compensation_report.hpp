#pragma once
#include <optional>
#include <string>
#include <vector>

#include "hm/pipeline/experiments/rgbd/depth_compensation.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {

/// Content of the figures and the page of the experiment, besides its summary.
struct CompensationMaterial {
  struct Side {
    TriangleMesh mesh;
    std::optional<Image<Rgb8>> heights;  ///< of the occupancy map, from above
  };
  Side without, with;
  const SurfaceDistance* surface = nullptr;  ///< the true one, where it is known
  std::string parameters_toml, program_version;
};

/// Figures with both maps side by side from the same place: floor plan, shaded, error, occupancy.
std::vector<Figure> draw_compensation(const DepthCompensationSummary& summary,
                                      const CompensationMaterial& material, const ParallelLoop& loop);

/// The page: one sentence, a table, the figures, the errors' histograms.
std::string depth_compensation_html(const DepthCompensationSummary& summary,
                                    const CompensationMaterial& material, const std::vector<Figure>& figures);

}  // namespace hm
