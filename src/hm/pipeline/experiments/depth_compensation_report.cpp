#include "hm/pipeline/experiments/depth_compensation_report.hpp"

#include <algorithm>
#include <cmath>

#include "hm/report/render/mesh_renderer.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

constexpr double kErrorLimit_m = 0.1;  ///< ends of the heat-maps and histograms

/// Both pictures in one, on white, their upper edges in line.
Image<Rgb8> side_by_side(const Image<Rgb8>& left, const Image<Rgb8>& right) {
  constexpr int kGap_px = 16;
  Image<Rgb8> both(left.width() + kGap_px + right.width(), std::max(left.height(), right.height()),
                   Rgb8{255, 255, 255});
  for (int y = 0; y < left.height(); ++y)
    for (int x = 0; x < left.width(); ++x) both(x, y) = left(x, y);
  for (int y = 0; y < right.height(); ++y)
    for (int x = 0; x < right.width(); ++x) both(left.width() + kGap_px + x, y) = right(x, y);
  return both;
}

RenderOptions render_options(RenderStyle style) {
  RenderOptions render;
  render.width = 1000, render.height = 800;
  render.style = style;
  return render;
}

/// One value of both maps as a row of the table.
struct Row {
  const char* what;
  std::optional<double> without, with;
  const char* format;
};

std::optional<double> mesh_value(const CompensationSide& side, double (*value)(const MeshError&)) {
  const auto& error = side.reconstruction.error;
  return error ? std::optional(value(*error)) : std::nullopt;
}

std::optional<double> map_value(const std::optional<MapAgreement>& error,
                                double (*value)(const MapAgreement&)) {
  return error ? std::optional(value(*error)) : std::nullopt;
}

std::vector<Row> rows_of(const DepthCompensationSummary& summary) {
  std::vector<Row> rows;
  const auto mesh = [&](const char* what, double (*value)(const MeshError&), const char* format) {
    rows.push_back({what, mesh_value(summary.without, value), mesh_value(summary.with, value), format});
  };
  mesh(
      "mesh: mean distance from the true surface (mm)",
      [](const MeshError& e) { return 1e3 * e.accuracy.distance_m.mean; }, "{:.1f}");
  mesh(
      "mesh: 95 % under (mm)", [](const MeshError& e) { return 1e3 * e.accuracy.distance_m.p95; }, "{:.1f}");
  mesh(
      "mesh: mean signed distance (mm), in front is positive",
      [](const MeshError& e) { return 1e3 * e.accuracy.bias_m; }, "{:+.1f}");
  mesh(
      "mesh: share of the true surface that is there (%)",
      [](const MeshError& e) { return 100 * e.completeness.ratio; }, "{:.1f}");
  const auto map = [&](const char* what, std::optional<MapAgreement> CompensationSide::*which,
                       double (*value)(const MapAgreement&), const char* format) {
    rows.push_back(
        {what, map_value(summary.without.*which, value), map_value(summary.with.*which, value), format});
  };
  map(
      "point map: mean distance (mm)", &CompensationSide::point_error,
      [](const MapAgreement& m) { return 1e3 * m.distance_m.mean; }, "{:.1f}");
  map(
      "point map: 95 % under (mm)", &CompensationSide::point_error,
      [](const MapAgreement& m) { return 1e3 * m.distance_m.p95; }, "{:.1f}");
  map(
      "occupancy map: cells farther from the surface than their edge (%)", &CompensationSide::cell_error,
      [](const MapAgreement& m) { return 100 * (1 - m.near_ratio); }, "{:.1f}");
  rows.push_back({"occupancy map: occupied cells", static_cast<double>(summary.without.occupied_cells),
                  static_cast<double>(summary.with.occupied_cells), "{:.0f}"});
  rows.push_back({"triangles", static_cast<double>(summary.without.reconstruction.triangles),
                  static_cast<double>(summary.with.reconstruction.triangles), "{:.0f}"});
  rows.push_back({"volumes", static_cast<double>(summary.without.reconstruction.volumes),
                  static_cast<double>(summary.with.reconstruction.volumes), "{:.0f}"});
  return rows;
}

std::string written(const std::optional<double>& value, const char* format) {
  return value ? fmt::format(fmt::runtime(format), *value) : std::string("-");
}

/// Shares of the surface by signed error, as a line.
PlotSeries histogram(const char* name, const MeshError& error) {
  constexpr int kBins = 100;
  std::vector<double> counts(kBins, 0.0);
  for (const float distance : error.accuracy.signed_distances_m) {
    const double share = (static_cast<double>(distance) + kErrorLimit_m) / (2 * kErrorLimit_m);
    if (share >= 0 && share < 1) ++counts[static_cast<std::size_t>(share * kBins)];
  }
  const auto total = static_cast<double>(std::max<std::size_t>(1, error.accuracy.signed_distances_m.size()));
  PlotSeries series{name, {}, {}, SeriesStyle::kLine};
  for (int i = 0; i < kBins; ++i) {
    series.x.push_back(1e3 * kErrorLimit_m * (2 * (i + 0.5) / kBins - 1));
    series.y.push_back(100 * counts[static_cast<std::size_t>(i)] / total);
  }
  return series;
}

std::string sentence(const DepthCompensationSummary& summary) {
  const auto &without = summary.without.reconstruction.error, &with = summary.with.reconstruction.error;
  if (!without || !with)
    return fmt::format("{} frames, mapped without and with depth compensation.",
                       summary.with.reconstruction.frames_integrated);
  return fmt::format(
      "With depth compensation the surface is {:.1f} mm from the truth on average, without {:.1f} mm; {:.0f} "
      "% "
      "of the true surface is there, without {:.0f} %.",
      1e3 * with->accuracy.distance_m.mean, 1e3 * without->accuracy.distance_m.mean,
      100 * with->completeness.ratio, 100 * without->completeness.ratio);
}

