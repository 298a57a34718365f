// Rows mvog_*: the multi-volume grid and OctoMap over the same scans (New College, two vertical lasers).
#include <octomap/OcTree.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "dense/scene_frames.hpp"
#include "hm/core/rng.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/mvog/multi_volume_grid.hpp"
#include "hm/mvog/published_mvog.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr double kResolution = 0.10;
constexpr const char* kLog = "laser/ncd_QuadTree_Alog.alog";

/// The returns of one scan, as both sides take them.
struct WorldScan {
  Time stamp;
  bool even = false;  ///< by its place in its own laser's stream
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3f> points;
  octomap::Pointcloud cloud;
};

Result<std::vector<WorldScan>> load_scans() {
  const auto path = data_folder() / kLog;
  if (!std::filesystem::exists(path))
    return fail(ErrorCode::kNotFound, path.string(),
                "the recording is absent (HM_DATA names the folder of data)");
  const auto recording = open_laser_recording(path);
  if (!recording) return forward_error(recording);
  std::vector<WorldScan> scans;
  for (const LaserStream& laser : recording->lasers) {
    for (std::size_t i = 0; i < laser.scans.size(); ++i) {
      const LaserScan& scan = laser.scans[i];
      const auto T_world_base =
          pose_at(recording->odometry, scan.stamp, Duration::from_seconds(0.2), Duration::from_seconds(0.2));
      if (!T_world_base) continue;
      const SE3 T_world_laser = *T_world_base * laser.T_base_laser;
      WorldScan& to = scans.emplace_back();
      to.stamp = scan.stamp;
      to.even = i % 2 == 0;
      to.origin = T_world_laser.translation();
      for (std::size_t beam = 0; beam < scan.size(); ++beam) {
        if (!scan.is_return(beam)) continue;
        const double angle = scan.angle_rad(beam), range = static_cast<double>(scan.ranges_m[beam]);
        to.points.push_back(
            (T_world_laser * Vec3(range * std::cos(angle), range * std::sin(angle), 0)).cast<float>());
        to.cloud.push_back(to.points.back().x(), to.points.back().y(), to.points.back().z());
      }
    }
  }
  std::ranges::stable_sort(scans, {}, &WorldScan::stamp);
  return scans;
}

octomap::point3d point(const Eigen::Vector3d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

std::size_t beam_count(const std::vector<WorldScan>& scans) {
  std::size_t count = 0;
  for (const WorldScan& scan : scans) count += scan.points.size();
  return count;
}

/// Microseconds a beam, each scan with its fastest round; a new map each round, all in turn. OctoMap as it
/// comes, and with its inner nodes left stale until all scans are in: that tree cannot be pruned or looked at
/// from afar in between, but is the fastest that it can do.
struct UpdateTimes {
  double ours_us = 0, published_us = 0, octomap_us = 0, octomap_lazy_us = 0;
};
UpdateTimes measure_updates(const std::vector<WorldScan>& scans, int rounds) {
  std::array<std::vector<double>, 4> fastest;
  double catching_up_us = 1e9;
  fastest.fill(std::vector<double>(scans.size(), 1e9));
  for (int round = 0; round < rounds; ++round) {
    MultiVolumeGrid grid({.resolution_m = kResolution});
    PublishedMvog published({.resolution_m = kResolution});
    octomap::OcTree tree(kResolution), lazy(kResolution);
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const WorldScan& scan = scans[i];
      const auto timed = [&](std::size_t who, auto&& insert) {
        const Stopwatch watch;
        insert();
        fastest[who][i] = std::min(fastest[who][i], watch.seconds() * 1e6);
      };
      timed(0, [&] { grid.insert(scan.points, scan.origin); });
      timed(1, [&] { published.insert({scan.origin, scan.points, {}}); });
      timed(2, [&] { tree.insertPointCloud(scan.cloud, point(scan.origin)); });
      timed(3, [&] { lazy.insertPointCloud(scan.cloud, point(scan.origin), -1, true); });
    }
    const Stopwatch watch;
    lazy.updateInnerOccupancy();
    lazy.prune();
    catching_up_us = std::min(catching_up_us, watch.seconds() * 1e6);
  }
  const auto per_beam = [&](const std::vector<double>& times) {
    double sum = 0;
    for (const double time : times) sum += time;
    return sum / static_cast<double>(beam_count(scans));
  };
  fastest[3].push_back(catching_up_us);
  return {per_beam(fastest[0]), per_beam(fastest[1]), per_beam(fastest[2]), per_beam(fastest[3])};
}

