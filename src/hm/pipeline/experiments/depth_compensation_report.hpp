#pragma once
#include <optional>
#include <string>
#include <vector>

#include "hm/pipeline/experiments/depth_compensation.hpp"
#include "hm/report/mesh_pictures.hpp"

namespace hm {

/// What the pictures and the page of the experiment are made of, besides its summary.
struct CompensationMaterial {
  struct Side {
    TriangleMesh mesh;
    std::optional<Image<Rgb8>> heights;  ///< of the occupancy map, from above
  };
  Side without, with;
  const SurfaceDistance* surface = nullptr;  ///< the true one, where it is known
  std::string parameters_toml, program_version;
};

/// Pictures with both maps side by side from the same place: floor plan, shaded, error, occupancy.
std::vector<MeshPicture> draw_compensation(const DepthCompensationSummary& summary,
                                           const CompensationMaterial& material, const ParallelLoop& loop);

/// The page: one sentence, a table, the pictures, the errors' histograms.
std::string depth_compensation_html(const DepthCompensationSummary& summary,
                                    const CompensationMaterial& material,
                                    const std::vector<MeshPicture>& pictures);

}  // namespace hm
