#include "hm/pipeline/laser/laser_map_frame.hpp"

#include <algorithm>

#include "hm/core/stopwatch.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/file_name.hpp"
#include "hm/io/map/occupancy_grid_file.hpp"

namespace hm {
namespace {

constexpr double kLeastChange = 1e-9;  // m and rad: less is rounding

Result<OccupancyGrid2D> read_slice(const std::filesystem::path& path, const LaserRunParams& params) {
  const auto map = read_mvog(path);
  if (!map) return forward_error(map);
  return laser_slice(*map, params);
}

bool has_walls(const OccupancyGrid2D& grid) {
  for (int y = 0; y < grid.cells.height(); ++y)
    for (int x = 0; x < grid.cells.width(); ++x)
      if (grid.state(x, y) == Occupancy::kOccupied) return true;
  return false;
}

/// The file with the map in a folder of a run; the path itself when it is no folder.
std::filesystem::path map_file_of(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::is_directory(path, code)) return path;
  for (const char* name : {"map.yaml", "map.mvog"})
    if (std::filesystem::exists(path / name, code)) return path / name;
  return path;
}

}  // namespace

LaserMapFrame LaserMapFrame::from_loops(const LaserMapFrameParams& params, LoopThread thread) {
  LaserMapFrame frame;
  frame.loops_ = std::make_unique<LiveLaserLoopCloser>(params.loops, thread);
  return frame;
}

LaserMapFrame LaserMapFrame::from_saved_map(const OccupancyGrid2D& grid, const LaserMapFrameParams& params) {
  LaserMapFrame frame;
  frame.localiser_ = std::make_unique<GridLocaliser>(grid, params.localiser);
  frame.seek_interval_ = Duration::from_seconds(params.seek_interval_s);
  return frame;
}

MapFrameSource LaserMapFrame::source() const {
  if (loops_) return MapFrameSource::kLoops;
  return localiser_ ? MapFrameSource::kSavedMap : MapFrameSource::kOdometry;
}

MapFrameStep LaserMapFrame::process(const PlanarScan& scan, const OdometryStep& step, double height_m) {
  const Stopwatch watch;
  MapFrameStep result;
  if (step.T_odom_base && loops_) {
    loops_->add(scan, step, height_m);
    note(scan.stamp, loops_->T_map_odom());
  }
  if (step.T_odom_base && localiser_) {
    result.localisation = localise(scan, *step.T_odom_base);
    if (result.localisation && result.localisation->T_map_base)
      note(scan.stamp, *result.localisation->T_map_base * step.T_odom_base->inverse());
  }
  result.T_map_odom = T_map_odom_;
  result.ms = watch.milliseconds();
  return result;
}

/// A search of the whole map is dear: not with every scan.
std::optional<Localisation> LaserMapFrame::localise(const PlanarScan& scan, const SE2& T_odom_base) {
  if (!found_ && last_search_ && scan.stamp - *last_search_ < seek_interval_) return std::nullopt;
  last_search_ = scan.stamp;
  Localisation place = localiser_->process(scan, T_odom_last_.inverse() * T_odom_base);
  T_odom_last_ = T_odom_base;
  if (place.T_map_base)
    found_ = true;
  else if (place.status != LocalisationStatus::kMatchFailed &&
           place.status != LocalisationStatus::kTooFewPoints)
    found_ = false;
  return place;
}

void LaserMapFrame::note(Time stamp, const SE2& T_map_odom) {
  const bool first_fix = localiser_ && history_.empty();
  const Vec3 change = (T_map_odom_.inverse() * T_map_odom).vector();
  if (!first_fix && change.cwiseAbs().maxCoeff() < kLeastChange) return;
  T_map_odom_ = T_map_odom;
  history_.push_back({stamp, T_map_odom});
}

void LaserMapFrame::finish(const RunContext& run) {
  if (!loops_ || loops()->graph().size() == 0) return;
  loops_->finish(run);
  const ScanGraph2D& graph = loops()->graph();
  // A change that came after the last keyframe, from a thread of its own, is noted at the scan of that time.
  const Time last = graph.keyframe(graph.size() - 1).scan.stamp;
  note(history_.empty() ? last : std::max(last, history_.back().stamp), loops_->T_map_odom());
}

bool LaserMapFrame::corrects() const {
  if (!loops_) return !history_.empty();
  const ScanGraphStatistics& closed = loops()->graph().statistics();
  return closed.accepted > closed.removed || loops()->registration().registered > 0;
}

SE2 LaserMapFrame::T_map_odom_at(Time stamp, const SE2& T_odom_base) const {
  if (!corrects()) return {};
  if (loops_) {
    const auto T_map_base = loops()->graph().T_map_base(stamp, T_odom_base);
    return T_map_base ? *T_map_base * T_odom_base.inverse() : SE2();
  }
  const auto after = std::upper_bound(history_.begin(), history_.end(), stamp,
                                      [](Time t, const MapFrameChange& change) { return t < change.stamp; });
  return after == history_.begin() ? history_.front().T_map_odom : (after - 1)->T_map_odom;
}

Trajectory LaserMapFrame::corrected(const Trajectory& T_odom_base) const {
  if (!corrects()) return T_odom_base;
  Trajectory result;
  for (const StampedPose& pose : T_odom_base)
    result.push_back({pose.stamp, T_map_odom_at(pose.stamp, SE2::from_se3(pose.T_world_base)).to_se3() *
                                      pose.T_world_base});
  return result;
}

Result<OccupancyGrid2D> laser_slice(const MultiVolumeGrid& map, const LaserRunParams& params) {
  return plan_of(map, {params.slice_bottom_m, params.slice_top_m});
}

Result<OccupancyGrid2D> read_saved_laser_map(const std::filesystem::path& path,
                                             const LaserRunParams& params) {
  const auto file = map_file_of(path);
  std::error_code code;
  if (!std::filesystem::exists(file, code))
    return fail(ErrorCode::kNotFound, path.string(), "there is no such map");
  const std::string extension = lower_extension(file);
  const bool is_mvog = extension == ".mvog";
  if (!is_mvog && extension != ".yaml" && extension != ".yml")
    return fail(
        ErrorCode::kUnsupported, path.string(),
        "this is not a map to find a vehicle in: map.yaml, map.mvog, or a folder that `hm laser` wrote");
  auto grid = is_mvog ? read_slice(file, params) : read_occupancy_grid(file);
  if (!grid) return grid;
  if (!has_walls(*grid))
    return fail(ErrorCode::kInvalidValue, file.string(), "nothing in this map is occupied{}",
                is_mvog ? " between laser.slice_bottom_m and laser.slice_top_m" : "");
  return grid;
}

}  // namespace hm
