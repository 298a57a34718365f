#include <array>
#include <cmath>
#include <optional>

#include "hm/core/angle.hpp"
#include "hm/io/image/image_file.hpp"
#include "hm/pipeline/calibrate/calibration_depth.hpp"
#include "hm/pipeline/calibrate/calibration_figures.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"

namespace hm {

void visit(const RawDepthSummary& raw, SummaryTree& v);

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

/// Adds the noise of the readings; poses with a single image have none.
void add_noise(SummaryTree& v, std::string_view format, double noise_m) {
  v({"noise_m", "noise", format, 1e3}, noise_m > 0 ? std::optional(noise_m) : std::nullopt);
  v.json("noise_m", noise_m);
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

/// Values found for raw disparity, with their deviations.
SummaryTree::Rows raw_table(const RawDepthSummary& raw) {
  const SummaryTree tree = describe(raw);
  SummaryTree::Rows rows;
  for (const auto& [label, value, deviation] :
       {std::array{"offset (1/m)", "{offset_per_m}", "{offset_sigma_per_m}"},
        std::array{"slope (1/m)", "{slope_per_m}", "{slope_sigma_per_m}"},
        std::array{"fx, fy", "{depth_camera.fx_px}, {depth_camera.fy_px}", "{focal_sigma_px}"},
        std::array{"cx, cy", "{depth_camera.cx_px}, {depth_camera.cy_px}", "{centre_sigma_px}"},
        std::array{"depth camera in colour camera", "{T_color_depth_xyz_m}", "{translation_sigma_m}"},
        std::array{"rotation between them", "{T_color_depth_rotation_rad}", "{rotation_sigma_rad}"}})
    rows.push_back({label, *tree.sentence(value), *tree.sentence(deviation)});
  return rows;
}

void add_raw(HtmlReport& report, const RawDepthSummary& raw) {
  const SummaryTree tree = describe(raw);
  report.begin_section(
      "Raw disparity",
      "Depth is 1 / (offset + slope d) of a disparity d. Fitted to the planes of the boards; "
      "`before` and `after` below are both of depth made with these numbers.");
  report.add_table({"", "found", "deviation"}, raw_table(raw));
  report.add_list(
      {*tree.sentence(
           raw.is_nominal_start
               ? "By the Kinect's design the boards are off by (RMS) {before_rms_units}; fitted "
                 "{after_rms_units}"
               : "As given the boards are off by (RMS) {before_rms_units}; fitted {after_rms_units}"),
       *tree.sentence(
           "Depth is {published_ratio} times that of the published constants (OpenKinect's 3.3309 and "
           "-0.0030711). The scale is that of the board's squares.")});
}

}  // namespace

void visit(const RawDepthSummary& raw, SummaryTree& v) {
  const DisparityCamera& found = raw.fit.found;
  const Vec3 &t = found.T_color_depth.translation(), r = so3_log(found.T_color_depth.rotation());
  const Vec3& s = raw.fit.translation_sigma_m;
  const auto three = [](const Vec3& p) { return JsonValue::array_of(std::vector{p.x(), p.y(), p.z()}); };
  const auto mm = [](const Vec3& p) {
    return fmt::format("{:.1f}, {:.1f}, {:.1f} mm", 1e3 * p.x(), 1e3 * p.y(), 1e3 * p.z());
  };
  v({"offset_per_m", {}, "{:.5f}"}, found.disparity.offset_per_m);
  v({"offset_sigma_per_m", {}, "{:.5f}"}, raw.fit.offset_sigma_per_m);
  v({"slope_per_m", {}, "{:+.8f}"}, found.disparity.slope_per_m);
  v({"slope_sigma_per_m", {}, "{:.8f}"}, raw.fit.slope_sigma_per_m);
  v({"published_ratio", {}, "{:.3f}"}, raw.published_ratio);
  v({"nominal_start"}, raw.is_nominal_start);
  v({"before_rms_units", {}, "{:.2f} units"}, raw.fit.before_rms);
  v({"after_rms_units", {}, "{:.2f} units"}, raw.fit.after_rms);
  v({"focal_sigma_px", {}, "{:.1f} px"}, raw.fit.focal_sigma_px);
  v({"centre_sigma_px", {}, "{:.1f} px"}, raw.fit.centre_sigma_px);
  v.group("depth_camera", found.camera);
  v.json("T_color_depth_xyz_m", three(t));
  v.shown("T_color_depth_xyz_m", {}, mm(t));
  v.json("T_color_depth_rotation_rad", three(r));
  v.shown("T_color_depth_rotation_rad", {}, fmt::format("{:.2f} deg", r.norm() * kDegreesPerRadian));
  v.json("translation_sigma_m", three(s));
  v.shown("translation_sigma_m", {}, mm(s));
  v.json("rotation_sigma_rad", three(raw.fit.rotation_sigma_rad));
  v.shown("rotation_sigma_rad", {},
          fmt::format("{:.2f} deg", raw.fit.rotation_sigma_rad.maxCoeff() * kDegreesPerRadian));
}

void visit(const DistanceError& error, SummaryTree& v) {
  v({"distance_m", "distance", "{:6.2f} m"}, error.distance_m);
  v({"samples", "pixels"}, error.samples);
  v({"before_rms_m", "before", "{:8.2f}", 1e3}, error.before_rms_m);
  v({"after_rms_m", "after", "{:8.2f}", 1e3}, error.after_rms_m);
  add_noise(v, "{:8.2f}", error.noise_m);
}

void visit(const DepthViewError& error, SummaryTree& v) {
  v({"name", "pose"}, error.name);
  v({"distance_m", "distance", "{:.2f} m"}, error.distance_m);
  v({"samples", "pixels"}, error.samples);
  v({"before_rms_m", "before", "{:.2f} mm", 1e3}, error.before_rms_m);
  v({"after_rms_m", "after", "{:.2f} mm", 1e3}, error.after_rms_m);
  v({"before_mean_m", "mean before", "{:+.2f} mm", 1e3}, error.before_mean_m);
  v({"after_mean_m", "mean after", "{:+.2f} mm", 1e3}, error.after_mean_m);
  add_noise(v, "{:.2f} mm", error.noise_m);
}

void visit(const DepthRefinement& refined, SummaryTree& v) {
  v.group("depth_camera", refined.geometry.depth_camera);
  v.group("color_camera", refined.geometry.color_camera);
  v({"corners_before", {}, "{:.2f}"}, refined.corners_before);
  v({"corners_after", {}, "{:.2f}"}, refined.corners_after);
  v({"depth_before", {}, "{:.2f}"}, refined.depth_before);
  v({"depth_after", {}, "{:.2f}"}, refined.depth_after);
}

void visit(const DepthCalibrationSummary& summary, SummaryTree& v) {
  const Totals test = totals(summary.test), train = totals(summary.train);
  const DepthCorrectionModel& model = summary.fit.model;
  v.object("poses", [&](SummaryTree& poses) {
    poses({"total"}, summary.poses);
    poses({"train"}, summary.train.size());
    poses({"test"}, summary.test.size());
    poses({"left_out"}, summary.left_out.size());
  });
  v.json("left_out", JsonValue::array_of(summary.left_out));
  v.object("pixels", [&](SummaryTree& pixels) {
    pixels({"used"}, summary.fit.samples);
    pixels({"no_reading"}, summary.no_reading);
    pixels({"off_plane"}, summary.off_plane);
  });
  v({"before_rms_m", {}, "{:.2f} mm", 1e3}, test.before_rms_m);
  v({"after_rms_m", {}, "{:.2f} mm", 1e3}, test.after_rms_m);
  v({"train_before_rms_m", {}, "{:.2f} mm", 1e3}, train.before_rms_m);
  v({"train_after_rms_m", {}, "{:.2f} mm", 1e3}, train.after_rms_m);
  v.list("distances", summary.by_distance);
  v.group("raw_disparity", summary.raw);
  v.group("refined", summary.refinement);
  v.object("model", [&](SummaryTree& m) {
    m({"mode"}, kDepthFitModeNames[static_cast<std::size_t>(model.mode)]);
    m({"columns"}, model.columns);
    m({"rows"}, model.rows);
    m({"terms"}, model.terms);
    m({"min_depth_m", {}, "{:.2f}"}, model.min_depth_m);
    m({"max_depth_m", {}, "{:.2f} m"}, model.max_depth_m);
    m({"largest_m", {}, "{:.1f} mm", 1e3}, largest_correction_m(model));
    m({"covered_ratio", {}, "{:.0f} %", 100}, summary.fit.fitted_pixel_ratio);
  });
  v.list("test_poses", summary.test);
  v.list("train_poses", summary.train);
}

std::string to_text(const DepthCalibrationSummary& summary) {
  const SummaryTree tree = describe(summary);
  std::string text = tree.lines(
      {"{poses.train|pose} to train on, {poses.test} to test, {poses.left_out} left out",
       "correction: {model.mode}, trained from {model.min_depth_m} to {model.max_depth_m}, at most "
       "{model.largest_m}",
       "raw disparity d: depth = 1 / ({raw_disparity.offset_per_m} {raw_disparity.slope_per_m} d), "
       "{raw_disparity.published_ratio} times the published; boards off by {raw_disparity.before_rms_units}, "
       "fitted {raw_disparity.after_rms_units}"});
  if (const auto& raw = summary.raw)
    for (const auto& row : raw_table(*raw))
      if (!row[0].ends_with("(1/m)")) text += fmt::format("  {:36}{} +- {}\n", row[0], row[1], row[2]);
  text += tree.lines(
      {"cameras adjusted: corners from {refined.corners_before} to {refined.corners_after}, depth from "
       "{refined.depth_before} to {refined.depth_after} expected deviations",
       "test poses  distance   before    after    noise (RMS, mm)"});
  for (const DistanceError& error : summary.by_distance)
    text += describe(error).lines({"            {distance_m} {before_rms_m} {after_rms_m} [{noise_m}]"});
  const Totals test = totals(summary.test);
  return text +
         fmt::format("            all      {:8.2f} {:8.2f}\n", 1e3 * test.before_rms_m,
                     1e3 * test.after_rms_m) +
         output_lines(summary.outputs);
}

std::string to_html(const DepthCalibrationSummary& summary) {
  const Totals test = totals(summary.test);
  const SummaryTree tree = describe(summary);
  HtmlReport report("Correction of depth");
  const bool good = summary.warnings.empty() && test.after_rms_m < test.before_rms_m;
  report.set_verdict(
      good ? HtmlReport::Verdict::kGood : HtmlReport::Verdict::kDoubtful,
      *tree.sentence("On poses that were not used for the fit, the depth error goes from {before_rms_m} to "
                     "{after_rms_m}."));
  add_cards(report, tree,
            {{"before", "{before_rms_m}", "RMS, test poses"},
             {"after", "{after_rms_m}", "RMS, test poses"},
             {"trained up to", "{model.max_depth_m}", "from {model.min_depth_m} m; {poses.train|pose}"}});
  if (!summary.warnings.empty()) {
    report.begin_section("Warnings");
    report.add_list(summary.warnings);
  }
  if (summary.raw) add_raw(report, *summary.raw);
  report.begin_section("Error against distance",
                       "Depth against the plane that the colour camera saw, over the pixels of the board.");
  report.add_svg(rms_plot(summary),
                 summary.has_test_folder ? "Poses of the folder test." : "Poses that were held out.");
  add_maps(report, summary.fit.model);
  report.begin_section("Test poses");
  add_list_table(report, tree, "test_poses");
  return report.html();
}

}  // namespace hm