/// Prediction of a map for scans that are not in it.
struct Holdout {
  std::array<std::size_t, 3> ends{}, free{};  ///< by Occupancy

  static double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }
  static double known(const std::array<std::size_t, 3>& n) {
    return percent(static_cast<double>(n[1] + n[2]), static_cast<double>(n[0] + n[1] + n[2]));
  }
  [[nodiscard]] double ends_occupied() const {
    return percent(static_cast<double>(ends[2]), static_cast<double>(ends[1] + ends[2]));
  }
  [[nodiscard]] double free_free() const {
    return percent(static_cast<double>(free[1]), static_cast<double>(free[1] + free[2]));
  }
  [[nodiscard]] JsonValue json() const {
    return JsonValue::object({{"ends_occupied_percent", ends_occupied()},
                              {"ends_known_percent", known(ends)},
                              {"free_free_percent", free_free()},
                              {"free_known_percent", known(free)}});
  }
};

/// End points should be occupied; points at 20, 40, 60 and 80 % of each beam free. Of those that are known.
template <class StateAt>
Holdout hold_out(const std::vector<WorldScan>& scans, StateAt&& state_at) {
  Holdout result;
  for (const WorldScan& scan : scans) {
    if (scan.even) continue;
    for (const Eigen::Vector3f& p : scan.points) {
      const Eigen::Vector3d end = p.cast<double>();
      ++result.ends[static_cast<std::size_t>(state_at(end))];
      for (const double share : {0.2, 0.4, 0.6, 0.8})
        ++result.free[static_cast<std::size_t>(state_at(scan.origin + share * (end - scan.origin)))];
    }
  }
  return result;
}

/// The hold-out test of all three maps, trained on even scans.
std::array<Holdout, 3> measure_holdout(const std::vector<WorldScan>& scans) {
  MultiVolumeGrid grid({.resolution_m = kResolution});
  PublishedMvog published({.resolution_m = kResolution});
  octomap::OcTree tree(kResolution);
  for (const WorldScan& scan : scans) {
    if (!scan.even) continue;
    grid.insert(scan.points, scan.origin);
    published.insert({scan.origin, scan.points, {}});
    tree.insertPointCloud(scan.cloud, point(scan.origin));
  }
  const auto in_tree = [&](const Eigen::Vector3d& p) {
    const auto* node = tree.search(point(p));
    return !node ? Occupancy::kUnknown : tree.isNodeOccupied(node) ? Occupancy::kOccupied : Occupancy::kFree;
  };
  return {hold_out(scans, [&](const Eigen::Vector3d& p) { return grid.at(p); }),
          hold_out(scans, [&](const Eigen::Vector3d& p) { return published.at(p); }),
          hold_out(scans, in_tree)};
}

