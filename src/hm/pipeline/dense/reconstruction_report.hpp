#pragma once
#include <optional>
#include <string>
#include <vector>

#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/common/scene_model.hpp"
#include "hm/pipeline/dense/reconstruction.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {

/// Content of the report besides the summary.
struct ReportMaterial {
  std::string program_version;
  std::string parameters_toml;
  std::vector<Figure> figures;
  std::optional<MeshTruth> truth;
  SceneModel scene;
};

/// The self-contained page of a run: figures, error, time of each stage, memory, what was skipped and why.
std::string report_html(const ReconstructionSummary& summary, const ReportMaterial& material);
/// The summary as JSON, with the series behind the plots.
JsonValue report_json(const ReconstructionSummary& summary, const std::string& program_version);

}  // namespace hm
