#include "hm/pipeline/calibrate/calibration_intrinsics.hpp"

#include <algorithm>

#include "hm/core/angle.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/pipeline/calibrate/calibration_figures.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

std::vector<CornerResidual> used_corners(const CameraFit& fit) {
  std::vector<CornerResidual> corners;
  for (const ViewFit& view : fit.views)
    if (!view.is_outlier) corners.insert(corners.end(), view.corners.begin(), view.corners.end());
  return corners;
}

std::size_t outliers(const CameraFit& fit) {
  return static_cast<std::size_t>(
      std::count_if(fit.views.begin(), fit.views.end(), [](const ViewFit& view) { return view.is_outlier; }));
}

void add_corner_figures(HtmlReport& report, const CameraFit& fit) {
  const auto corners = used_corners(fit);
  const auto& camera = fit.camera;
  report.begin_section(
      "Errors over the image",
      "What is left between corners that were found and corners that the camera predicts. It should look "
      "random: lines that agree over a part of the image are distortion that the model cannot follow.");
  report.add_figure(encode_png(draw_error_vectors(corners, camera.width, camera.height)),
                    "error vectors over the image", "Reprojection errors, enlarged.");
  PlotSeries scatter{"corners", {}, {}, SeriesStyle::kScatter};
  for (const CornerResidual& corner : corners) {
    scatter.x.push_back(corner.error_px.x());
    scatter.y.push_back(corner.error_px.y());
  }
  PlotOptions plot;
  plot.x.label = "error to the right (px)", plot.y.label = "error down (px)";
  plot.equal_aspect = true, plot.height_px = 420;
  report.add_svg(plot_svg({&scatter, 1}, plot), "The same errors around zero.");
  report.begin_section("Coverage",
                       "Where the boards were. Lens distortion is only known where there are corners.");
  report.add_figure(encode_png(draw_coverage(corners, camera.width, camera.height)),
                    "corners per cell of the image", "Corners in each cell.");
}

std::string html_of(const IntrinsicsSummary& summary) {
  const CameraFit& fit = summary.fit;
  const SummaryTree tree = describe(summary);
  HtmlReport report(fmt::format("Intrinsics of the {} camera",
                                kCalibratedCameraNames[static_cast<std::size_t>(summary.camera)]));
  const bool good = fit.warnings.empty();
  report.set_verdict(good ? HtmlReport::Verdict::kGood : HtmlReport::Verdict::kDoubtful,
                     good ? *tree.sentence("A good set: {used|image}, {rms_px} of error.")
                          : fmt::format("A poor set: {}.", fit.warnings.front()));
  add_cards(report, tree,
            {{"reprojection error", "{rms_px}", "root mean square over all corners"},
             {"focal length", "{camera.fx_px}", "+- {deviation.fx}"},
             {"images", "{used}", "of {found.pictures}"},
             {"coverage", "{covered_ratio}", "of the image's cells have a corner"}});
  if (!summary.warnings.empty()) {
    report.begin_section("What to improve");
    report.add_list(summary.warnings);
  }
  report.begin_section("Camera",
                       "Plumb-bob model, as OpenCV and ROS; deviations from the scatter of the corners.");
  report.add_table({"", "value", "deviation"}, camera_table(fit.camera, fit.sigma));
  add_corner_figures(report, fit);
  report.begin_section("Images");
  add_list_table(report, tree, "images");
  return report.html();
}

}  // namespace

Result<IntrinsicsSummary> calibrate_intrinsics(const IntrinsicsOptions& options) {
  auto start = read_start(options.start);
  if (!start) return forward_error(start);
  const auto images = list_images(options.images);
  if (!images) return forward_error(images);
  auto found = find_boards(*images, options.board, options.run);
  if (!found) return forward_error(found);
  auto fit = fit_camera(found->views, options.board, found->width, found->height, options.fit);
  if (!fit) {
    fit.error().where = options.images;
    return forward_error(fit);
  }
  IntrinsicsSummary summary{std::move(*found), std::move(*fit), options.camera, {}, {}};
  summary.warnings = warnings_of(summary.found);
  summary.warnings.insert(summary.warnings.end(), summary.fit.warnings.begin(), summary.fit.warnings.end());
  for (std::size_t i = 0; i < summary.fit.views.size(); ++i)
    if (summary.fit.views[i].is_outlier)
      summary.warnings.push_back(fmt::format("{} left out: its error of {:.2f} px is far above the others'",
                                             summary.found.names[i], summary.fit.views[i].rms_px));
  CalibrationOutput output{options.output, std::move(*start), to_json(summary), html_of(summary)};
  (options.camera == CalibratedCamera::kColor ? output.calibration.color_camera
                                              : output.calibration.depth_camera) = summary.fit.camera;
  const auto written = write_calibration_output(output);
  if (!written) return forward_error(written);
  summary.outputs = *written;
  return summary;
}

void visit(const IntrinsicsSummary& summary, SummaryTree& v) {
  const CameraFit& fit = summary.fit;
  v({"camera_name"}, kCalibratedCameraNames[static_cast<std::size_t>(summary.camera)]);
  v.group("found", summary.found);
  v.group("camera", fit.camera);
  v.object("deviation", [&](SummaryTree& sigma) {
    for (std::size_t i = 0; i < kCameraFitNames.size(); ++i)
      sigma({kCameraFitNames[i], {}, i < 4 ? "{:.2f} px" : "{:.5f}"}, fit.sigma[i]);
  });
  v({"rms_px", {}, "{:.3f} px"}, fit.rms_px);
  v({"covered_ratio", {}, "{:.0f} %", 100}, fit.covered_ratio);
  v({"left_out"}, outliers(fit));
  v.shown("used", {}, fit.views.size() - outliers(fit));
  v.list_of("images", fit.views.size(), [&](std::size_t i, SummaryTree& row) {
    const ViewFit& view = fit.views[i];
    row({"name", "image"}, summary.found.names[i]);
    row({"rms_px", "error", "{:.3f} px"}, view.rms_px);
    row({"distance_m", "distance", "{:.2f} m"}, view.distance_m);
    row({"tilt_rad", "tilt", "{:.0f} deg", kDegreesPerRadian}, view.tilt_rad);
    row({"left_out", "left out"}, view.is_outlier);
  });
}

std::string to_text(const IntrinsicsSummary& summary) {
  return describe(summary).lines(
             {"{used} of {found.pictures|image} used, reprojection error {rms_px}, {covered_ratio} of the "
              "image "
              "covered",
              "focal lengths   {camera.fx_px} +- {deviation.fx}, {camera.fy_px} +- {deviation.fy}",
              "principal point {camera.cx_px} +- {deviation.cx}, {camera.cy_px} +- {deviation.cy}",
              "distortion      k1 {camera.k1} k2 {camera.k2} p1 {camera.p1} p2 {camera.p2} k3 {camera.k3}"}) +
         output_lines(summary.outputs);
}

}  // namespace hm
