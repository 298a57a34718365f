#include "hm/pipeline/common/mesh_evaluation.hpp"

#include <fmt/format.h>

#include <cmath>

#include "hm/io/mesh/mesh_file.hpp"
#include "hm/pipeline/common/scene_model.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/mesh_figures.hpp"
#include "hm/report/run_report.hpp"

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
  const std::filesystem::path file = is_folder ? path / kTruthMesh : path;
  auto mesh = read_mesh(file);
  if (!mesh) return forward_error(mesh);
  MeshTruth truth{std::move(*mesh), {}, file};
  if (is_folder && std::filesystem::exists(path / kTruthVisible, code)) {
    const auto points = read_mesh(path / kTruthVisible);
    if (!points) return forward_error(points);
    truth.visible_points.reserve(points->vertices.size());
    for (const auto& point : points->vertices) truth.visible_points.push_back(point.cast<double>());
  }
  return truth;
}

Result<MeshError> evaluate_mesh_file(const std::filesystem::path& path, const TriangleMesh& mesh,
                                     const MeshTruth& truth, const MeshErrorParams& params,
                                     const ParallelLoop& loop) {
  auto error = evaluate_mesh(mesh, truth.mesh, params, loop, truth.visible_points);
  if (!error) error.error().where = error.error().where == kTrueMesh ? truth.path : path;
  return error;
}

std::string mesh_size_warning(const std::filesystem::path& path, const TriangleMesh& mesh,
                              const MeshTruth& truth) {
  constexpr double kLargest_ratio = 20;  // less than an inch in millimetres
  const Box3 box = bounds(mesh), true_box = bounds(truth.mesh);
  if (box.isEmpty() || true_box.isEmpty()) return {};
  const double size = box.diagonal().norm(), true_size = true_box.diagonal().norm();
  if (!std::isfinite(size / true_size)) return {};
  if (size < kLargest_ratio * true_size && true_size < kLargest_ratio * size) return {};
  return fmt::format(
      "{}: the mesh is {:.4g} times the size of the truth (boxes of {:.4g} and {:.4g} m across); is it in "
      "another unit?",
      path.string(), size / true_size, size, true_size);
}

void turn(MeshTruth& truth, const Mat3& R_turned_truth) {
  const Eigen::Matrix3f R = R_turned_truth.cast<float>();
  for (Eigen::Vector3f& vertex : truth.mesh.vertices) vertex = (R * vertex).eval();
  for (Eigen::Vector3f& normal : truth.mesh.normals) normal = (R * normal).eval();
  for (Vec3& point : truth.visible_points) point = (R_turned_truth * point).eval();
}

void add_surface_error(SummaryTree& v, std::string_view key, const MeshAccuracy& accuracy,
                       SummaryTree::Quantities quantities) {
  const Summary& m = accuracy.distance_m;
  Summary mm;
  mm.mean = 1e3 * m.mean, mm.median = 1e3 * m.median, mm.rmse = 1e3 * m.rmse, mm.p95 = 1e3 * m.p95;
  v.object(key, [&](SummaryTree& below) {
    below.quantities({{}, "distance from the true surface", "{:.2f} mm"}, mm, quantities);
    below({"bias", "mean signed distance, in front is positive", "{:+.2f} mm"}, 1e3 * accuracy.bias_m);
  });
}

void visit(const MeasuredMesh& mesh, SummaryTree& v) {
  const MeshError& error = mesh.error;
  add_surface_error(v, "accuracy_mm", error.accuracy, {"mean", "median", "rmse", "p95"});
  v({"accuracy_ratio", "surface near the truth", "{:.2f} %", 100}, error.accuracy.within_ratio);
  v({"completeness_ratio", "truth that is there", "{:.2f} %", 100}, error.completeness.ratio);
  v({"f_score_ratio", "f-score", "{:.2f} %", 100}, error.f_score);
  v({"threshold_m", "near is within", "{:.0f} mm", 1e3}, mesh.params.threshold_m);
  v({"samples"}, error.accuracy.distance_m.count);
  v({"truth_points"}, error.completeness.distance_m.count);
}

std::string to_text(const MeasuredMesh& mesh) {
  return describe(mesh).lines(
      {"accuracy      mean {accuracy_mm.mean}, median {accuracy_mm.median}, 95 % under {accuracy_mm.p95}, "
       "bias "
       "{accuracy_mm.bias}",
       "precision     {accuracy_ratio} of the surface within {threshold_m} of the truth",
       "completeness  {completeness_ratio} of the truth within {threshold_m} of the surface"});
}

std::string mesh_report_html(const TriangleMesh& mesh, const MeshTruth& truth, const MeasuredMesh& measured,
                             const ParallelLoop& loop) {
  const SummaryTree tree = describe(measured);
  HtmlReport report("Mesh against truth");
  report.set_verdict(HtmlReport::Verdict::kNone,
                     *tree.sentence("The surface is {accuracy_mm.mean} from the truth on average; "
                                    "{completeness_ratio} of the truth is there."));
  const SceneModel scene = make_scene_model(mesh, {}, &truth.mesh, loop);
  report.set_model(scene.model_html);
  add_cards(report, tree,
            {{"surface error", "{accuracy_mm.mean}", "mean; 95 % under {accuracy_mm.p95}"},
             {"bias", "{accuracy_mm.bias}", "positive: in front"},
             {"completeness", "{completeness_ratio}", "of the truth within {threshold_m}"}});
  if (const auto figure = make_error_figure(mesh, truth.mesh, {}, loop)) {
    report.begin_section("Against the truth");
    add_figure(report, *figure);
  }
  add_error_histogram(report, measured.error);
  return report.html();
}

}  // namespace hm
