#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/pipeline/calibrate/calibration_depth.hpp"
#include "hm/pipeline/calibrate/calibration_figures.hpp"
#include "hm/report/plot.hpp"

namespace hm {
namespace {

struct Totals {
  double before_rms_m = 0, after_rms_m = 0;
};

Totals totals(const std::vector<DepthViewError>& errors) {
  double before = 0, after = 0, n = 0;
  for (const DepthViewError& error : errors) {
    const auto samples = static_cast<double>(error.samples);
    before += samples * error.before_rms_m * error.before_rms_m;
    after += samples * error.after_rms_m * error.after_rms_m;
    n += samples;
  }
  return n > 0 ? Totals{std::sqrt(before / n), std::sqrt(after / n)} : Totals{};
}

/// Of poses with a single image there is none to tell.
std::string noise_text(double noise_m) {
  return noise_m > 0 ? fmt::format("{:.2f}", 1e3 * noise_m) : std::string("-");
}

JsonValue views_json(const std::vector<DepthViewError>& errors) {
  auto list = JsonValue::array();
  for (const DepthViewError& error : errors)
    list.push_back(JsonValue::object({{"name", error.name},
                                      {"distance_m", error.distance_m},
                                      {"samples", error.samples},
                                      {"before_rms_m", error.before_rms_m},
                                      {"after_rms_m", error.after_rms_m},
                                      {"before_mean_m", error.before_mean_m},
                                      {"after_mean_m", error.after_mean_m},
                                      {"noise_m", error.noise_m}}));
  return list;
}

/// Fig. 3.7: RMS against distance, before and after.
std::string rms_plot(const DepthCalibrationSummary& summary) {
  std::vector<PlotSeries> series(5);
  series[0].name = "before", series[1].name = "after", series[2].name = "noise of the readings";
  for (const DistanceError& error : summary.by_distance) {
    for (std::size_t i = 0; i < 2; ++i) series[i].x.push_back(error.distance_m);
    series[0].y.push_back(1e3 * error.before_rms_m);
    series[1].y.push_back(1e3 * error.after_rms_m);
    if (error.noise_m <= 0) continue;
    series[2].x.push_back(error.distance_m);
    series[2].y.push_back(1e3 * error.noise_m);
  }
  series[3] = {"before, each pose", {}, {}, SeriesStyle::kScatter};
  series[4] = {"after, each pose", {}, {}, SeriesStyle::kScatter};
  for (const DepthViewError& error : summary.test) {
    series[3].x.push_back(error.distance_m), series[3].y.push_back(1e3 * error.before_rms_m);
    series[4].x.push_back(error.distance_m), series[4].y.push_back(1e3 * error.after_rms_m);
  }
  PlotOptions plot;
  if (series[2].x.empty()) series.erase(series.begin() + 2);
  plot.x.label = "distance of the board (m)", plot.y.label = "RMS error of depth (mm)";
  return plot_svg(series, plot);
}

void add_maps(HtmlReport& report, const DepthCorrectionModel& model) {
  report.begin_section("The correction over the image",
                       "What is added to readings near, in the middle of and at the far end of "
                       "the trained range; beyond it the correction is held.");
  const double full_m = largest_correction_m(model);
  for (const double z : {model.min_depth_m, (model.min_depth_m + model.max_depth_m) / 2, model.max_depth_m})
    report.add_figure(encode_png(draw_correction(model, z, full_m)), "correction over the image",
                      fmt::format("Readings of {:.2f} m.", z));
}

JsonValue raw_json(const RawDepthSummary& raw) {
  const DisparityCamera& found = raw.fit.found;
  const Vec3 &t = found.T_color_depth.translation(), r = so3_log(found.T_color_depth.rotation());
  const auto three = [](const Vec3& v) { return JsonValue::array_of(std::vector{v.x(), v.y(), v.z()}); };
  JsonValue json = JsonValue::object({{"offset_per_m", found.disparity.offset_per_m},
                                      {"offset_sigma_per_m", raw.fit.offset_sigma_per_m},
                                      {"slope_per_m", found.disparity.slope_per_m},
                                      {"slope_sigma_per_m", raw.fit.slope_sigma_per_m},
                                      {"published_ratio", raw.published_ratio},
                                      {"nominal_start", raw.is_nominal_start},
                                      {"before_rms_units", raw.fit.before_rms},
                                      {"after_rms_units", raw.fit.after_rms},
                                      {"focal_sigma_px", raw.fit.focal_sigma_px},
                                      {"centre_sigma_px", raw.fit.centre_sigma_px}});
  json["depth_camera"] = to_json(found.camera);
  json["T_color_depth_xyz_m"] = three(t);
  json["T_color_depth_rotation_rad"] = three(r);
  json["translation_sigma_m"] = three(raw.fit.translation_sigma_m);
  json["rotation_sigma_rad"] = three(raw.fit.rotation_sigma_rad);
  return json;
}

std::vector<std::vector<std::string>> raw_table(const RawDepthSummary& raw) {
  const DisparityCamera& found = raw.fit.found;
  const Vec3& t = found.T_color_depth.translation();
  const Vec3& sigma = raw.fit.translation_sigma_m;
  return {{"offset (1/m)", fmt::format("{:.5f}", found.disparity.offset_per_m),
           fmt::format("{:.5f}", raw.fit.offset_sigma_per_m)},
          {"slope (1/m)", fmt::format("{:.8f}", found.disparity.slope_per_m),
           fmt::format("{:.8f}", raw.fit.slope_sigma_per_m)},
          {"fx, fy (px)", fmt::format("{:.1f}, {:.1f}", found.camera.fx, found.camera.fy),
           fmt::format("{:.1f}", raw.fit.focal_sigma_px)},
          {"cx, cy (px)", fmt::format("{:.1f}, {:.1f}", found.camera.cx, found.camera.cy),
           fmt::format("{:.1f}", raw.fit.centre_sigma_px)},
          {"depth camera in colour camera (mm)",
           fmt::format("{:.1f}, {:.1f}, {:.1f}", 1e3 * t.x(), 1e3 * t.y(), 1e3 * t.z()),
           fmt::format("{:.1f}, {:.1f}, {:.1f}", 1e3 * sigma.x(), 1e3 * sigma.y(), 1e3 * sigma.z())},
          {"rotation between them (deg)",
           fmt::format("{:.2f}", so3_log(found.T_color_depth.rotation()).norm() * kDegreesPerRadian),
           fmt::format("{:.2f}", raw.fit.rotation_sigma_rad.maxCoeff() * kDegreesPerRadian)}};
}

void add_raw(HtmlReport& report, const RawDepthSummary& raw) {
  report.begin_section(
      "Raw disparity",
      "Depth is 1 / (offset + slope d) of a disparity d. Fitted to the planes of the boards; "
      "`before` and `after` below are both of depth made with these numbers.");
  report.add_table({"", "found", "deviation"}, raw_table(raw));
  report.add_list(
      {fmt::format("{} {:.2f} units of disparity; fitted {:.2f}",
                   raw.is_nominal_start ? "By the Kinect's design the boards are off by (RMS)"
                                        : "As given the boards are off by (RMS)",
                   raw.fit.before_rms, raw.fit.after_rms),
       fmt::format(
           "Depth is {:.3f} times that of the published constants (OpenKinect's 3.3309 and -0.0030711). "
           "The scale is that of the board's squares.",
           raw.published_ratio)});
}

}  // namespace

JsonValue to_json(const DepthCalibrationSummary& summary) {
  const Totals test = totals(summary.test), train = totals(summary.train);
  const DepthCorrectionModel& model = summary.fit.model;
  JsonValue json = JsonValue::object({{"poses", JsonValue::object({{"total", summary.poses},
                                                                   {"train", summary.train.size()},
                                                                   {"test", summary.test.size()},
                                                                   {"left_out", summary.left_out.size()}})}});
  json["left_out"] = JsonValue::array_of(summary.left_out);
  json["pixels"] = JsonValue::object(
      {{"used", summary.fit.samples}, {"no_reading", summary.no_reading}, {"off_plane", summary.off_plane}});
  json["before_rms_m"] = test.before_rms_m;
  json["after_rms_m"] = test.after_rms_m;
  json["train_before_rms_m"] = train.before_rms_m;
  json["train_after_rms_m"] = train.after_rms_m;
  auto distances = JsonValue::array();
  for (const DistanceError& error : summary.by_distance)
    distances.push_back(JsonValue::object({{"distance_m", error.distance_m},
                                           {"samples", error.samples},
                                           {"before_rms_m", error.before_rms_m},
                                           {"after_rms_m", error.after_rms_m},
                                           {"noise_m", error.noise_m}}));
  json["distances"] = std::move(distances);
  if (summary.raw) json["raw_disparity"] = raw_json(*summary.raw);
  if (const auto& refined = summary.refinement)
    json["refined"] = JsonValue::object({{"depth_camera", to_json(refined->geometry.depth_camera)},
                                         {"color_camera", to_json(refined->geometry.color_camera)},
                                         {"corners_before", refined->corners_before},
                                         {"corners_after", refined->corners_after},
                                         {"depth_before", refined->depth_before},
                                         {"depth_after", refined->depth_after}});
  json["model"] = JsonValue::object({{"mode", kDepthFitModeNames[static_cast<std::size_t>(model.mode)]},
                                     {"columns", model.columns},
                                     {"rows", model.rows},
                                     {"terms", model.terms},
                                     {"min_depth_m", model.min_depth_m},
                                     {"max_depth_m", model.max_depth_m},
                                     {"largest_m", largest_correction_m(model)},
                                     {"covered_ratio", summary.fit.fitted_pixel_ratio}});
  json["test_poses"] = views_json(summary.test);
  json["train_poses"] = views_json(summary.train);
  return json;
}

std::string to_text(const DepthCalibrationSummary& summary) {
  const Totals test = totals(summary.test);
  const DepthCorrectionModel& model = summary.fit.model;
  std::string text = fmt::format("{} poses to train on, {} to test, {} left out\n", summary.train.size(),
                                 summary.test.size(), summary.left_out.size());
  text += fmt::format("correction: {}, trained from {:.2f} to {:.2f} m, at most {:.1f} mm\n",
                      kDepthFitModeNames[static_cast<std::size_t>(model.mode)], model.min_depth_m,
                      model.max_depth_m, 1e3 * largest_correction_m(model));
  if (const auto& raw = summary.raw) {
    const DisparityModel& m = raw->fit.found.disparity;
    text += fmt::format(
        "raw disparity d: depth = 1 / ({:.5f} {:+.8f} d), {:.3f} times the published; boards off by {:.2f}, "
        "fitted {:.2f} units\n",
        m.offset_per_m, m.slope_per_m, raw->published_ratio, raw->fit.before_rms, raw->fit.after_rms);
    for (const auto& row : raw_table(*raw))
      if (!row[0].ends_with("(1/m)")) text += fmt::format("  {:36}{} +- {}\n", row[0], row[1], row[2]);
  }
  if (const auto& refined = summary.refinement)
    text += fmt::format(
        "cameras adjusted: corners from {:.2f} to {:.2f}, depth from {:.2f} to {:.2f} expected deviations\n",
        refined->corners_before, refined->corners_after, refined->depth_before, refined->depth_after);
  text += "test poses  distance   before    after    noise (RMS, mm)\n";
  for (const DistanceError& error : summary.by_distance)
    text += fmt::format("            {:6.2f} m {:8.2f} {:8.2f} {:>8}\n", error.distance_m,
                        1e3 * error.before_rms_m, 1e3 * error.after_rms_m, noise_text(error.noise_m));
  text +=
      fmt::format("            all      {:8.2f} {:8.2f}\n", 1e3 * test.before_rms_m, 1e3 * test.after_rms_m);
  for (const auto& path : summary.outputs) text += fmt::format("  {}\n", path.string());
  return text;
}

std::string to_html(const DepthCalibrationSummary& summary) {
  const Totals test = totals(summary.test);
  HtmlReport report("Correction of depth");
  const bool good = summary.warnings.empty() && test.after_rms_m < test.before_rms_m;
  report.set_verdict(
      good ? HtmlReport::Verdict::kGood : HtmlReport::Verdict::kDoubtful,
      fmt::format("On poses that the fit did not see, the error of depth goes from {:.1f} to {:.1f} mm.",
                  1e3 * test.before_rms_m, 1e3 * test.after_rms_m));
  report.add_card({"before", fmt::format("{:.1f}", 1e3 * test.before_rms_m), "mm", "RMS, test poses"});
  report.add_card({"after", fmt::format("{:.1f}", 1e3 * test.after_rms_m), "mm", "RMS, test poses"});
  report.add_card(
      {"trained",
       fmt::format("{:.1f} - {:.1f}", summary.fit.model.min_depth_m, summary.fit.model.max_depth_m), "m",
       fmt::format("{} poses", summary.train.size())});
  if (!summary.warnings.empty()) {
    report.begin_section("What to mend");
    report.add_list(summary.warnings);
  }
  if (summary.raw) add_raw(report, *summary.raw);
  report.begin_section("Error against distance",
                       "Depth against the plane that the colour camera saw, over the pixels of the board.");
  report.add_svg(rms_plot(summary),
                 summary.has_test_folder ? "Poses of the folder test." : "Poses that were held out.");
  add_maps(report, summary.fit.model);
  report.begin_section("Test poses");
  std::vector<std::vector<std::string>> rows;
  for (const DepthViewError& error : summary.test)
    rows.push_back(
        {error.name, fmt::format("{:.2f}", error.distance_m), fmt::format("{:.2f}", 1e3 * error.before_rms_m),
         fmt::format("{:.2f}", 1e3 * error.after_rms_m), fmt::format("{:+.2f}", 1e3 * error.after_mean_m),
         noise_text(error.noise_m), std::to_string(error.samples)});
  report.add_table(
      {"pose", "distance (m)", "before (mm)", "after (mm)", "mean after (mm)", "noise (mm)", "pixels"}, rows);
  return report.html();
}

}  // namespace hm
