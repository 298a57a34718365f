#include "hm/pipeline/experiments/rgbd/depth_bias_experiment.hpp"

#include <algorithm>
#include <cmath>

#include "hm/io/image/image_file.hpp"
#include "hm/pipeline/calibrate/calibration_figures.hpp"
#include "hm/pipeline/experiments/common/experiment_frames.hpp"
#include "hm/report/mesh_figures.hpp"
#include "hm/report/plot.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

/// Bias of depth over the whole image at a true depth, RMS, before and after the correction.
struct ImageBias {
  double before_m = 0, after_m = 0, largest_m = 0;
};

ImageBias image_bias(const CalibratedBoards& boards, double depth_m) {
  constexpr int kStep_px = 8;
  const DepthCorrectionModel& model = *boards.summary.calibration.depth_correction;
  const PinholeCamera& raw = boards.rig.depth_camera;
  const PinholeCamera straight = raw.without_distortion();
  ImageBias bias;
  double count = 0;
  for (int y = kStep_px / 2; y < raw.height; y += kStep_px)
    for (int x = kStep_px / 2; x < raw.width; x += kStep_px) {
      const Vec2 rectified = straight.project(raw.unproject(Vec2(x, y), depth_m));
      const double warp_m = simulated_warp_m(boards.rig, Vec2(x, y), depth_m);
      const double left_m = warp_m + model.correction_m(rectified, depth_m + warp_m);
      bias.before_m += warp_m * warp_m, bias.after_m += left_m * left_m;
      bias.largest_m = std::max(bias.largest_m, std::abs(warp_m));
      ++count;
    }
  bias.before_m = std::sqrt(bias.before_m / count), bias.after_m = std::sqrt(bias.after_m / count);
  return bias;
}

void add_bias_rows(const CalibratedBoards& boards, bool is_phone, std::vector<ExperimentRow>& rows) {
  constexpr double kMm = 1e3, kCm = 100, kPublishedPhone_cm = 30;
  for (const DistanceError& error : boards.summary.by_distance) {
    const auto name = fmt::format("boards near {:.2f} m: ", error.distance_m);
    rows.push_back({name + "RMS before", {}, kMm * error.before_rms_m, "mm"});
    rows.push_back({name + "RMS after", {}, kMm * error.after_rms_m, "mm"});
    rows.push_back({name + "noise of the averaged readings", {}, kMm * error.noise_m, "mm"});
  }
  for (const double depth_m : {1.5, 3.0}) {
    const ImageBias bias = image_bias(boards, depth_m);
    const auto name = fmt::format("bias over the image at {:.1f} m: ", depth_m);
    rows.push_back({name + "RMS before", {}, kMm * bias.before_m, "mm"});
    rows.push_back({name + "RMS after", {}, kMm * bias.after_m, "mm"});
    if (depth_m > 2)
      rows.push_back({name + "largest before", is_phone ? std::optional(kPublishedPhone_cm) : std::nullopt,
                      kCm * bias.largest_m, "cm"});
  }
}

/// The first depth image of each pose of a folder, each shrunk, in rows of seven.
Result<Image<Rgb8>> draw_training_set(const fs::path& folder, double far_m) {
  constexpr int kColumns = 7, kShrink = 4;
  std::vector<fs::path> poses;
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(folder, code)) poses.push_back(entry.path());
  if (code) return fail(ErrorCode::kNotFound, folder.string(), "cannot be listed");
  std::ranges::sort(poses);
  Image<Rgb8> sheet;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto units = read_depth_png(poses[i] / "depth_000.png");
    if (!units) return forward_error(units);
    const Image<Rgb8> one = draw_depth({*units, 1e-3}, far_m);
    const int width = one.width() / kShrink, height = one.height() / kShrink;
    const auto count = static_cast<int>(poses.size());
    if (sheet.empty())
      sheet = Image<Rgb8>(std::min(kColumns, count) * width, (count + kColumns - 1) / kColumns * height,
                          Rgb8{255, 255, 255});
    const int left = static_cast<int>(i) % kColumns * width, top = static_cast<int>(i) / kColumns * height;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) sheet(left + x, top + y) = one(x * kShrink, y * kShrink);
  }
  return sheet;
}

/// A wall at 3 m seen from above: the readings of the middle row, before and after the correction.
std::string wall_plot(const CalibratedBoards& boards) {
  constexpr double kWall_m = 3;
  const DepthCorrectionModel& model = *boards.summary.calibration.depth_correction;
  const PinholeCamera& raw = boards.rig.depth_camera;
  const PinholeCamera straight = raw.without_distortion();
  PlotSeries series[] = {{"as measured", {}, {}}, {"corrected", {}, {}}, {"wall", {}, {}}};
  for (int x = 0; x < raw.width; x += 4) {
    const Vec2 pixel(x, raw.height / 2.0);
    const Vec2 rectified = straight.project(raw.unproject(pixel, kWall_m));
    const double reading_m = kWall_m + simulated_warp_m(boards.rig, pixel, kWall_m);
    const double depths_m[] = {reading_m, reading_m + model.correction_m(rectified, reading_m), kWall_m};
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 p = straight.unproject(rectified, depths_m[i]);
      series[i].x.push_back(p.x()), series[i].y.push_back(p.z());
    }
  }
  PlotOptions plot;
  plot.x.label = "to the right (m)", plot.y.label = "away from the camera (m)";
  return plot_svg(series, plot);
}

