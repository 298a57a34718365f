#include "hm/pipeline/experiments/mobile/volume_experiments.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "hm/evaluation/depth_agreement.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/experiments/mobile/integration_run.hpp"
#include "hm/report/plot.hpp"

namespace hm {
namespace {

constexpr double kMegabyte = 1e6;
constexpr double kVoxelBytes = sizeof(TsdfVoxel) + sizeof(ColorVoxel);

PlotSeries over_scans(std::string name, const std::vector<double>& values) {
  PlotSeries series{std::move(name), {}, values};
  for (std::size_t i = 0; i < values.size(); ++i) series.x.push_back(static_cast<double>(i));
  return series;
}

// --- Fig. 4.21 ---

/// Volumes of this size that a camera with readings between two depths can see: those whose middle is in the
/// frustum, widened by half a diagonal. The published method examines all of these.
std::size_t volumes_in_frustum(const PinholeCamera& camera, double near_m, double far_m, double side_m) {
  const double half_m = side_m * std::sqrt(3.0) / 2;
  const Vec3 low = camera.unproject(Vec2(0, 0), 1),
             high = camera.unproject(Vec2(camera.width - 1, camera.height - 1), 1);
  const auto steps = [&](double m) { return static_cast<int>(std::ceil(m / side_m)) + 1; };
  std::size_t count = 0;
  for (int z = 0; z <= steps(far_m); ++z)
    for (int y = -steps(-low.y() * far_m); y <= steps(high.y() * far_m); ++y)
      for (int x = -steps(-low.x() * far_m); x <= steps(high.x() * far_m); ++x) {
        const Vec3 p = side_m * Vec3(x, y, z);
        const bool deep = p.z() > near_m - half_m && p.z() < far_m + half_m;
        const bool wide = p.x() > low.x() * p.z() - half_m && p.x() < high.x() * p.z() + half_m;
        count += deep && wide && p.y() > low.y() * p.z() - half_m && p.y() < high.y() * p.z() + half_m;
      }
  return count;
}

/// A setting of which volumes are counted.
struct VolumeSetting {
  double voxel_m;
  bool carving, dynamic_truncation;
};
constexpr VolumeSetting kVolumeSettings[] = {
    {0.02, true, true}, {0.03, true, true}, {0.03, false, true}, {0.03, true, false}, {0.05, true, true}};

std::string words_of(const VolumeSetting& setting) {
  return fmt::format("{:.0f} cm{}{}", 100 * setting.voxel_m, setting.carving ? "" : ", no carving",
                     setting.dynamic_truncation ? "" : ", fixed truncation");
}

/// Smallest and largest reading of a frame within the limit; the second is 0 where there is none.
std::pair<double, double> depth_range(const DepthImage& depth, double far_m) {
  double low = far_m, high = 0;
  for (const std::uint16_t units : depth.units.pixels()) {
    const double z = units * depth.unit_m;
    if (units == 0 || z > far_m) continue;
    low = std::min(low, z), high = std::max(high, z);
  }
  return {low, high};
}

// --- Fig. 4.22 ---

/// Memory after each scan of a run, megabytes.
struct MemoryCourse {
  std::string name;
  double published_hashed_mb, published_fixed_mb;
  std::vector<double> hashed_mb, fixed_mb;
};

/// Memory that an array over the whole bounding box takes.
double fixed_grid_mb(const VolumeGrid& grid) {
  const Box3 box = grid.bounds();
  if (box.isEmpty()) return 0;
  return box.volume() / std::pow(grid.voxel_size_m(), 3) * kVoxelBytes / kMegabyte;
}

Result<void> follow_memory(const ExperimentFrames& frames, const TsdfParams& params, const DepthNoise& noise,
                           const ExperimentOptions& options, MemoryCourse& course) {
  const ParallelLoop loop(options.run.threads);
  IntegrationRun run(course.name, params, noise, frames.source->camera(), loop);
  return for_each_frame(frames, options.run, [&](const RgbdFrame& frame) -> Result<void> {
    run.integrate(frame);
    course.hashed_mb.push_back(static_cast<double>(run.grid().unpacked_bytes()) / kMegabyte);
    course.fixed_mb.push_back(fixed_grid_mb(run.grid()));
    return {};
  });
}

/// The frames of the corridor's walk until it is this long.
int frames_of_walk(const SimulationParams& scene, double length_m) {
  const Simulation simulation(scene);
  double walked_m = 0;
  for (std::size_t i = 1; i < simulation.frame_count(); ++i) {
    walked_m += (simulation.true_pose(i).translation() - simulation.true_pose(i - 1).translation()).norm();
    if (walked_m > length_m) return static_cast<int>(i);
  }
  return static_cast<int>(simulation.frame_count());
}

/// The desk, or the simulated room where the recording is absent.
Result<ExperimentFrames> desk_frames(const ExperimentOptions& options, ExperimentFindings& findings) {
  const auto path = options.data / "rgbd" / "tum_fr1_xyz";
  const int most = options.tiny ? 5 : 300;
  std::error_code code;
  if (!options.data.empty() && std::filesystem::is_directory(path, code)) return recorded_frames(path, most);
  findings.warnings.emplace_back("the recording rgbd/tum_fr1_xyz is absent: a simulated room instead");
  SimulationParams scene = options.parameters.simulation;
  scene.world = WorldKind::kRoom;
  scene.sensor = SensorPreset::kKinect;
  return simulated_frames(scene, most, options.run.threads);
}

void add_memory_rows(const MemoryCourse& course, std::vector<ExperimentRow>& rows) {
  rows.push_back({course.name + ": hashed grid", course.published_hashed_mb, course.hashed_mb.back(), "MB"});
  rows.push_back({course.name + ": fixed grid", course.published_fixed_mb, course.fixed_mb.back(), "MB"});
  rows.push_back({course.name + ": fixed / hashed", course.published_fixed_mb / course.published_hashed_mb,
                  course.fixed_mb.back() / course.hashed_mb.back(), "times"});
}

// --- Fig. 4.20 ---

/// A mapped desk.
struct MappedDesk {
  std::vector<double> scan_ms, mesh_ms;
  double map_mb = 0, near_m = 0, far_m = 0;
  SE3 T_world_middle;  ///< of the frame in the middle
  TriangleMesh mesh;
};

Result<MappedDesk> map_desk(const ExperimentFrames& frames, const ExperimentOptions& options) {
  DenseParams params;
  params.tsdf.voxel_size_m = options.tiny ? 0.04 : 0.02;
  MappedDesk desk;
  desk.near_m = params.tsdf.near_m, desk.far_m = params.tsdf.far_m;
  DensePipeline pipeline(params, frames.source->camera(), options.run.threads);
  auto done = for_each_frame(frames, options.run, [&](const RgbdFrame& frame) -> Result<void> {
    const FrameOutcome outcome = pipeline.process(frame);
    if (!outcome.integrated) return {};
    desk.scan_ms.push_back(outcome.scan.total_ms), desk.mesh_ms.push_back(outcome.mesh_ms);
    if (desk.scan_ms.size() <= frames.count / 2) desk.T_world_middle = outcome.T_world_camera;
    return {};
  });
  if (!done) return forward_error(done);
  desk.map_mb = static_cast<double>(pipeline.grid().unpacked_bytes()) / kMegabyte;
  desk.mesh = pipeline.take_finished_mesh();
  return desk;
}

/// Readings of some frames against the mesh.
Result<DepthAgreement> agreement_with_depth(const MappedDesk& desk, const ExperimentFrames& frames,
                                            const ParallelLoop& loop) {
  constexpr std::size_t kFrames = 20;
  const auto caster = DepthCaster::build(desk.mesh);
  if (!caster) return forward_error(caster);
  DepthAgreement agreement(desk.near_m, desk.far_m);
  for (std::size_t i = 0; i < frames.count; i += std::max<std::size_t>(1, frames.count / kFrames)) {
    const auto frame = frames.source->read(i);
    if (!frame || !frame->T_world_camera) continue;
    std::vector<float> measured_m;
    for (const std::uint16_t units : frame->depth.units.pixels())
      measured_m.push_back(static_cast<float>(units * frame->depth.unit_m));
    agreement.add(measured_m, caster->render(frames.source->camera(), *frame->T_world_camera, loop).pixels());
  }
  return agreement;
}

}  // namespace

Result<ExperimentFindings> run_affected_volumes_experiment(const ExperimentOptions& options) {
  SimulationParams scene = options.parameters.simulation;
  scene.world = WorldKind::kHouse;
  scene.sensor = SensorPreset::kTangoTablet;
  const ExperimentFrames frames = simulated_frames(scene, options.tiny ? 6 : 400, options.run.threads);
  const ParallelLoop loop(options.run.threads);
  const SensorModel& sensor = frames.simulation->sensor();
  ExperimentFindings findings;
  std::vector<PlotSeries> plots;
  for (const VolumeSetting& setting : kVolumeSettings) {
    TsdfParams params;
    params.voxel_size_m = setting.voxel_m;
    params.carving = setting.carving;
    params.dynamic_truncation = setting.dynamic_truncation;
    IntegrationRun run(words_of(setting), params, sensor.noise, sensor.camera, loop);
    std::vector<double> affected, in_frustum;
    const auto done = for_each_frame(frames, options.run, [&](const RgbdFrame& frame) -> Result<void> {
      affected.push_back(static_cast<double>(run.integrate(frame).changed.size()));
      const auto [near_m, far_m] = depth_range(frame.depth, params.far_m);
      in_frustum.push_back(static_cast<double>(
          volumes_in_frustum(sensor.camera, near_m, far_m, setting.voxel_m * kVolumeSide)));
      return {};
    });
    if (!done) return forward_error(done);
    const Summary changed = summarise(affected), frustum = summarise(in_frustum);
    findings.rows.push_back({run.name() + ": volumes changed by a scan, mean", {}, changed.mean, ""});
    findings.rows.push_back({run.name() + ": the same, at most", {}, changed.max, ""});
    findings.rows.push_back({run.name() + ": share of the volumes in the frustum",
                             {},
                             100 * changed.mean / std::max(1.0, frustum.mean),
                             "%"});
    plots.push_back(over_scans(run.name(), affected));
  }
  PlotOptions plot;
  plot.title = frames.words;
  plot.x.label = "scan";
  plot.y.label = "volumes changed";
  findings.add_figures = [svg = plot_svg(plots, plot)](HtmlReport& report) {
    report.begin_section("Volumes that a scan changes",
                         "Volumes of 8 x 8 x 8 voxels; the published ones are of 16 x 16 x 16. The number "
                         "follows the surface in view, not the frustum.");
    report.add_svg(svg, "By size of voxels, carving and truncation.");
  };
  return findings;
}

Result<ExperimentFindings> run_map_memory_experiment(const ExperimentOptions& options) {
  ExperimentFindings findings;
  std::vector<MemoryCourse> courses{{"corridor of 15 m, 3 cm", 47, 300, {}, {}},
                                    {"desk, 2 cm, up to 5 m", 700, 2000, {}, {}},
                                    {"desk, 2 cm, up to 2 m", 50, 300, {}, {}}};
  SimulationParams scene = options.parameters.simulation;
  scene.world = WorldKind::kCorridor;
  scene.sensor = SensorPreset::kTangoTablet;
  const ExperimentFrames corridor =
      simulated_frames(scene, options.tiny ? 5 : frames_of_walk(scene, 15), options.run.threads);
  TsdfParams params;
  params.voxel_size_m = 0.03;
  const DepthNoise& tablet = corridor.simulation->sensor().noise;
  if (auto done = follow_memory(corridor, params, tablet, options, courses[0]); !done)
    return forward_error(done);
  const auto desk = desk_frames(options, findings);
  if (!desk) return forward_error(desk);
  params.voxel_size_m = 0.02;
  params.far_m = 5;
  if (auto done = follow_memory(*desk, params, {}, options, courses[1]); !done) return forward_error(done);
  params.far_m = 2;
  if (auto done = follow_memory(*desk, params, {}, options, courses[2]); !done) return forward_error(done);
  std::vector<std::string> plots;
  for (const MemoryCourse& course : courses) {
    if (course.hashed_mb.empty())
      return fail(ErrorCode::kInvalidValue, {}, "no frame of {} can be read", course.name);
    add_memory_rows(course, findings.rows);
    PlotOptions plot;
    plot.title = course.name;
    plot.x.label = "scan";
    plot.y = {"memory (MB)", AxisScale::kLog, 0, 0};
    const PlotSeries series[] = {over_scans("fixed grid", course.fixed_mb),
                                 over_scans("hashed grid", course.hashed_mb)};
    plots.push_back(plot_svg(series, plot));
  }
  findings.add_figures = [plots, words = desk->words](HtmlReport& report) {
    report.begin_section("Memory of the map",
                         fmt::format("Corridor: simulated tablet. Desk: {}. The published desk is a larger "
                                     "one, of 12 x 12 m.",
                                     words));
    for (const std::string& plot : plots) report.add_svg(plot, "Logarithmic.");
  };
  return findings;
}

Result<ExperimentFindings> run_desk_experiment(const ExperimentOptions& options) {
  ExperimentFindings findings;
  const auto frames = desk_frames(options, findings);
  if (!frames) return forward_error(frames);
  const auto desk = map_desk(*frames, options);
  if (!desk) return forward_error(desk);
  const ParallelLoop loop(options.run.threads);
  const auto agreement = agreement_with_depth(*desk, *frames, loop);
  if (!agreement) return forward_error(agreement);
  findings.rows = {{"frames", {}, static_cast<double>(desk->scan_ms.size()), ""},
                   {"readings that meet the mesh", {}, 100 * agreement->covered_ratio(), "%"},
                   {"distance of a reading from the mesh, median", {}, agreement->total().median_mm, "mm"},
                   {"time of a scan, mean", {}, summarise(desk->scan_ms).mean, "ms"},
                   {"time of meshing after a scan, mean", {}, summarise(desk->mesh_ms).mean, "ms"},
                   {"memory of the map", {}, desk->map_mb, "MB"},
                   {"triangles", {}, static_cast<double>(desk->mesh.triangles.size()), ""}};
  RenderOptions size;
  size.width = options.tiny ? 120 : 900, size.height = size.width * 3 / 4;
  std::vector<Figure> figures;
  for (const auto& [style, name, words] :
       {std::tuple{RenderStyle::kColor, "colour", "In colour, from a camera of the recording."},
        std::tuple{RenderStyle::kShaded, "shaded", "Its shape."}}) {
    size.style = style;
    figures.push_back({name, words,
                       render_mesh(desk->mesh, camera_view(desk->T_world_middle, size), size, loop),
                       HtmlReport::Place::kHalf});
  }
  findings.add_figures = [figures, words = frames->words](HtmlReport& report) {
    report.begin_section("The desk", words + ", poses as given.");
    for (const Figure& figure : figures) add_figure(report, figure);
  };
  return findings;
}

}  // namespace hm