JsonValue to_json(const MapAgreement& agreement) {
  return JsonValue::object({{"count", agreement.count},
                            {"mean_mm", 1e3 * agreement.distance_m.mean},
                            {"median_mm", 1e3 * agreement.distance_m.median},
                            {"p95_mm", 1e3 * agreement.distance_m.p95},
                            {"near_ratio", agreement.near_ratio}});
}

JsonValue to_json(const CompensationSide& side) {
  auto json = JsonValue::object({{"frames", side.reconstruction.frames_integrated},
                                 {"volumes", side.reconstruction.volumes},
                                 {"triangles", side.reconstruction.triangles},
                                 {"keyframes", side.keyframes},
                                 {"points", side.points},
                                 {"occupied_cells", side.occupied_cells}});
  if (const auto& error = side.reconstruction.error) {
    json["surface_error_mm"] = JsonValue::object({{"mean", 1e3 * error->accuracy.distance_m.mean},
                                                  {"median", 1e3 * error->accuracy.distance_m.median},
                                                  {"p95", 1e3 * error->accuracy.distance_m.p95},
                                                  {"bias", 1e3 * error->accuracy.bias_m}});
    json["completeness_ratio"] = error->completeness.ratio;
  }
  if (side.point_error) json["point_error"] = to_json(*side.point_error);
  if (side.cell_error) json["cell_error"] = to_json(*side.cell_error);
  return json;
}

}  // namespace

std::vector<MeshPicture> draw_compensation(const DepthCompensationSummary& summary,
                                           const CompensationMaterial& material, const ParallelLoop& loop) {
  std::vector<MeshPicture> pictures;
  const TriangleMesh &without = material.without.mesh, &with = material.with.mesh;
  if (without.triangles.empty() || with.triangles.empty()) return pictures;
  // Both are seen from one place.
  const SceneExtent extent = scene_extent(with, up_of_cameras(summary.with.reconstruction.trajectory));
  const auto pair = [&](std::string name, std::string caption, auto&& draw) {
    pictures.push_back({std::move(name), "Left without, right with depth compensation: " + caption,
                        side_by_side(draw(without), draw(with))});
  };
  pair("plan", "floor plan, cut 1.4 m over the floor.", [&](const TriangleMesh& mesh) {
    return render_floor_plan(mesh, extent, render_options(RenderStyle::kShaded), loop);
  });
  pair("shaded", "the surface from above, its ceiling cut away.", [&](const TriangleMesh& mesh) {
    const RenderOptions render = render_options(RenderStyle::kShaded);
    return render_mesh(mesh, dollhouse_view(extent, render), render, loop);
  });
  if (material.surface)
    pair("error", "distance to the true surface, red in front of it, blue behind.",
         [&](const TriangleMesh& mesh) {
           const std::vector<float> errors_m = vertex_errors_m(mesh, *material.surface, loop);
           RenderOptions render = render_options(RenderStyle::kScalar);
           render.vertex_values = errors_m;
           render.value_limit = kErrorLimit_m;
           return render_mesh(mesh, dollhouse_view(extent, render), render, loop);
         });
  if (material.without.heights && material.with.heights)
    pictures.push_back(
        {"occupancy",
         "Left without, right with depth compensation: the highest occupied cell of the occupancy "
         "map, from above, by height.",
         side_by_side(*material.without.heights, *material.with.heights)});
  return pictures;
}

std::string depth_compensation_html(const DepthCompensationSummary& summary,
                                    const CompensationMaterial& material,
                                    const std::vector<MeshPicture>& pictures) {
  HtmlReport report("Depth compensation");
  report.set_verdict(HtmlReport::Verdict::kNone, sentence(summary));
  add_warnings_section(report, summary.warnings);
  report.begin_section(
      "Both maps", fmt::format("The same {} frames with the same poses, read twice: without and with the "
                               "calibration's depth correction. Point map and occupancy map are made of {} "
                               "keyframes.",
                               summary.with.reconstruction.frames_integrated, summary.with.keyframes));
  std::vector<std::vector<std::string>> table;
  for (const Row& row : rows_of(summary))
    table.push_back({row.what, written(row.without, row.format), written(row.with, row.format)});
  report.add_table({"", "without", "with"}, table);
  for (const MeshPicture& picture : pictures) add_picture(report, picture);
  const auto &without = summary.without.reconstruction.error, &with = summary.with.reconstruction.error;
  if (without && with) {
    report.begin_section("Error");
    const std::vector<PlotSeries> series{histogram("without", *without), histogram("with", *with)};
    PlotOptions plot;
    plot.x.label = "signed error (mm), positive in front of the true surface";
    plot.y.label = "share of the surface (% in 2 mm)";
    report.add_svg(plot_svg(series, plot), "Points spread evenly over each surface.");
  }
  return page_with_parameters(report, material.parameters_toml, material.program_version);
}

JsonValue to_json(const DepthCompensationSummary& summary) {
  return JsonValue::object({{"without", to_json(summary.without)}, {"with", to_json(summary.with)}});
}

std::string to_text(const DepthCompensationSummary& summary) {
  std::string text = fmt::format("{:<70}{:>10}{:>10}\n", "depth compensation", "without", "with");
  for (const Row& row : rows_of(summary))
    text += fmt::format("{:<70}{:>10}{:>10}\n", row.what, written(row.without, row.format),
                        written(row.with, row.format));
  return text;
}

}  // namespace hm
