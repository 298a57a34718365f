#include "hm/pipeline/experiments/laser/grid_experiments.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include "hm/core/stopwatch.hpp"
#include "hm/io/map/octomap_file.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/mvog/published_mvog.hpp"
#include "hm/pipeline/experiments/laser/grid_scans.hpp"
#include "hm/report/map_figures.hpp"
#include "hm/report/plot.hpp"

namespace hm {
namespace {

constexpr double kKilobyte = 1e3;

/// Both grids of some scans, and how they grew.
struct GrownGrids {
  double resolution_m;
  MultiVolumeGrid grid;
  PublishedMvog published;
  std::vector<double> grid_kb, published_kb, scans;  ///< now and then
  double grid_us_per_beam = 0, published_us_per_beam = 0;

  explicit GrownGrids(double resolution)
      : resolution_m(resolution),
        grid(MvogParams{.resolution_m = resolution}),
        published(PublishedMvogParams{.resolution_m = resolution}) {}
};

void note_size(std::size_t scans, GrownGrids& grown) {
  grown.scans.push_back(static_cast<double>(scans));
  grown.grid_kb.push_back(static_cast<double>(grown.grid.bytes()) / kKilobyte);
  grown.published_kb.push_back(static_cast<double>(grown.published.size().bytes_published) / kKilobyte);
}

/// Inserts all scans; `at` is called after each.
void grow(const GridScans& scans, GrownGrids& grown, const std::function<void(std::size_t scan)>& at = {}) {
  double grid_s = 0, published_s = 0;
  const std::size_t step = std::max<std::size_t>(1, scans.scans.size() / 25);
  for (std::size_t i = 0; i < scans.scans.size(); ++i) {
    const GridScan& scan = scans.scans[i];
    const double begin_s = thread_cpu_s();
    grown.grid.insert(scan.p_world_points, scan.p_world_origin);
    const double middle_s = thread_cpu_s();
    grown.published.insert({scan.p_world_origin, scan.p_world_points, {}});
    grid_s += middle_s - begin_s, published_s += thread_cpu_s() - middle_s;
    if ((i + 1) % step == 0 || i + 1 == scans.scans.size()) note_size(i + 1, grown);
    if (at) at(i);
  }
  const double beams = static_cast<double>(std::max<std::size_t>(1, scans.beams()));
  grown.grid_us_per_beam = 1e6 * grid_s / beams, grown.published_us_per_beam = 1e6 * published_s / beams;
}

/// Shares of the beams of a scan that a map, made of other scans, calls right: of end points that are known
/// those that are occupied, and of points at 20, 40, 60 and 80 % of a beam those that are free.
struct HeldOutScans {
  std::size_t ends = 0, ends_occupied = 0, passed = 0, passed_free = 0;