/// Nanoseconds a point query; points of all beams in random order.
struct QueryTimes {
  double ours_ns = 1e9, octomap_ns = 1e9;
};
QueryTimes measure_queries(const MultiVolumeGrid& grid, const octomap::OcTree& tree,
                           const std::vector<WorldScan>& scans, int rounds) {
  std::vector<Eigen::Vector3d> points;
  for (const WorldScan& scan : scans)
    for (const Eigen::Vector3f& p : scan.points)
      points.push_back(scan.origin + 0.7 * (p.cast<double>() - scan.origin));
  Rng rng(1);
  for (std::size_t i = points.size(); i > 1; --i)
    std::swap(points[i - 1], points[rng.below(static_cast<std::uint32_t>(i))]);
  constexpr std::size_t kChunk = 1000;
  std::vector<double> ours(points.size() / kChunk, 1e9), theirs = ours;
  std::size_t occupied = 0;
  for (int round = 0; round < 2 * rounds; ++round) {
    for (std::size_t c = 0; c < ours.size(); ++c) {
      Stopwatch watch;
      for (std::size_t i = c * kChunk; i < (c + 1) * kChunk; ++i)
        occupied += grid.at(points[i]) == Occupancy::kOccupied;
      ours[c] = std::min(ours[c], watch.seconds());
      watch.restart();
      for (std::size_t i = c * kChunk; i < (c + 1) * kChunk; ++i)
        occupied += tree.search(point(points[i])) != nullptr;
      theirs[c] = std::min(theirs[c], watch.seconds());
    }
  }
  const auto mean = [&](const std::vector<double>& chunks) {
    double sum = 0;
    for (const double seconds : chunks) sum += seconds;
    return sum * 1e9 / static_cast<double>(chunks.size() * kChunk) + (occupied == 0 ? 1e9 : 0);
  };
  return {mean(ours), mean(theirs)};
}

}  // namespace

Result<BenchResult> bench_mvog(const BenchOptions& options) {
  auto scans = load_scans();
  if (!scans) return forward_error(scans);
  if (options.frame_limit > 0 && static_cast<std::size_t>(options.frame_limit) < scans->size())
    scans->resize(static_cast<std::size_t>(options.frame_limit));
  MultiVolumeGrid grid({.resolution_m = kResolution});
  PublishedMvog published({.resolution_m = kResolution});
  octomap::OcTree tree(kResolution);
  for (const WorldScan& scan : *scans) {
    grid.insert(scan.points, scan.origin);
    published.insert({scan.origin, scan.points, {}});
    tree.insertPointCloud(scan.cloud, point(scan.origin));
  }
  const MvogSize size = grid.size();
  const double tree_kb = static_cast<double>(tree.memoryUsage()) / 1e3,
               our_kb = static_cast<double>(size.bytes) / 1e3;
  const UpdateTimes times = measure_updates(*scans, options.rounds);
  const auto holdout = measure_holdout(*scans);
  const QueryTimes queries = measure_queries(grid, tree, *scans, options.rounds);
  const double unknown = std::max(Holdout::known(holdout[2].ends) - Holdout::known(holdout[0].ends),
                                  Holdout::known(holdout[2].free) - Holdout::known(holdout[0].free));
  BenchResult result;
  result.rows = {{"mvog_memory", our_kb, tree_kb},
                 {"mvog_memory_area", our_kb / size.area_m2, tree_kb / size.area_m2},
                 {"mvog_update", times.ours_us, times.octomap_us},
                 {"mvog_update_time", times.ours_us, times.octomap_us},
                 {"mvog_holdout", holdout[0].ends_occupied(), holdout[2].ends_occupied()},
                 {"mvog_holdout_free", holdout[0].free_free(), holdout[2].free_free()},
                 {"mvog_holdout_known", unknown, {}},
                 {"mvog_query", queries.ours_ns, queries.octomap_ns}};
  const PublishedMvog::Size published_size = published.size();
  result.details =
      JsonValue::object({{"scans", scans->size()},
                         {"beams", beam_count(*scans)},
                         {"area_m2", size.area_m2},
                         {"columns", size.columns},
                         {"runs", size.runs},
                         {"volumes_positive", size.volumes_positive},
                         {"volumes_negative", size.volumes_negative},
                         {"working_bytes", size.working_bytes},
                         {"holdout", holdout[0].json()},
                         {"holdout_octomap", holdout[2].json()},
                         {"holdout_published", holdout[1].json()},
                         {"published_us_per_beam", times.published_us},
                         {"octomap_lazy_us_per_beam", times.octomap_lazy_us},
                         {"published_volumes_positive", published_size.positive},
                         {"published_volumes_negative", published_size.negative},
                         {"published_kb", static_cast<double>(published_size.bytes_published) / 1e3}});
  return result;
}

}  // namespace hm::bench
