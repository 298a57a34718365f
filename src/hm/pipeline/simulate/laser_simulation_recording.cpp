#include "hm/pipeline/simulate/laser_simulation_recording.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/parallel.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/output_file.hpp"
#include "hm/io/laser/laser_rig_file.hpp"
#include "hm/io/mesh/mesh_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/rosbag/bag_writer.hpp"
#include "hm/pipeline/simulate/simulation_folder.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kScanBatch = 64;

ParamList list_of(LaserSimulationParams& params) {
  ParamList list;
  list.add("laser_simulation", params);
  return list;
}

Result<void> check_params(LaserSimulationParams params) {
  if (auto checked = list_of(params).check(); !checked) return checked;
  if (params.laser.range_min_m < params.laser.range_max_m) return {};
  return fail(ErrorCode::kUsage, "laser_simulation", "range_min_m = {} is not below range_max_m = {}",
              params.laser.range_min_m, params.laser.range_max_m);
}

std::string at_scan(std::size_t done, std::size_t count) {
  return fmt::format("at scan {} of {}", done, count);
}

/// Puts messages into a bag in the order in which they are received.
class FlightRecorder {
 public:
  FlightRecorder(const LaserSimulation& simulation, const fs::path& path)
      : bag_(path), imu_(simulation.imu()), odometry_(simulation.odometry()) {}

  void add(const Received<LaserScan>& scan) {
    catch_up(scan.at);
    bag_.write_scan({"/scan", "laser"}, scan.at, scan.measured);
  }
  Result<void> finish() {
    catch_up(Time{std::numeric_limits<std::int64_t>::max()});
    return bag_.finish();
  }
  [[nodiscard]] std::size_t imu_samples() const { return imu_.size(); }
  [[nodiscard]] std::size_t odometry_readings() const { return odometry_.size(); }

 private:
  void catch_up(Time now) {
    for (; next_imu_ < imu_.size() && imu_[next_imu_].at <= now; ++next_imu_)
      bag_.write_imu({"/imu", "imu"}, imu_[next_imu_].at, imu_[next_imu_].measured);
    for (; next_odometry_ < odometry_.size() && odometry_[next_odometry_].at <= now; ++next_odometry_) {
      const auto& [at, odometry] = odometry_[next_odometry_];
      bag_.write_odometry(
          {"/odom", "odom", "base"}, at,
          {odometry.pose, odometry.linear_velocity_base_m_s, odometry.angular_velocity_base_rad_s});
    }
  }

  BagWriter bag_;
  std::vector<Received<ImuSample>> imu_;
  std::vector<Received<WheelOdometry>> odometry_;
  std::size_t next_imu_ = 0, next_odometry_ = 0;
};

/// The readings among the beams that are not hidden.
struct BeamCount {
  std::size_t read = 0, all = 0;
  void add(const LaserScan& scan) {
    for (std::size_t i = 0; i < scan.size(); ++i) {
      all += !std::isnan(scan.ranges_m[i]);
      read += scan.is_return(i);
    }
  }
};

/// Casts scans in batches on all threads and records them.
Result<void> record(const LaserSimulation& simulation, const LaserSimulationOptions& options,
                    LaserSimulationSummary& summary) {
  const ParallelLoop loop(options.run.threads);
  const std::size_t count = simulation.scan_count();
  FlightRecorder recorder(simulation, options.output / "recording.bag");
  std::vector<Received<LaserScan>> batch;
  BeamCount beams;
  for (std::size_t begin = 0; begin < count; begin += kScanBatch) {
    if (options.run.progress) options.run.progress({"flying", begin, count, {}});
    if (auto go_on = check_not_stopped(options.run.stop, at_scan(begin, count)); !go_on) return go_on;
    batch.resize(std::min(kScanBatch, count - begin));
    loop.for_ranges(batch.size(), 1,
                    [&](std::size_t item, std::size_t) { batch[item] = simulation.scan(begin + item); });
    for (const Received<LaserScan>& scan : batch) {
      recorder.add(scan);
      beams.add(scan.measured);
    }
  }
  summary.scans = count;
  summary.imu_samples = recorder.imu_samples();
  summary.odometry_readings = recorder.odometry_readings();
  summary.valid_ratio =
      static_cast<double>(beams.read) / static_cast<double>(std::max<std::size_t>(1, beams.all));
  return recorder.finish();
}

std::string floor_text(const std::vector<HeightTruth>& heights) {
  std::string text =
      "# stamp height_m floor_m ceiling_m: the base, the surface below and the one above it, over z = 0\n";
  for (const HeightTruth& h : heights)
    text += fmt::format("{}.{:09} {:.9f} {:.9f} {:.9f}\n", h.stamp.ns / 1'000'000'000,
                        h.stamp.ns % 1'000'000'000, h.base_m, h.floor_m, h.ceiling_m);
  return text;
}

Result<void> write_truth(const LaserSimulation& simulation, const fs::path& folder,
                         LaserSimulationSummary& summary) {
  const Trajectory truth = simulation.truth();
  const std::vector<HeightTruth> heights = simulation.heights();
  summary.duration_s = (truth.back().stamp - truth.front().stamp).seconds();
  summary.path_length_m = path_length(truth);
  for (const StampedPose& pose : truth)
    summary.max_tilt_rad =
        std::max(summary.max_tilt_rad, std::acos(std::clamp(pose.T_world_base.rotation()(2, 2), -1.0, 1.0)));
  for (const HeightTruth& h : heights) summary.highest_floor_m = std::max(summary.highest_floor_m, h.floor_m);
  if (auto written = write_tum_trajectory(folder / "groundtruth.txt", truth); !written) return written;
  if (auto written = write_file_text(folder / "truth_floor.txt", floor_text(heights)); !written)
    return written;
  if (auto written = write_laser_rig(folder / "rig.toml", simulation.rig()); !written) return written;
  return write_mesh(folder / "truth_mesh.ply", merged_mesh(simulation.world()));
}

Result<LaserSimulationSummary> write_all(const LaserSimulation& simulation,
                                         const LaserSimulationOptions& options) {
  LaserSimulationSummary summary;
  if (auto recorded = record(simulation, options, summary); !recorded) return forward_error(recorded);
  if (options.run.progress) options.run.progress({"writing the truth", 0, 0, {}});
  if (auto written = write_truth(simulation, options.output, summary); !written)
    return forward_error(written);
  if (auto go_on = check_not_stopped(options.run.stop, at_scan(summary.scans, summary.scans)); !go_on)
    return forward_error(go_on);
  summary.outputs = {options.output};
  for (const char* name :
       {"recording.bag", "rig.toml", "groundtruth.txt", "truth_floor.txt", "truth_mesh.ply"})
    summary.outputs.push_back(options.output / name);
  return summary;
}

}  // namespace

Result<LaserSimulationSummary> simulate_laser_recording(const LaserSimulationOptions& options) {
  if (auto checked = check_params(options.params); !checked) return forward_error(checked);
  const Stopwatch watch;
  const auto folder = SimulationFolder::acquire(options.output);
  if (!folder) return forward_error(folder);
  if (auto free = make_simulation_folder(options.output); !free) return forward_error(free);
  LaserSimulationParams params = options.params;
  if (const auto marked = folder->mark(list_of(params).to_toml()); !marked) return forward_error(marked);
  auto summary = folder->finish(as_run_failure(write_all(LaserSimulation(options.params), options)));
  if (summary) summary->wall_s = watch.seconds();
  return summary;
}

}  // namespace hm
