#include "hm/pipeline/rgbd/tracking_view.hpp"

#include <vector>

#include "hm/pipeline/live/live_view.hpp"

namespace hm {

void show_tracked(const RunContext& run, const VisualTracking& tracking, const PinholeCamera& camera,
                  const RgbdFrame* frame, const std::optional<SE3>& T_map_camera) {
  if (!run.view) return;
  const TrackedRecord& last = tracking.last();
  run.view->on_camera({last.stamp, frame, camera, T_map_camera, last.reason, last.sigma_m});
  const VisualTrack& track = tracking.track();
  const TrackingNumbers& numbers = last.numbers;
  LiveNumbers all{"tracking", track.frames_read + track.unused.size(), track.frames_total, {}, {}, {}};
  all.stages_ms = {{"waiting", last.wait_ms},
                   {"features", numbers.features_ms},
                   {"prediction", numbers.prediction_ms},
                   {"registration", numbers.registration_ms},
                   {"model", numbers.model_ms}};
  all.counts = {{"features", numbers.features},        {"matches", numbers.matches},
                {"inliers", numbers.inliers},          {"model points", numbers.model_points},
                {"keyframes", track.keyframes.size()}, {"frames tracked", track.frames_tracked},
                {"frames lost", track.frames_lost}};
  run.view->on_numbers(all);
}

void show_corrected(const RunContext& run, const Trajectory& T_map_camera,
                    const CorrectedKeyframes& keyframes) {
  if (!run.view) return;
  std::vector<Vec3> points;
  for (const StampedPose& pose : T_map_camera) points.push_back(pose.T_world_base.translation());
  run.view->on_path(LivePath::kTrajectory, points);
  points.clear();
  for (const CorrectedKeyframe& keyframe : keyframes.keyframes())
    if (keyframe.map == 0) points.push_back(keyframe.T_map_camera.translation());
  run.view->on_path(LivePath::kKeyframes, points);
}

}  // namespace hm
