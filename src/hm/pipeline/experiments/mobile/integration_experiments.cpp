#include "hm/pipeline/experiments/mobile/integration_experiments.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "hm/core/stopwatch.hpp"
#include "hm/mesh/incremental_mesher.hpp"
#include "hm/pipeline/experiments/mobile/integration_run.hpp"
#include "hm/report/plot.hpp"
#include "hm/sim/sensor/renderer.hpp"

namespace hm {
namespace {

constexpr double kTangoVoxel_m = 0.03;  // of the published runs

/// A method of integration with its options, as a row of the tables.
struct ScanMethod {
  IntegrationMethod method;
  bool color, carving;
};

std::string name_of(const ScanMethod& m) {
  return fmt::format("{}{}{}", kIntegrationMethodNames[static_cast<std::size_t>(m.method)],
                     m.color ? ", colour" : "", m.carving ? ", carving" : "");
}

TsdfParams params_of(const ScanMethod& m, const SensorModel& sensor) {
  TsdfParams params;
  params.voxel_size_m = kTangoVoxel_m;
  params.method = m.method;
  params.color = m.color;
  params.carving = m.carving;
  params.far_m = std::min(params.far_m, sensor.max_depth_m);
  return params;
}

// --- Fig. 4.19, Table 4.1 ---

/// Somebody who walks about in front of the camera: a box of the size of a person on an ellipse, mixed into
/// the depth images. Nothing of it belongs into a map.
class Walker {
 public:
  explicit Walker(const Simulation& simulation) : simulation_(simulation) {
    constexpr std::array<float, 3> kHalf_m{0.22F, 0.15F, 0.85F};
    WorldPart part;
    for (unsigned corner = 0; corner < 8; ++corner)
      part.mesh.vertices.emplace_back(corner & 1U ? kHalf_m[0] : -kHalf_m[0],
                                      corner & 2U ? kHalf_m[1] : -kHalf_m[1],
                                      corner & 4U ? 2 * kHalf_m[2] : 0.0F);
    part.mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                           {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    world_.parts.push_back(std::move(part));
    renderer_.emplace(world_);
    const Box3 box = bounds(simulation.world());
    middle_ = (box.min() + box.max()) / 2;
    radius_ = 0.3 * (box.max() - box.min());
  }

  /// Puts the person into the frame, where it stands at that time.
  void enter(RgbdFrame& frame, Rng& rng, const ParallelLoop& loop) const {
    constexpr double kPeriod_s = 20;  // about 0.5 m/s
    const double angle = 2 * std::numbers::pi * (frame.stamp - simulation_.stamp(0)).seconds() / kPeriod_s;
    const Vec3 at(middle_.x() + radius_.x() * std::cos(angle), middle_.y() + radius_.y() * std::sin(angle),
                  0);
    const SE3 T_person_camera = SE3(Mat3::Identity(), -at) * *frame.T_world_camera;
    const SensorModel& sensor = simulation_.sensor();
    const DepthImage seen = sense_depth(sensor, simulation_.params().effects,
                                        renderer_->render(sensor.camera, T_person_camera, loop), rng);
    for (int y = 0; y < seen.height(); ++y)
      for (int x = 0; x < seen.width(); ++x) {
        const double z_m = seen.depth_m(x, y), scene_m = frame.depth.depth_m(x, y);
        if (z_m <= 0 || (scene_m > 0 && scene_m < z_m)) continue;
        frame.depth.units(x, y) = static_cast<std::uint16_t>(std::lround(z_m / frame.depth.unit_m));
        if (!frame.color.empty()) frame.color(x, y) = {200, 60, 40};
      }
  }

 private:
  const Simulation& simulation_;
  World world_;
  std::optional<Renderer> renderer_;
  Vec3 middle_ = Vec3::Zero(), radius_ = Vec3::Zero();
};

/// A map of Fig. 4.19 against the truth.
struct MethodQuality {
  MeshError error;
  double far_ratio = 0;  ///< share of the surface farther than 5 cm from the true one
  double color_levels = 0, scan_ms = 0;
};

Result<MethodQuality> quality_of(const IntegrationRun& run, const TriangleMesh& mesh,
                                 const ExperimentFrames& frames, const TrueSurface& truth,
                                 const ExperimentOptions& options) {
  constexpr float kFar_m = 0.05F;
  const ParallelLoop loop(options.run.threads);
  MeshErrorParams params;
  params.samples = options.tiny ? 30'000 : 300'000;
  auto error = evaluate_mesh(mesh, truth.mesh, params, loop, truth.visible);
  if (!error) return forward_error(error);
  MethodQuality quality;
  const auto& distances = error->accuracy.signed_distances_m;
  const auto far = std::ranges::count_if(distances, [](float d) { return std::abs(d) > kFar_m; });
  quality.far_ratio =
      static_cast<double>(far) / static_cast<double>(std::max<std::size_t>(1, distances.size()));
  quality.error = std::move(*error);
  ColorDifference difference(mesh, frames.source->camera());
  const std::size_t step = std::max<std::size_t>(1, frames.count / 20);
  for (std::size_t i = 0; i < frames.count; i += step)
    if (const auto frame = frames.source->read(i)) difference.add(*frame);
  quality.color_levels = difference.mean_levels();
  quality.scan_ms = summarise(run.scan_ms()).mean;
  return quality;
}

void add_quality_rows(const std::string& name, const MethodQuality& quality,
                      std::vector<ExperimentRow>& rows) {
  constexpr double kMm = 1e3, kPercent = 100;
  rows.push_back({name + ": distance from the true surface, median",
                  {},
                  kMm * quality.error.accuracy.distance_m.median,
                  "mm"});
  rows.push_back(
      {name + ": surface farther than 5 cm from the true one", {}, kPercent * quality.far_ratio, "%"});
  rows.push_back({name + ": true surface reconstructed within 2 cm",
                  {},
                  kPercent * quality.error.completeness.ratio,
                  "%"});
  rows.push_back({name + ": colour off by", {}, quality.color_levels, "levels"});
  rows.push_back({name + ": time of a scan", {}, quality.scan_ms, "ms"});
}

// --- Tables 4.2, 4.3 ---

/// Published times of a scan on the tablet, ms: the room of the RSS 2015 paper (481 scans, 3 cm, 16^3
/// volumes), which is nearest to Table 4.2.
struct TimedMethod {
  ScanMethod method;
  double published_tablet_ms;
};
constexpr TimedMethod kTimedMethods[] = {{{IntegrationMethod::kTraversal, false, false}, 62.5},
                                         {{IntegrationMethod::kTraversal, true, false}, 79.9},
                                         {{IntegrationMethod::kTraversal, false, true}, 184.1},
                                         {{IntegrationMethod::kTraversal, true, true}, 199.9},
                                         {{IntegrationMethod::kProjection, false, false}, 105.9},
                                         {{IntegrationMethod::kProjection, true, false}, 124.8},
                                         {{IntegrationMethod::kProjection, false, true}, 115.6},
                                         {{IntegrationMethod::kProjection, true, true}, 128.5}};
constexpr double kPublishedTabletMesh_ms = 102.9;

struct DeviceTimes {
  std::vector<IntegrationRun> runs;  ///< in the order of kTimedMethods
  std::vector<double> mesh_ms;       ///< of what the last method changed
  std::string words;
};

Result<DeviceTimes> time_device(SensorPreset preset, const ExperimentOptions& options,
                                const ParallelLoop& one_thread) {
  SimulationParams scene = options.parameters.simulation;
  scene.world = options.tiny ? WorldKind::kRoom : WorldKind::kHouse;
  scene.sensor = preset;
  const ExperimentFrames frames = simulated_frames(scene, options.tiny ? 3 : 200, options.run.threads);
  DeviceTimes times;
  times.words = frames.words;
  const SensorModel& sensor = frames.simulation->sensor();
  for (const TimedMethod& timed : kTimedMethods)
    times.runs.emplace_back(name_of(timed.method), params_of(timed.method, sensor), sensor.noise,
                            sensor.camera, one_thread);
  IncrementalMesher mesher({}, one_thread);
  const auto done = for_each_frame(frames, options.run, [&](const RgbdFrame& frame) -> Result<void> {
    ScanStats last;
    for (IntegrationRun& run : times.runs) last = run.integrate(frame);
    const double begin_s = thread_cpu_s();
    mesher.mark_changed(last.changed);
    mesher.update(times.runs.back().grid());
    times.mesh_ms.push_back(1e3 * (thread_cpu_s() - begin_s));
    return {};
  });
  if (!done) return forward_error(done);
  return times;
}

void add_time_rows(const DeviceTimes& times, bool is_tablet, std::vector<ExperimentRow>& rows) {
  const char* device = is_tablet ? "tablet" : "phone";
  const auto published = [&](double ms) { return is_tablet ? std::optional(ms) : std::nullopt; };
  for (std::size_t i = 0; i < times.runs.size(); ++i)
    rows.push_back({fmt::format("{}: {}", device, times.runs[i].name()),
                    published(kTimedMethods[i].published_tablet_ms), summarise(times.runs[i].scan_ms()).mean,
                    "ms"});
  rows.push_back({fmt::format("{}: mesh of what changed", device), published(kPublishedTabletMesh_ms),
                  summarise(times.mesh_ms).mean, "ms"});
}

std::string time_plot(const DeviceTimes& times) {
  std::vector<PlotSeries> series;
  for (const IntegrationRun& run : times.runs) {
    PlotSeries one{run.name(), {}, run.scan_ms()};
    for (std::size_t i = 0; i < one.y.size(); ++i) one.x.push_back(static_cast<double>(i));
    series.push_back(std::move(one));
  }
  PlotOptions plot;
  plot.title = times.words;
  plot.x.label = "scan";
  plot.y = {"time (ms)", AxisScale::kLog, 0, 0};
  plot.height_px = 380;
  return plot_svg(series, plot);
}

}  // namespace

Result<ExperimentFindings> run_integration_experiment(const ExperimentOptions& options) {
  SimulationParams scene = options.parameters.simulation;
  scene.world = WorldKind::kRoom;
  scene.sensor = SensorPreset::kTangoTablet;
  const ExperimentFrames frames = simulated_frames(scene, options.tiny ? 10 : 100'000, options.run.threads);
  const ParallelLoop loop(options.run.threads), one_thread(1);
  const SensorModel& sensor = frames.simulation->sensor();
  std::vector<IntegrationRun> runs;
  for (const IntegrationMethod method : {IntegrationMethod::kTraversal, IntegrationMethod::kProjection})
    for (const bool carving : {false, true}) {
      const ScanMethod one{method, true, carving};
      runs.emplace_back(name_of(one), params_of(one, sensor), sensor.noise, sensor.camera, one_thread);
    }
  const Walker walker(*frames.simulation);
  Rng rng(static_cast<std::uint64_t>(scene.seed), 77);
  const auto done = for_each_frame(frames, options.run, [&](const RgbdFrame& given) -> Result<void> {
    RgbdFrame frame = given;
    walker.enter(frame, rng, loop);
    for (IntegrationRun& run : runs) run.integrate(frame);
    return {};
  });
  if (!done) return forward_error(done);
  ExperimentFindings findings;
  const TrueSurface truth = true_surface(*frames.simulation, loop);
  std::vector<TriangleMesh> meshes;
  for (const IntegrationRun& run : runs) {
    meshes.push_back(run.mesh(loop));
    const auto quality = quality_of(run, meshes.back(), frames, truth, options);
    if (!quality) return forward_error(quality);
    add_quality_rows(run.name(), *quality, findings.rows);
  }
  std::vector<CaptionedMesh> captioned;
  for (std::size_t i = 0; i < runs.size(); ++i)
    captioned.push_back({fmt::format("method_{}", i), runs[i].name(), &meshes[i]});
  const auto figures = draw_side_by_side(captioned, RenderStyle::kColor, options.tiny ? 120 : 900, loop);
  findings.add_figures = [figures, words = frames.words](HtmlReport& report) {
    report.begin_section(
        "Maps by method",
        words + "; somebody (a red box of 1.7 m) walks about in it and belongs into no map.");
    for (const Figure& figure : figures) add_figure(report, figure);
  };
  return findings;
}

Result<ExperimentFindings> run_scan_time_experiment(const ExperimentOptions& options) {
  const ParallelLoop one_thread(1);
  ExperimentFindings findings;
  std::vector<std::string> plots;
  for (const SensorPreset preset : {SensorPreset::kTangoTablet, SensorPreset::kTangoPhone}) {
    const auto times = time_device(preset, options, one_thread);
    if (!times) return forward_error(times);
    add_time_rows(*times, preset == SensorPreset::kTangoTablet, findings.rows);
    plots.push_back(time_plot(*times));
  }
  findings.add_figures = [plots](HtmlReport& report) {
    report.begin_section("Time of each scan",
                         "One thread, processor time, voxels of 3 cm. The published times are those of the "
                         "tablet's processor (RSS 2015); those of the phone are not known.");
    for (const std::string& plot : plots) report.add_svg(plot, "Logarithmic.");
  };
  return findings;
}

}  // namespace hm
