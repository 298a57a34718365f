#pragma once
#include <optional>
#include <string>
#include <vector>

#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/pipeline/common/scene_model.hpp"
#include "hm/pipeline/rgbd/loop_figures.hpp"
#include "hm/pipeline/rgbd/slam_run.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {

/// Content of the report besides the summary.
struct SlamReportMaterial {
  std::string program_version;
  std::string parameters_toml;
  std::vector<Figure> figures;   ///< of the mesh, before and after
  std::vector<Figure> matrices;  ///< of place recognition (dissertation Fig. 3.11)
  std::vector<Figure> maps;      ///< of the maps made of keyframes
  SceneModel scene;
  std::vector<LoopFigure> loops;  ///< some of the accepted ones
};

/// The self-contained page of a run: path before and after (dissertation Fig. 3.12), loops, map before and
/// after, tracking.
std::string slam_report_html(const SlamSummary& summary, const SlamReportMaterial& material);
/// The summary as JSON, with the series behind the plots.
JsonValue slam_report_json(const SlamSummary& summary, const std::string& program_version);

/// accepted, not_accepted, refused{why: frames}, moved_m{}, mean_ms, p99_ms.
void visit(const SlamAlignmentSummary& summary, SummaryTree& v);
/// The section of the report: how many were aligned, why others were not, how far poses moved, the time.
void add_alignment_section(HtmlReport& report, const SlamAlignmentSummary& summary);

}  // namespace hm
