// Rows about the back end on real recordings: its trajectory against that of the odometry that it starts
// from.
#include <algorithm>

#include "dense/scene_frames.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/pipeline/checks/preflight.hpp"
#include "hm/pipeline/common/truth_comparison.hpp"
#include "hm/pipeline/rgbd/slam_pipeline.hpp"
#include "hm/pipeline/rgbd/slam_state.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

/// ATE of odometry and after loops, centimetres.
struct BackEnd {
  double before_cm = 0, after_cm = 0;
  [[nodiscard]] double ratio() const { return after_cm / before_cm; }
};

/// As `hm slam` with its defaults, but for the dense map.
Result<BackEnd> close_loops_of(const char* name, bool align, const BenchOptions& options) {
  auto recording = open_recording(data_folder() / "rgbd" / name, {});
  if (!recording) return forward_error(recording);
  RgbdParameters parameters;
  const auto checked = check_before_run(
      *recording,
      {.poses = PoseUse::kComparesWith, .register_color = parameters.reconstruction.register_color});
  if (!checked) return forward_error(checked);
  parameters.reconstruction.live_mesh = false;
  parameters.reconstruction.frame_limit = options.frame_limit;
  parameters.slam.map_stride = 30;  // the map does not matter here
  parameters.slam.rebuild_online = false;
  parameters.slam.align = align;
  RunContext run;
  run.threads = options.threads;
  SlamPipeline pipeline(**recording, parameters, run);
  if (const auto tracked = pipeline.track_and_map(); !tracked) return forward_error(tracked);
  pipeline.close_loops();
  const SlamPipeline::State& state = pipeline.state();
  std::vector<std::string> warnings;
  const auto before = compare_with_truth(state.track.trajectory, (*recording)->info(), {}, warnings);
  const auto after = compare_with_truth(state.corrected, (*recording)->info(), {}, warnings);
  if (!before || !after) return fail(ErrorCode::kInternal, name, "the trajectory cannot be judged");
  return BackEnd{100 * before->position_m.rmse, 100 * after->position_m.rmse};
}

}  // namespace

Result<BenchResult> bench_slam_recordings(const BenchOptions& options) {
  BenchResult result;
  double worst_ratio = 0;
  for (const char* name : {"icl_of_kt3", "tum_fr1_xyz", "tum_fr1_rpy", "sevenscenes_a"})
    for (const bool align : {false, true}) {
      const auto outcome = close_loops_of(name, align, options);
      if (!outcome) return forward_error(outcome);
      worst_ratio = std::max(worst_ratio, outcome->ratio());
      const std::string key = std::string(name) + (align ? "_aligned" : "");
      result.details[key] = JsonValue::object(
          {{"odometry_cm", outcome->before_cm}, {"slam_cm", outcome->after_cm}, {"ratio", outcome->ratio()}});
      const std::string row = key == "tum_fr1_rpy"             ? "slam_tum_rpy"
                              : key == "tum_fr1_xyz"           ? "slam_tum_xyz"
                              : key == "sevenscenes_a_aligned" ? "slam_sevenscenes"
                                                               : "";
      if (!row.empty()) result.rows.push_back({row, outcome->after_cm, outcome->before_cm});
    }
  result.rows.push_back({"slam_never_harms", worst_ratio, {}});
  return result;
}

}  // namespace hm::bench
