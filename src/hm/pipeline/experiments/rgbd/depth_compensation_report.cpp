#include "hm/pipeline/experiments/rgbd/depth_compensation_report.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/text/counted.hpp"
#include "hm/pipeline/common/mesh_evaluation.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/render/mesh_renderer.hpp"
#include "hm/report/run_report.hpp"

namespace hm {

void visit(const CompensationSide& side, SummaryTree& v);

namespace {

constexpr double kErrorLimit_m = 0.1;  ///< ends of the heat-maps and histograms

/// Both figures in one, on white, their upper edges in line.
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

/// Label, value without and value with the correction.
SummaryTree::Rows rows_of(const DepthCompensationSummary& summary) {
  const SummaryTree without = describe(summary.without), with = describe(summary.with);
  SummaryTree::Rows rows = without.rows();
  for (const auto& row : with.rows()) {
    const auto same = std::ranges::find(rows, row[0], [](const auto& cells) { return cells[0]; });
    if (same != rows.end()) same->push_back(row[1]);
  }
  for (auto& row : rows) row.resize(3, "-");
  return rows;
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
  const SummaryTree tree = describe(summary);
  const auto compared = tree.sentence(
      "With depth compensation the surface is {with.surface_error_mm.mean} from the truth on average, "
      "without "
      "{without.surface_error_mm.mean}; {with.completeness_ratio} of the true surface is there, without "
      "{without.completeness_ratio}.");
  return compared ? *compared
                  : *tree.sentence("{with.frames|frame}, mapped without and with depth compensation.");
}

void add_agreement(SummaryTree& v, const char* key, const std::string& map,
                   const std::optional<MapAgreement>& agreement) {
  if (!agreement) return;
  v.object(key, [&](SummaryTree& error) {
    error({"count"}, agreement->count);
    error({"mean_mm", map + ": mean distance", "{:.1f} mm"}, 1e3 * agreement->distance_m.mean);
    error({"median_mm", map + ": median distance", "{:.1f} mm"}, 1e3 * agreement->distance_m.median);
    error({"p95_mm", map + ": 95 % under", "{:.1f} mm"}, 1e3 * agreement->distance_m.p95);
    error({"near_ratio", map + ": within a cell's edge of the surface", "{:.1f} %", 100},
          agreement->near_ratio);
  });
}

}  // namespace

void visit(const CompensationSide& side, SummaryTree& v) {
  v({"frames", "frames"}, side.reconstruction.frames_integrated);
  v({"volumes", "blocks of voxels"}, side.reconstruction.volumes);
  v({"triangles", "triangles"}, side.reconstruction.triangles);
  v({"keyframes", "keyframes"}, side.keyframes);
  v({"points", "point map: points"}, side.points);
  v({"occupied_cells", "occupancy map: occupied cells"}, side.occupied_cells);
  if (const auto& error = side.reconstruction.error) {
    add_surface_error(v, "surface_error_mm", error->accuracy, {"mean", "median", "p95"});
    v({"completeness_ratio", "share of the true surface that is there", "{:.1f} %", 100},
      error->completeness.ratio);
  }
  add_agreement(v, "point_error", "point map", side.point_error);
  add_agreement(v, "cell_error", "occupancy map", side.cell_error);
}

std::vector<Figure> draw_compensation(const DepthCompensationSummary& summary,
                                      const CompensationMaterial& material, const ParallelLoop& loop) {
  std::vector<Figure> figures;
  const TriangleMesh &without = material.without.mesh, &with = material.with.mesh;
  if (without.triangles.empty() || with.triangles.empty()) return figures;
  // Both are seen from one place.
  const SceneExtent extent = scene_extent(with, up_of_cameras(summary.with.reconstruction.trajectory));
  const auto pair = [&](std::string name, std::string caption, auto&& draw) {
    figures.push_back({std::move(name), "Left without, right with depth compensation: " + caption,
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
    figures.push_back(
        {"occupancy",
         "Left without, right with depth compensation: the highest occupied cell of the occupancy "
         "map, from above, by height.",
         side_by_side(*material.without.heights, *material.with.heights)});
  return figures;
}

std::string depth_compensation_html(const DepthCompensationSummary& summary,
                                    const CompensationMaterial& material,
                                    const std::vector<Figure>& figures) {
  HtmlReport report("Depth compensation");
  report.set_verdict(HtmlReport::Verdict::kNone, sentence(summary));
  add_warnings_section(report, summary.warnings);
  report.begin_section(
      "Both maps",
      fmt::format("The same {} with the same poses, mapped twice: without and with the depth correction of "
                  "the calibration. Point map and occupancy map are made from {}.",
                  counted(summary.with.reconstruction.frames_integrated, "frame"),
                  counted(summary.with.keyframes, "keyframe")));
  report.add_table({"", "without", "with"}, rows_of(summary));
  for (const Figure& figure : figures) add_figure(report, figure);
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

void visit(const DepthCompensationSummary& summary, SummaryTree& v) {
  v.group("without", summary.without);
  v.group("with", summary.with);
}

std::string to_text(const DepthCompensationSummary& summary) {
  std::string text = fmt::format("{:<70}{:>12}{:>12}\n", "depth compensation", "without", "with");
  for (const auto& row : rows_of(summary))
    text += fmt::format("{:<70}{:>12}{:>12}\n", row[0], row[1], row[2]);
  return text;
}

}  // namespace hm