std::string distance_plot(const DepthCalibrationSummary& summary) {
  PlotSeries series[] = {{"before", {}, {}}, {"after", {}, {}}, {"noise", {}, {}}};
  for (const DistanceError& error : summary.by_distance) {
    for (PlotSeries& one : series) one.x.push_back(error.distance_m);
    series[0].y.push_back(1e3 * error.before_rms_m), series[1].y.push_back(1e3 * error.after_rms_m);
    series[2].y.push_back(1e3 * error.noise_m);
  }
  PlotOptions plot;
  plot.x.label = "distance (m)", plot.y.label = "RMS error of depth (mm)";
  return plot_svg(series, plot);
}

Result<std::vector<Figure>> board_figures(const CalibratedBoards& boards) {
  constexpr auto kHalf = HtmlReport::Place::kHalf;
  constexpr double kFar_m = 5;
  const fs::path pair = boards.set / "train" / "000";
  auto color = read_color_image(pair / "color.png");
  if (!color) return forward_error(color);
  const auto units = read_depth_png(pair / "depth_000.png");
  if (!units) return forward_error(units);
  auto sheet = draw_training_set(boards.set / "train", kFar_m);
  if (!sheet) return forward_error(sheet);
  std::vector<Figure> figures{{"pair_color", "Training pair: colour.", std::move(*color), kHalf},
                              {"pair_depth", "Training pair: depth, dark near, light far.",
                               draw_depth({*units, 1e-3}, kFar_m), kHalf},
                              {"training", "All training poses, a depth image of each.", std::move(*sheet)}};
  const DepthCorrectionModel& model = *boards.summary.calibration.depth_correction;
  const double full_m = largest_correction_m(model);
  for (const double depth_m : {1.5, 3.0})
    figures.push_back({fmt::format("correction_{:.0f}", 10 * depth_m),
                       fmt::format("What is added to readings of {:.1f} m.", depth_m),
                       draw_correction(model, depth_m, full_m), kHalf});
  return figures;
}

Result<ExperimentFindings> run_bias(CalibrationSensor sensor, const ExperimentOptions& options) {
  auto boards = calibrate_boards(sensor, options);
  if (!boards) return forward_error(boards);
  auto figures = board_figures(*boards);
  if (!figures) return forward_error(figures);
  ExperimentFindings findings;
  findings.warnings = boards->summary.warnings;
  findings.outputs = {options.output / "boards", options.output / "calibration"};
  add_bias_rows(*boards, sensor == CalibrationSensor::kTangoPhone, findings.rows);
  findings.add_figures = [figures = std::move(*figures), wall = wall_plot(*boards),
                          distances = distance_plot(boards->summary)](HtmlReport& report) {
    report.begin_section("Boards and correction",
                         "Simulated; the whole calibration: calibration/report.html");
    for (const Figure& figure : figures) add_figure(report, figure);
    report.begin_section("A wall at 3 m from above",
                         "Without noise: what the bias makes of a straight wall.");
    report.add_svg(wall, "Readings of the middle row of the image.");
    report.begin_section("Error by distance", "Of boards that the fit did not see.");
    report.add_svg(distances, "RMS over the board; the noise of averaged readings is the lower limit.");
  };
  return findings;
}

}  // namespace

Result<CalibratedBoards> calibrate_boards(CalibrationSensor sensor, const ExperimentOptions& options) {
  CalibrationSimulationOptions simulated;
  simulated.params.sensor = sensor;
  simulated.params.seed = options.parameters.simulation.seed;
  simulated.params.camera_views = 3, simulated.params.stereo_views = 1;  // only depth is calibrated here
  simulated.params.depth_images = options.tiny ? 2 : 30;
  if (options.tiny) simulated.params.depth_steps = 3, simulated.params.test_steps = 2;
  simulated.output = options.output / "boards";
  simulated.run = options.run;
  if (auto made = simulate_calibration(simulated); !made) return forward_error(made);
  DepthCalibrationOptions depth;
  depth.set = simulated.output / "depth";
  depth.start = simulated.output / "truth";
  depth.output = options.output / "calibration";
  depth.board = simulated.board;
  depth.run = options.run;
  auto summary = calibrate_depth(depth);
  if (!summary) return forward_error(summary);
  return CalibratedBoards{rig_of(simulated.params), depth.set, std::move(*summary)};
}

Result<ExperimentFindings> run_depth_bias_experiment(const ExperimentOptions& options) {
  return run_bias(CalibrationSensor::kXtion, options);
}

Result<ExperimentFindings> run_phone_bias_experiment(const ExperimentOptions& options) {
  return run_bias(CalibrationSensor::kTangoPhone, options);
}

}  // namespace hm
