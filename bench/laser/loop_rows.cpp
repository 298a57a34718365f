// Row about loops: the Intel lab against relations that people verified.
#include <unistd.h>

#include <filesystem>
#include <optional>

#include "dense/scene_frames.hpp"
#include "hm/pipeline/laser/run/laser_run.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

/// `hm laser` on the log, with degraded wheel odometry as prediction (seed) or without any (nothing).
Result<LaserSummary> drive(std::optional<int> seed) {
  const auto folder = data_folder() / "laser";
  LaserRunOptions options;
  options.recording = folder / "flirt_intel-lab.log";
  options.relations = folder / "intel.relations";
  options.output = std::filesystem::temp_directory_path() / fmt::format("hm_bench_intel_{}", ::getpid());
  options.parameters.laser.run.degraded_odometry = seed.has_value();
  options.parameters.laser.run.pictures = false;
  options.parameters.laser.wheel_noise.seed = seed.value_or(1);
  // Relations between two scans of the log; a pose between scans would have to be interpolated.
  options.parameters.relation_error = {0, 0};
  auto run = run_laser(options);
  std::filesystem::remove_all(options.output);
  if (run && (!run->relation_error || !run->relation_error_odom))
    return fail(ErrorCode::kInternal, "intel_relations",
                "no loop was closed, or no relation lies in the run");
  return run;
}

JsonValue errors_of(const LaserSummary& run) {
  return JsonValue::object({{"matching_m", run.relation_error_odom->translation_m.mean},
                            {"loops_m", run.relation_error->translation_m.mean},
                            {"loops_std_m", run.relation_error->translation_std_m},
                            {"loops_rad", run.relation_error->rotation_rad.mean},
                            {"relations", run.relation_error->errors.size()},
                            {"scans_without_pose", run.scans_failed},
                            {"loop_candidates", run.map_frame.loops.candidates},
                            {"loops_accepted", run.map_frame.loops.accepted}});
}

}  // namespace

Result<BenchResult> bench_intel_relations(const BenchOptions&) {
  constexpr int kSeeds = 5;
  double matching_m = 0, loops_m = 0, seconds = 0;
  JsonValue seeds = JsonValue::array();
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const auto run = drive(seed);
    if (!run) return forward_error(run);
    matching_m += run->relation_error_odom->translation_m.mean / kSeeds;
    loops_m += run->relation_error->translation_m.mean / kSeeds;
    seconds += run->run_s / kSeeds;
    seeds.push_back(errors_of(*run));
  }
  const auto scans_alone = drive({});
  if (!scans_alone) return forward_error(scans_alone);
  BenchResult result;
  result.rows = {{"intel_relations", matching_m, {}}, {"intel_relations_loops", loops_m, {}}};
  result.details = JsonValue::object({{"seconds", seconds}});
  result.details["seeds"] = std::move(seeds);
  result.details["without_odometry"] = errors_of(*scans_alone);
  return result;
}

}  // namespace hm::bench
