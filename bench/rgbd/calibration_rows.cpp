// Rows about calibration: a simulated Xtion from pictures to a corrected depth, and the time of the
// correction.
#include <algorithm>
#include <cmath>

#include "hm/core/angle.hpp"
#include "hm/core/rng.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/depth_camera/frame_calibration.hpp"
#include "hm/io/camera/calibration_file.hpp"
#include "hm/io/testing/temporary_folder_test_support.hpp"
#include "hm/pipeline/calibrate/calibration_depth.hpp"
#include "hm/pipeline/calibrate/calibration_extrinsics.hpp"
#include "hm/pipeline/calibrate/calibration_intrinsics.hpp"
#include "hm/pipeline/calibrate/calibration_simulation.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

namespace fs = std::filesystem;

/// Everything that `hm calibrate` does, one after the other, on a set in `folder`.
Result<DepthCalibrationSummary> calibrate_all(const fs::path& folder, const BoardParams& large,
                                              const RunContext& run) {
  const fs::path set = folder / "set";
  for (const CalibratedCamera camera : {CalibratedCamera::kColor, CalibratedCamera::kDepth}) {
    const bool color = camera == CalibratedCamera::kColor;
    IntrinsicsOptions options{set / (color ? "color" : "ir"),
                              color ? fs::path() : folder / "color",
                              folder / (color ? "color" : "both"),
                              camera,
                              {},
                              {},
                              run};
    if (auto board = read_board_of(options.images, options.board); !board) return forward_error(board);
    if (auto done = calibrate_intrinsics(options); !done) return forward_error(done);
  }
  ExtrinsicsOptions rig{
      set / "stereo/ir", set / "stereo/color", folder / "both", folder / "rig", {}, {}, run};
  if (auto board = read_board_of(rig.depth_images, rig.board); !board) return forward_error(board);
  if (auto done = calibrate_extrinsics(rig); !done) return forward_error(done);
  DepthCalibrationOptions depth{
      set / "depth", folder / "rig", folder / "corrected", DepthImages::kDepth, 1000, large, {}, run};
  return calibrate_depth(depth);
}

double worst_percent(const PinholeCamera& a, const PinholeCamera& b) {
  return 100 * std::max({std::abs(a.fx / b.fx - 1), std::abs(a.fy / b.fy - 1), std::abs(a.cx / b.cx - 1),
                         std::abs(a.cy / b.cy - 1)});
}

/// Milliseconds of one VGA frame: the fastest of many.
template <class Work>
double fastest_ms(int rounds, Work&& work) {
  double best = 1e9;
  for (int i = 0; i < rounds; ++i) {
    const Stopwatch watch;
    work();
    best = std::min(best, watch.milliseconds());
  }
  return best;
}

/// Readings at random over metres, which no camera delivers: no two neighbours go to neighbouring places.
DepthImage scattered_depth() {
  Rng rng(1);
  DepthImage depth{Image<std::uint16_t>(640, 480), 1e-3};
  for (auto& units : depth.units.pixels())
    units = static_cast<std::uint16_t>(rng.below(10) == 0 ? 0 : 800 + rng.below(3500));
  return depth;
}

/// Readings of the rig's depth camera where an ideal one, of the same place and focal length, reads `ideal`.
DepthImage raw_depth(const CalibrationRig& rig, const DepthImage& ideal, Rng& rng) {
  DepthImage raw{Image<std::uint16_t>(ideal.width(), ideal.height()), rig.depth_unit_m};
  const PinholeCamera straight = rig.depth_camera.without_distortion();
  for (int y = 0; y < raw.height(); ++y)
    for (int x = 0; x < raw.width(); ++x) {
      const Vec2 at = straight.project(rig.depth_camera.unproject(Vec2(x, y), 1.0));
      const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
      const bool is_dropped = rng.uniform() < rig.dropout_ratio;
      if (is_dropped || !ideal.units.contains(u, v) || ideal.units(u, v) == 0) continue;
      const double z_m = ideal.units(u, v) * ideal.unit_m;
      raw.units(x, y) = static_cast<std::uint16_t>(
          std::lround((z_m + simulated_warp_m(rig, Vec2(x, y), z_m)) / raw.unit_m));
    }
  return raw;
}

/// Frames of the rig's depth camera on a walk through the house: noise, quantisation, warp and holes.
std::vector<DepthImage> rendered_depth(const CalibrationRig& rig) {
  constexpr std::size_t kFrames = 8;
  SimulationParams params;
  params.sensor = SensorPreset::kKinect;
  const Simulation simulation(params);
  const Renderer renderer(simulation.world());
  SensorModel sensor = simulation.sensor();
  sensor.camera = rig.depth_camera.without_distortion();
  sensor.noise = rig.noise;
  sensor.min_depth_m = rig.min_depth_m, sensor.max_depth_m = rig.max_depth_m;
  Rng rng(1);
  std::vector<DepthImage> frames;
  for (std::size_t i = 0; i < kFrames; ++i) {
    const SE3 T_world_camera = simulation.true_pose(i * simulation.frame_count() / kFrames);
    const RenderedView view = renderer.render(sensor.camera, T_world_camera, ParallelLoop());
    frames.push_back(raw_depth(rig, sense_depth(sensor, params.effects, view, rng), rng));
  }
  return frames;
}

