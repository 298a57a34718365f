#include "hm/pipeline/common/mesh_evaluation.hpp"

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/mesh_figures.hpp"

namespace hm {
namespace {

constexpr const char* kTruthMesh = "truth_mesh.ply";
constexpr const char* kTruthVisible = "truth_visible.ply";

}  // namespace

bool has_mesh_truth(const std::filesystem::path& folder) {
  std::error_code code;
  return std::filesystem::exists(folder / kTruthMesh, code);
}

Result<MeshTruth> read_mesh_truth(const std::filesystem::path& path) {
  std::error_code code;
  const bool is_folder = std::filesystem::is_directory(path, code);
  auto mesh = read_mesh(is_folder ? path / kTruthMesh : path);
  if (!mesh) return forward_error(mesh);
  MeshTruth truth{std::move(*mesh), {}};
  if (is_folder && std::filesystem::exists(path / kTruthVisible, code)) {
    const auto points = read_mesh(path / kTruthVisible);
    if (!points) return forward_error(points);
    truth.visible_points.reserve(points->vertices.size());
    for (const auto& point : points->vertices) truth.visible_points.push_back(point.cast<double>());
  }
  return truth;
}

JsonValue to_json(const MeshError& error, const MeshErrorParams& params) {
  const Summary& distance = error.accuracy.distance_m;
  auto accuracy = JsonValue::object({{"mean", distance.mean * 1e3},
                                     {"median", distance.median * 1e3},
                                     {"rmse", distance.rmse * 1e3},
                                     {"p95", distance.p95 * 1e3},
                                     {"bias", error.accuracy.bias_m * 1e3}});
  return JsonValue::object({{"accuracy_mm", std::move(accuracy)},
                            {"accuracy_ratio", error.accuracy.within_ratio},
                            {"completeness_ratio", error.completeness.ratio},
                            {"f_score_ratio", error.f_score},
                            {"threshold_m", params.threshold_m},
                            {"samples", distance.count},
                            {"truth_points", error.completeness.distance_m.count}});
}

std::string to_text(const MeshError& error, const MeshErrorParams& params) {
  const Summary& distance = error.accuracy.distance_m;
  return fmt::format(
      "accuracy      mean {:.2f} mm, median {:.2f} mm, 95 % under {:.2f} mm, bias {:+.2f} mm\n"
      "precision     {:.2f} % of the surface within {:.0f} mm of the truth\n"
      "completeness  {:.2f} % of the truth within {:.0f} mm of the surface\n",
      distance.mean * 1e3, distance.median * 1e3, distance.p95 * 1e3, error.accuracy.bias_m * 1e3,
      error.accuracy.within_ratio * 100, params.threshold_m * 1e3, error.completeness.ratio * 100,
      params.threshold_m * 1e3);
}

std::string mesh_report_html(const TriangleMesh& mesh, const MeshTruth& truth, const MeshError& error,
                             const ParallelLoop& loop) {
  const Summary& distance = error.accuracy.distance_m;
  HtmlReport report("Mesh against truth");
  report.set_verdict(
      HtmlReport::Verdict::kNone,
      fmt::format("The surface is {:.1f} mm from the truth on average; {:.1f} % of the truth is there.",
                  distance.mean * 1e3, error.completeness.ratio * 100));
  report.add_card({"surface error", fmt::format("{:.2f}", distance.mean * 1e3), "mm",
                   fmt::format("mean; 95 % under {:.1f} mm", distance.p95 * 1e3)});
  report.add_card({"bias", fmt::format("{:+.2f}", error.accuracy.bias_m * 1e3), "mm", "positive: in front"});
  report.add_card({"completeness", fmt::format("{:.1f}", error.completeness.ratio * 100), "%", {}});
  if (const auto figure = make_error_figure(mesh, truth.mesh, {}, loop)) {
    report.begin_section("Against the truth");
    add_figure(report, *figure);
  }
  add_error_histogram(report, error);
  return report.html();
}

}  // namespace hm
