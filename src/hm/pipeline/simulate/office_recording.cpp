#include "hm/pipeline/simulate/office_recording.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "hm/io/laser/laser_rig_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/io/rosbag/bag_writer.hpp"
#include "hm/pipeline/simulate/simulation_folder.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kScansPerReport = 64;

std::string toml_of(const OfficeSimulationOptions& options) {
  return fmt::format(
      "[office_simulation]\nseed = {}\nwidth_m = {:g}\ndepth_m = {:g}\nrange_max_m = {:g}\n"
      "scan_every_m = {:g}\npeople = {}\nperfect = {}\nscan_limit = {}\n",
      options.seed, options.width_m, options.depth_m, options.range_max_m, options.scan_every_m,
      options.people, options.perfect, options.scan_limit);
}

Result<void> record(const OfficeSimulation& simulation, const OfficeRecordingOptions& options,
                    OfficeRecordingSummary& summary) {
  BagWriter bag(options.output / "recording.bag");
  std::size_t read = 0, beams = 0;
  const std::size_t count = simulation.scan_count();
  for (std::size_t i = 0; i < count; ++i) {
    if (i % kScansPerReport == 0 && options.run.progress) options.run.progress({"driving", i, count, {}});
    const std::string place = fmt::format("at scan {} of {}", i, count);
    if (auto go_on = check_not_stopped(options.run.stop, place); !go_on) return go_on;
    const LaserScan scan = simulation.scan(i);
    for (std::size_t beam = 0; beam < scan.size(); ++beam) read += scan.is_return(beam);
    beams += scan.size();
    bag.write_odometry({"/odom", "odom", "base"}, scan.stamp, {simulation.odometry()[i]});
    bag.write_scan({"/scan", "laser"}, scan.stamp, scan);
  }
  summary.valid_ratio = static_cast<double>(read) / static_cast<double>(std::max<std::size_t>(1, beams));
  return bag.finish();
}

Result<OfficeRecordingSummary> write_all(const OfficeRecordingOptions& options) {
  const OfficeSimulation simulation(options.simulation);
  const Trajectory& truth = simulation.truth();
  OfficeRecordingSummary summary;
  summary.scans = simulation.scan_count();
  summary.duration_s = (truth.back().stamp - truth.front().stamp).seconds();
  summary.path_length_m = path_length(truth);
  summary.wheel_path_length_m = path_length(simulation.odometry());
  if (auto recorded = record(simulation, options, summary); !recorded) return forward_error(recorded);
  if (auto written = write_tum_trajectory(options.output / "groundtruth.txt", truth); !written)
    return forward_error(written);
  if (auto written = write_laser_rig(options.output / "rig.toml", LaserRig{}); !written)
    return forward_error(written);
  summary.outputs = {options.output};
  for (const char* name : {"recording.bag", "rig.toml", "groundtruth.txt"})
    summary.outputs.push_back(options.output / name);
  return summary;
}

}  // namespace

Result<OfficeRecordingSummary> simulate_office_recording(const OfficeRecordingOptions& options) {
  const auto folder = SimulationFolder::acquire(options.output);
  if (!folder) return forward_error(folder);
  if (auto free = make_simulation_folder(options.output); !free) return forward_error(free);
  if (const auto marked = folder->mark(toml_of(options.simulation)); !marked) return forward_error(marked);
  return folder->finish(as_run_failure(write_all(options)));
}

}  // namespace hm