JsonValue distances_json(const DepthCalibrationSummary& summary) {
  auto list = JsonValue::array();
  for (const DistanceError& error : summary.by_distance)
    list.push_back(JsonValue::object({{"distance_m", error.distance_m},
                                      {"before_mm", 1e3 * error.before_rms_m},
                                      {"after_mm", 1e3 * error.after_rms_m},
                                      {"noise_mm", 1e3 * error.noise_m}}));
  return list;
}

void add_times(const RgbdCalibration& calibration, const CalibrationRig& rig, int rounds,
               BenchResult& result) {
  const DepthCorrection correction(*calibration.depth_correction, 640, 480);
  DepthImage depth = scattered_depth();
  result.rows.push_back(
      {"depth_correction_time", fastest_ms(50 * rounds, [&] { correction.apply(depth); }), std::nullopt});
  const auto frames = FrameCalibration::make(calibration, 640, 480);
  HM_CHECK(frames.has_value(), "{}", frames.error().message);
  const auto chain_ms = [&](const DepthImage& raw) {
    return fastest_ms(50 * rounds, [&] { (void)frames->calibrate(raw); });
  };
  double sum_ms = 0;
  auto each = JsonValue::array();
  const std::vector<DepthImage> rendered = rendered_depth(rig);
  for (const DepthImage& raw : rendered) {
    const double ms = chain_ms(raw);
    const auto holes = std::ranges::count(raw.units.pixels(), std::uint16_t{0});
    each.push_back(JsonValue::object(
        {{"ms", ms}, {"holes_ratio", static_cast<double>(holes) / (raw.width() * raw.height())}}));
    sum_ms += ms;
  }
  result.rows.push_back({"depth_chain_time", sum_ms / static_cast<double>(rendered.size()), std::nullopt});
  result.details["depth_chain_frames"] = each;
}

}  // namespace

Result<BenchResult> bench_depth_calibration(const BenchOptions& options) {
  const TemporaryFolder folder;
  CalibrationSimulationOptions simulation;
  simulation.output = folder / "set";
  simulation.params.depth_images = 30;
  if (options.frame_limit > 0) simulation.params.depth_images = options.frame_limit;
  RunContext run;
  run.threads = options.threads;
  if (auto made = simulate_calibration(simulation); !made) return forward_error(made);
  const auto summary = calibrate_all(folder.path(), simulation.board, run);
  if (!summary) return forward_error(summary);
  const CalibrationRig truth = rig_of(simulation.params);
  const RgbdCalibration& found = summary->calibration;

  double worst = 0, before_3m = 0, after_3m = 0, samples_3m = 0;
  for (const DistanceError& error : summary->by_distance) {
    const double sigma = truth.noise.sigma_m(error.distance_m) / std::sqrt(simulation.params.depth_images);
    worst = std::max(worst, error.after_rms_m / (1.2 * sigma + 1e-3));
    if (std::abs(error.distance_m - 3) > 0.5) continue;
    const auto n = static_cast<double>(error.samples);
    before_3m += n * error.before_rms_m * error.before_rms_m;
    after_3m += n * error.after_rms_m * error.after_rms_m;
    samples_3m += n;
  }
  const SE3 off = truth.T_color_depth.inverse() * *found.T_color_depth;
  BenchResult result;
  result.rows = {
      {"depth_calibration", worst, std::nullopt},
      {"depth_calibration_3m", 1e3 * std::sqrt(after_3m / samples_3m),
       1e3 * std::sqrt(before_3m / samples_3m)},
      {"depth_calibration_intrinsics",
       std::max(worst_percent(*found.color_camera, truth.color_camera),
                worst_percent(*found.depth_camera, truth.depth_camera)),
       std::nullopt},
      {"depth_calibration_translation",
       1e3 * (found.T_color_depth->translation() - truth.T_color_depth.translation()).norm(), std::nullopt},
      {"depth_calibration_rotation", off.angle() * kDegreesPerRadian, std::nullopt}};
  add_times(found, truth, options.rounds, result);
  result.details["spline"] = distances_json(*summary);
  for (const DepthFitMode mode : {DepthFitMode::kQuadratic, DepthFitMode::kQuadraticZero,
                                  DepthFitMode::kLinear, DepthFitMode::kLinearZero}) {
    DepthCalibrationOptions depth{folder / "set" / "depth",
                                  folder / "rig",
                                  folder / "thesis",
                                  DepthImages::kDepth,
                                  1000,
                                  simulation.board,
                                  {},
                                  run};
    depth.fit.mode = mode;
    const auto thesis = calibrate_depth(depth);
    if (thesis) result.details[kDepthFitModeNames[static_cast<std::size_t>(mode)]] = distances_json(*thesis);
  }
  return result;
}

}  // namespace hm::bench
