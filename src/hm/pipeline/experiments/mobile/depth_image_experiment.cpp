#include "hm/pipeline/experiments/mobile/depth_image_experiment.hpp"

#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/pipeline/experiments/common/experiment_frames.hpp"
#include "hm/report/mesh_figures.hpp"
#include "hm/report/plot.hpp"

namespace hm {
namespace {

constexpr double kBand_m = 0.5;
constexpr std::size_t kBands = 10;

/// Readings of a device against the truth.
struct DeviceReadings {
  std::size_t pixels = 0, readings = 0;
  std::vector<std::vector<double>> errors_m =
      std::vector<std::vector<double>>(kBands);  ///< absolute, by depth

  void add(const DepthImage& depth, const Image<float>& truth_m) {
    constexpr int kStep_px = 3;
    for (int y = 0; y < depth.height(); y += kStep_px)
      for (int x = 0; x < depth.width(); x += kStep_px) {
        ++pixels;
        if (depth.units(x, y) == 0) continue;
        ++readings;
        const auto true_m = static_cast<double>(truth_m(x, y));
        const auto band = static_cast<std::size_t>(true_m / kBand_m);
        if (true_m > 0 && band < kBands) errors_m[band].push_back(std::abs(depth.depth_m(x, y) - true_m));
      }
  }
  /// NaN: no reading there.
  [[nodiscard]] double median_m(std::size_t band) const {
    return errors_m[band].empty() ? std::nan("") : quantile(errors_m[band], 0.5);
  }
};

constexpr SensorPreset kComparedDevices[] = {SensorPreset::kTangoPhone, SensorPreset::kTangoTablet,
                                             SensorPreset::kKinect};

/// Depth images of a device at places spread over the walk; the one in the middle is drawn.
Result<DeviceReadings> read_device(SensorPreset preset, const Simulation& simulation,
                                   const ExperimentOptions& options, std::vector<Figure>& figures) {
  constexpr double kFar_m = 5;
  const SensorModel sensor = sensor_model(preset);
  const Renderer renderer(simulation.world());
  const ParallelLoop loop(options.run.threads);
  const std::size_t views = options.tiny ? 2 : 40;
  DeviceReadings device;
  for (std::size_t i = 0; i < views; ++i) {
    if (options.run.stop.stop_requested())
      return fail(ErrorCode::kCancelled, {}, "stopped among depth images");
    const SE3 pose = simulation.true_pose((2 * i + 1) * simulation.frame_count() / (2 * views));
    const RenderedView view = renderer.render(sensor.camera, pose, loop);
    Rng rng(static_cast<std::uint64_t>(simulation.params().seed), i);
    const DepthImage depth = sense_depth(sensor, simulation.params().effects, view, rng);
    device.add(depth, view.depth_m);
    const std::string name(kSensorPresetNames[static_cast<int>(preset)]);
    if (i == views / 2) figures.push_back({name, name, draw_depth(depth, kFar_m), HtmlReport::Place::kHalf});
  }
  return device;
}

void add_device_rows(const std::string& name, const DeviceReadings& device,
                     std::vector<ExperimentRow>& rows) {
  constexpr double kCm = 100;
  rows.push_back({name + ": pixels with a reading",
                  {},
                  100 * static_cast<double>(device.readings) / static_cast<double>(device.pixels),
                  "%"});
  rows.push_back({name + ": depth off at 1 to 1.5 m, median", {}, kCm * device.median_m(2), "cm"});
  rows.push_back({name + ": depth off at 2.5 to 3 m, median", {}, kCm * device.median_m(5), "cm"});
}

}  // namespace

Result<ExperimentFindings> run_depth_image_experiment(const ExperimentOptions& options) {
  constexpr double kCm = 100;
  SimulationParams scene = options.parameters.simulation;
  scene.world = WorldKind::kHouse;
  scene.sensor = SensorPreset::kTangoTablet;
  const Simulation simulation(scene);
  ExperimentFindings findings;
  std::vector<Figure> figures;
  std::vector<PlotSeries> errors;
  for (const SensorPreset preset : kComparedDevices) {
    const auto device = read_device(preset, simulation, options, figures);
    if (!device) return forward_error(device);
    const std::string name(kSensorPresetNames[static_cast<int>(preset)]);
    add_device_rows(name, *device, findings.rows);
    errors.push_back({name, {}, {}});
    for (std::size_t band = 0; band < kBands; ++band) {
      errors.back().x.push_back((static_cast<double>(band) + 0.5) * kBand_m);
      errors.back().y.push_back(kCm * device->median_m(band));
    }
  }
  PlotOptions plot;
  plot.x.label = "depth (m)", plot.y = {"depth off, median (cm)", AxisScale::kLog, 0, 0};
  findings.add_figures = [figures, svg = plot_svg(errors, plot)](HtmlReport& report) {
    report.begin_section("One view", "Depth, dark near and light far; white: no reading.");
    for (const Figure& figure : figures) add_figure(report, figure);
    report.begin_section("Error by depth", "Bias and noise together; logarithmic.");
    report.add_svg(svg, "The median is that of surfaces, not of steps of depth.");
  };
  return findings;
}

}  // namespace hm
