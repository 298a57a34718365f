#include "hm/pipeline/calibrate/calibration_intrinsics.hpp"

#include <algorithm>

#include "hm/core/angle.hpp"
#include "hm/report/plot.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/pipeline/calibrate/calibration_pictures.hpp"

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

void add_pictures(HtmlReport& report, const CameraFit& fit) {
  const auto corners = used_corners(fit);
  const auto& camera = fit.camera;
  report.begin_section(
      "Errors over the image",
      "What is left between corners that were found and corners that the camera predicts. It should look "
      "random: lines that agree over a part of the image are distortion that the model cannot follow.");
  report.add_picture(encode_png(draw_error_vectors(corners, camera.width, camera.height)),
                     "error vectors over the image", "Reprojection errors, enlarged.");
  PlotSeries scatter{"corners", {}, {}, SeriesStyle::kScatter};
  for (const CornerResidual& corner : corners) {
    scatter.x.push_back(corner.error_px.x());
    scatter.y.push_back(corner.error_px.y());
  }
  PlotOptions plot;
  plot.x.label = "error to the right (px)", plot.y.label = "error down (px)";
  plot.equal_aspect = true, plot.width_px = 480, plot.height_px = 420;
  report.add_svg(plot_svg({&scatter, 1}, plot), "The same errors around zero.");
  report.begin_section("Coverage",
                       "Where the boards were. Lens distortion is only known where there are corners.");
  report.add_picture(encode_png(draw_coverage(corners, camera.width, camera.height)),
                     "corners per cell of the image", "Corners in each cell.");
}

std::string html_of(const IntrinsicsSummary& summary) {
  const CameraFit& fit = summary.fit;
  HtmlReport report(fmt::format("Intrinsics of the {} camera",
                                kCalibratedCameraNames[static_cast<std::size_t>(summary.camera)]));
  const bool good = fit.warnings.empty();
  report.set_verdict(good ? HtmlReport::Verdict::kGood : HtmlReport::Verdict::kDoubtful,
                     good ? fmt::format("A good set: {} pictures, {:.2f} px of error.",
                                        fit.views.size() - outliers(fit), fit.rms_px)
                          : fmt::format("A poor set: {}.", fit.warnings.front()));
  report.add_card(
      {"reprojection error", fmt::format("{:.3f}", fit.rms_px), "px", "root mean square over all corners"});
  report.add_card({"focal length", fmt::format("{:.1f}", fit.camera.fx), "px",
                   fmt::format("+- {:.2f} px", fit.sigma[0])});
  report.add_card({"pictures",
                   std::to_string(fit.views.size() - outliers(fit)),
                   {},
                   fmt::format("of {}", summary.found.pictures)});
  report.add_card({"coverage", fmt::format("{:.0f}", 100 * fit.covered_ratio), "%",
                   "of the image's cells have a corner"});
  if (!summary.warnings.empty()) {
    report.begin_section("What to mend");
    report.add_list(summary.warnings);
  }
  report.begin_section("Camera",
                       "Plumb-bob model, as OpenCV and ROS; deviations from the scatter of the corners.");
  report.add_table({"", "value", "deviation"}, camera_table(fit.camera, fit.sigma));
  add_pictures(report, fit);
  report.begin_section("Pictures");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < fit.views.size(); ++i) {
    const ViewFit& view = fit.views[i];
    rows.push_back(
        {summary.found.names[i], fmt::format("{:.3f}", view.rms_px), fmt::format("{:.2f}", view.distance_m),
         fmt::format("{:.0f}", view.tilt_rad * kDegreesPerRadian), view.is_outlier ? "left out" : ""});
  }
  report.add_table({"picture", "error (px)", "distance (m)", "tilt (deg)", ""}, rows);
  return report.html();
}

}  // namespace

Result<IntrinsicsSummary> calibrate_intrinsics(const IntrinsicsOptions& options) {
  auto start = read_start(options.start);
  if (!start) return forward_error(start);
  const auto pictures = list_pictures(options.pictures);
  if (!pictures) return forward_error(pictures);
  auto found = find_boards(*pictures, options.board, options.run);
  if (!found) return forward_error(found);
  auto fit = fit_camera(found->views, options.board, found->width, found->height, options.fit);
  if (!fit) {
    fit.error().where = options.pictures;
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

JsonValue to_json(const IntrinsicsSummary& summary) {
  const CameraFit& fit = summary.fit;
  JsonValue json =
      JsonValue::object({{"camera_name", kCalibratedCameraNames[static_cast<std::size_t>(summary.camera)]}});
  json["found"] = to_json(summary.found);
  json["camera"] = to_json(fit.camera);
  JsonValue& sigma = json["deviation"] = JsonValue::object();
  for (std::size_t i = 0; i < kCameraFitNames.size(); ++i) sigma[kCameraFitNames[i]] = fit.sigma[i];
  json["rms_px"] = fit.rms_px;
  json["covered_ratio"] = fit.covered_ratio;
  json["left_out"] = outliers(fit);
  auto images = JsonValue::array();
  for (std::size_t i = 0; i < fit.views.size(); ++i)
    images.push_back(JsonValue::object({{"name", summary.found.names[i]},
                                        {"rms_px", fit.views[i].rms_px},
                                        {"distance_m", fit.views[i].distance_m},
                                        {"tilt_rad", fit.views[i].tilt_rad},
                                        {"left_out", fit.views[i].is_outlier}}));
  json["images"] = std::move(images);
  return json;
}

std::string to_text(const IntrinsicsSummary& summary) {
  const CameraFit& fit = summary.fit;
  const PinholeCamera& c = fit.camera;
  std::string text = fmt::format(
      "{} of {} pictures used, reprojection error {:.3f} px, {:.0f} % of the image covered\n",
      fit.views.size() - outliers(fit), summary.found.pictures, fit.rms_px, 100 * fit.covered_ratio);
  text += fmt::format("focal lengths   {:.2f} +- {:.2f}, {:.2f} +- {:.2f} px\n", c.fx, fit.sigma[0], c.fy,
                      fit.sigma[1]);
  text += fmt::format("principal point {:.2f} +- {:.2f}, {:.2f} +- {:.2f} px\n", c.cx, fit.sigma[2], c.cy,
                      fit.sigma[3]);
  text += fmt::format("distortion      k1 {:.5f} k2 {:.5f} p1 {:.5f} p2 {:.5f} k3 {:.5f}\n", c.distortion.k1,
                      c.distortion.k2, c.distortion.p1, c.distortion.p2, c.distortion.k3);
  for (const auto& path : summary.outputs) text += fmt::format("  {}\n", path.string());
  return text;
}

}  // namespace hm