  template <class StateAt>
  void add(const GridScan& scan, const StateAt& state_at) {
    for (const Eigen::Vector3f& point : scan.p_world_points) {
      const Vec3 end = point.cast<double>();
      const Occupancy state = state_at(end);
      ends += state != Occupancy::kUnknown, ends_occupied += state == Occupancy::kOccupied;
      for (const double share : {0.2, 0.4, 0.6, 0.8}) {
        const Occupancy on_beam = state_at(scan.p_world_origin + share * (end - scan.p_world_origin));
        passed += on_beam != Occupancy::kUnknown, passed_free += on_beam == Occupancy::kFree;
      }
    }
  }
  [[nodiscard]] double occupied_percent() const {
    return 100 * static_cast<double>(ends_occupied) / static_cast<double>(std::max<std::size_t>(1, ends));
  }
  [[nodiscard]] double free_percent() const {
    return 100 * static_cast<double>(passed_free) / static_cast<double>(std::max<std::size_t>(1, passed));
  }
};

/// Maps of every second scan, judged by the others.
void add_held_out_rows(const GridScans& scans, std::vector<ExperimentRow>& rows) {
  GrownGrids half(0.10);
  for (std::size_t i = 0; i < scans.scans.size(); ++i) {
    const GridScan& scan = scans.scans[i];
    if (i / 2 % 2 != 0) continue;  // left and right scans alternate
    half.grid.insert(scan.p_world_points, scan.p_world_origin);
    half.published.insert({scan.p_world_origin, scan.p_world_points, {}});
  }
  HeldOutScans grid, published;
  for (std::size_t i = 0; i < scans.scans.size(); ++i) {
    if (i / 2 % 2 == 0) continue;
    grid.add(scans.scans[i], [&](const Vec3& p) { return half.grid.at(p); });
    published.add(scans.scans[i], [&](const Vec3& p) { return half.published.at(p); });
  }
  rows.push_back({"scans left out, grid: end points occupied", {}, grid.occupied_percent(), "%"});
  rows.push_back({"scans left out, grid: points on beams free", {}, grid.free_percent(), "%"});
  rows.push_back(
      {"scans left out, published structure: end points occupied", {}, published.occupied_percent(), "%"});
  rows.push_back(
      {"scans left out, published structure: points on beams free", {}, published.free_percent(), "%"});
}

Result<void> add_size_rows(const GridScans& scans, const GrownGrids& grown, const ExperimentOptions& options,
                           std::vector<ExperimentRow>& rows) {
  const auto name = fmt::format("{:.2f} m: ", grown.resolution_m);
  const Box3 box = grown.grid.bounds();
  const double dense_kb = box.isEmpty() ? 0 : box.volume() / std::pow(grown.resolution_m, 3) / kKilobyte;
  const auto octree = options.output / fmt::format("grid_{:.0f}cm.bt", 100 * grown.resolution_m);
  if (auto written = write_octomap(octree, grown.grid.voxels(), grown.resolution_m); !written) return written;
  std::error_code code;
  const auto octree_bytes = std::filesystem::file_size(octree, code);
  const PublishedMvog::Size published = grown.published.size();
  const MvogSize size = grown.grid.size();
  rows.push_back({name + "grid, in memory", {}, static_cast<double>(size.bytes) / kKilobyte, "kB"});
  rows.push_back(
      {name + "grid, as a file", {}, static_cast<double>(grown.grid.serialise().size()) / kKilobyte, "kB"});
  rows.push_back({name + "octree with the same voxels, as a file",
                  {},
                  static_cast<double>(octree_bytes) / kKilobyte,
                  "kB"});
  rows.push_back({name + "published structure (12 B a volume, 20 B a cell)",
                  {},
                  static_cast<double>(published.bytes_published) / kKilobyte,
                  "kB"});
  rows.push_back({name + "dense array of 1 B a cell", {}, dense_kb, "kB"});
  rows.push_back({name + "volumes, positive and negative",
                  {},
                  static_cast<double>(size.volumes_positive + size.volumes_negative),
                  ""});
  rows.push_back({name + "the same of the published structure",
                  {},
                  static_cast<double>(published.positive + published.negative),
                  ""});
  rows.push_back({name + "time of a beam, grid", {}, grown.grid_us_per_beam, "us"});
  rows.push_back({name + "time of a beam, published structure", {}, grown.published_us_per_beam, "us"});
  rows.push_back({name + "beams", {}, static_cast<double>(scans.beams()), ""});
  return {};
}

std::string size_plot(const GrownGrids& grown) {
  const PlotSeries series[] = {{"grid, in memory", grown.scans, grown.grid_kb},
                               {"published structure", grown.scans, grown.published_kb}};
  PlotOptions plot;
  plot.title = fmt::format("cells of {:.2f} m", grown.resolution_m);
  plot.x.label = "scans", plot.y.label = "size (kB)";
  return plot_svg(series, plot);
}

/// The map seen from above after a third, two thirds and all of the scans.
void add_stage(const GrownGrids& grown, std::size_t scans, std::vector<Figure>& figures) {
  if (auto image = draw_heights(grown.grid.voxels(), grown.resolution_m))
    figures.push_back({fmt::format("stage_{}", scans),
                       fmt::format("After {} scans: highest occupied voxel, coloured by height.", scans),
                       std::move(*image), HtmlReport::Place::kHalf});
}

/// Plans of the map between heights above its floor.
Result<void> add_plans(const GrownGrids& grown, std::vector<Figure>& figures) {
  const double floor_m = grown.grid.bounds().min().z();
  for (const auto& [low_m, high_m] :
       {std::pair{0.3, 0.8}, std::pair{0.8, 1.3}, std::pair{1.3, 1.8}, std::pair{1.8, 2.3}}) {
    const auto plan = grown.grid.slice(floor_m + low_m, floor_m + high_m);
    if (!plan) return forward_error(plan);
    if (auto image = draw_occupancy_grid(*plan, {}))
      figures.push_back({fmt::format("plan_{:.0f}", 10 * low_m),
                         fmt::format("{:.1f} to {:.1f} m above the lowest point: occupied dark, free light.",
                                     low_m, high_m),
                         std::move(*image), HtmlReport::Place::kHalf});
  }
  return {};
}

}  // namespace

Result<ExperimentFindings> run_grid_experiment(const ExperimentOptions& options) {
  ExperimentFindings findings;
  const std::size_t most = options.tiny ? 40 : 100'000;
  const auto path = options.data / "laser" / "ncd_QuadTree_Alog.alog";
  std::error_code code;
  GridScans scans;
  if (!options.data.empty() && std::filesystem::is_regular_file(path, code)) {
    auto recorded = recorded_grid_scans(path, most);
    if (!recorded) return forward_error(recorded);
    scans = std::move(*recorded);
  } else {
    findings.warnings.emplace_back(
        "the recording laser/ncd_QuadTree_Alog.alog is absent: simulated lasers instead");
    scans = simulated_grid_scans(WorldKind::kHouse, options.tiny ? most : 2000,
                                 static_cast<std::uint64_t>(options.parameters.simulation.seed));
  }
  std::vector<Figure> stages, plans;
  std::vector<std::string> plots;
  for (const double resolution_m : {0.05, 0.10, 0.20}) {
    GrownGrids grown(resolution_m);
    const bool drawn = resolution_m == 0.10;
    grow(scans, grown, [&](std::size_t scan) {
      const std::size_t count = scans.scans.size();
      if (drawn && ((scan + 1) % std::max<std::size_t>(1, count / 3) == 0))
        add_stage(grown, scan + 1, stages);
    });
    if (auto added = add_size_rows(scans, grown, options, findings.rows); !added) return forward_error(added);
    findings.outputs.push_back(options.output / fmt::format("grid_{:.0f}cm.bt", 100 * resolution_m));
    if (drawn)
      if (auto added = add_plans(grown, plans); !added) return forward_error(added);
    plots.push_back(size_plot(grown));
  }
  add_held_out_rows(scans, findings.rows);
  findings.add_figures = [stages, plans, plots, words = scans.words](HtmlReport& report) {
    report.begin_section("Stages of the map", words + ", cells of 0.10 m.");
    for (const Figure& figure : stages) add_figure(report, figure);
    report.begin_section("Plans at several heights");
    for (const Figure& figure : plans) add_figure(report, figure);
    report.begin_section("Size", "The published structure is counted as on its 32-bit processor.");
    for (const std::string& plot : plots) report.add_svg(plot, "Size over the scans.");
  };
  return findings;
}

Result<ExperimentFindings> run_hallway_grid_experiment(const ExperimentOptions& options) {
  const GridScans scans =
      simulated_grid_scans(WorldKind::kCorridor, options.tiny ? 40 : 1000,
                           static_cast<std::uint64_t>(options.parameters.simulation.seed));
  GrownGrids grown(0.10);
  grow(scans, grown);
  ExperimentFindings findings;
  if (auto added = add_size_rows(scans, grown, options, findings.rows); !added) return forward_error(added);
  findings.outputs.push_back(options.output / "grid_10cm.bt");
  add_held_out_rows(scans, findings.rows);
  std::vector<Figure> figures;
  if (auto added = add_plans(grown, figures); !added) return forward_error(added);
  findings.add_figures = [figures, plot = size_plot(grown), words = scans.words](HtmlReport& report) {
    report.begin_section("Plans", words);
    for (const Figure& figure : figures) add_figure(report, figure);
    report.begin_section("Size");
    report.add_svg(plot, "Size over the scans.");
  };
  return findings;
}

}  // namespace hm
