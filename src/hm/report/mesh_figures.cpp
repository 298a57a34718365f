#include "hm/report/mesh_figures.hpp"

#include "hm/io/bytes/output_file.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/report/floor_plan_svg.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/render/mesh_renderer.hpp"

namespace hm {
namespace {

RenderOptions render_options(const MeshFigureOptions& options, RenderStyle style) {
  RenderOptions render;
  render.width = options.width_px;
  render.height = options.height_px;
  render.style = style;
  return render;
}

}  // namespace

SceneExtent extent_of(const TriangleMesh& mesh, const MeshFigureOptions& options) {
  return options.up_is_known ? scene_extent_along(mesh, options.up) : scene_extent(mesh, options.up);
}

std::vector<Figure> make_mesh_figures(const TriangleMesh& mesh, const MeshFigureOptions& options,
                                      const ParallelLoop& loop) {
  std::vector<Figure> figures;
  if (mesh.triangles.empty()) return figures;
  const SceneExtent extent = extent_of(mesh, options);
  std::vector<RenderOptions> styles;
  const auto add = [&](std::string name, std::string caption, RenderStyle style) {
    styles.push_back(render_options(options, style));
    figures.push_back({std::move(name), std::move(caption), {}, HtmlReport::Place::kStill});
  };
  const bool all = !options.is_for_comparison;
  if (all) add("shaded", "The surface, shaded; the ceiling is cut away.", RenderStyle::kShaded);
  if (mesh.has_colors()) add("color", "With the colours that the camera saw.", RenderStyle::kColor);
  if (all) add("height", "By height.", RenderStyle::kHeight);
  if (!styles.empty()) {
    std::vector<Image<Rgb8>> images =
        render_styles(mesh, dollhouse_view(extent, styles.front()), styles, loop);
    for (std::size_t i = 0; i < figures.size(); ++i) figures[i].image = std::move(images[i]);
  }
  if (all && options.T_world_camera) {
    const RenderOptions render =
        render_options(options, mesh.has_colors() ? RenderStyle::kColor : RenderStyle::kShaded);
    figures.push_back({"camera", "As the camera saw it in the middle of the recording.",
                       render_mesh(mesh, camera_view(*options.T_world_camera, render), render, loop),
                       HtmlReport::Place::kStill});
  }
  RenderOptions plan = render_options(options, RenderStyle::kShaded);
  plan.trajectory = options.trajectory;
  figures.push_back({"plan", "Floor plan, cut 1.4 m over the floor, with the camera's path.",
                     render_floor_plan(mesh, framed(extent, options.trajectory), plan, loop),
                     HtmlReport::Place::kHalf});
  return figures;
}

std::optional<Figure> make_error_figure(const TriangleMesh& mesh, const TriangleMesh& truth,
                                        const MeshFigureOptions& options, const ParallelLoop& loop) {
  if (mesh.triangles.empty()) return std::nullopt;
  const auto surface = SurfaceDistance::build(truth);
  if (!surface) return std::nullopt;
  const std::vector<float> errors_m = vertex_errors_m(mesh, *surface, loop);
  RenderOptions render = render_options(options, RenderStyle::kScalar);
  render.vertex_values = errors_m;
  render.value_label = "error (mm)";
  return Figure{"error", "Signed distance to the true surface: red in front of it, blue behind.",
                render_mesh(mesh, dollhouse_view(extent_of(mesh, options), render), render, loop),
                HtmlReport::Place::kStill};
}

Result<void> write_figures(const std::filesystem::path& output, std::span<const Figure> figures,
                           std::vector<std::filesystem::path>& outputs, const ParallelLoop& loop) {
  if (figures.empty()) return {};
  const auto folder = output / "pictures";
  if (const auto made = make_folder_in(output, "pictures"); !made) return made;
  std::vector<Result<void>> written(figures.size());
  loop.for_ranges(figures.size(), 1, [&](std::size_t i, std::size_t) {
    written[i] = write_png(folder / (figures[i].name + ".png"), figures[i].image);
  });
  for (const Result<void>& result : written)
    if (!result) return result;
  outputs.push_back(folder);
  return {};
}

void add_figure(HtmlReport& report, const Figure& figure) {
  report.add_figure(encode_jpeg(figure.image, 88), {figure.caption, figure.caption, figure.place,
                                                    figure.legend, figure.scale_m, figure.scale_ratio});
}

void set_lead_figure(HtmlReport& report, std::span<const Figure> figures, std::string_view name) {
  for (const Figure& figure : figures)
    if (figure.name == name)
      report.set_lead_figure(encode_jpeg(figure.image, 88),
                             {figure.caption, figure.caption, HtmlReport::Place::kWide, figure.legend,
                              figure.scale_m, figure.scale_ratio});
}

void add_error_histogram(HtmlReport& report, const MeshError& error) {
  report.begin_section("Error");
  std::vector<float> millimetres(error.accuracy.signed_distances_m);
  for (float& value : millimetres) value *= 1e3f;
  PlotOptions plot;
  plot.x.label = "signed error (mm), positive in front of the true surface";
  plot.y.label = "samples";
  report.add_svg(histogram_svg(millimetres, 80, plot),
                 fmt::format("{} points spread evenly over the reconstructed surface.", millimetres.size()));
}

}  // namespace hm
