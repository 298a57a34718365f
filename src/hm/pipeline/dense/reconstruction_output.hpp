#pragma once
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/dense/reconstruction.hpp"

namespace hm {

/// Finishes the mesh, measures it against the truth where the recording has one, and writes everything
/// that a run leaves: mesh.*, trajectory.tum, parameters.toml, pictures/, report.json, report.html. Completes
/// the summary. `folder` is where they are written, before they appear in the folder of the options. An error
/// is one of writing.
Result<void> write_results(DensePipeline& pipeline, const ReconstructionOptions& options,
                           const std::filesystem::path& folder, ReconstructionSummary& summary);

}  // namespace hm
