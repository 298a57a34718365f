#include "hm/cameras/replay_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "hm/io/rgbd/recording.hpp"

namespace hm {
namespace {

using Clock = std::chrono::steady_clock;

class ReplayCamera : public CameraDriver {
 public:
  ReplayCamera(std::unique_ptr<Recording> recording, const CameraRequest& request, std::size_t first)
      : recording_(std::move(recording)),
        speed_(request.replay_speed),
        unplug_s_(request.replay_unplug_s),
        frames_(*recording_, first, recording_->info().frame_count),
        next_(first) {}

  [[nodiscard]] CameraDescription describe() const override {
    const RecordingInfo& info = recording_->info();
    CameraDescription description;
    description.name = "replay " + info.path.string();
    description.camera = recording_->camera();
    description.intrinsics_source = info.camera_source;
    description.depth_unit_m = info.depth_unit_m;
    if (info.stamps.size() > 1)
      description.rate_hz =
          static_cast<double>(info.stamps.size() - 1) / (info.stamps.back() - info.stamps.front()).seconds();
    return description;
  }

  CameraEvent next(std::chrono::milliseconds timeout) override {
    const std::vector<Time>& stamps = recording_->info().stamps;
    if (next_ >= stamps.size()) return {CameraEvent::Kind::kEnd, {}, "the recording has ended"};
    if (!begun_) begun_ = {Clock::now(), stamps[next_]};
    const double since_first_s = (stamps[next_] - begun_->second).seconds();
    if (unplug_s_ && since_first_s >= *unplug_s_)
      return {CameraEvent::Kind::kFailed, {}, fmt::format("the replay was unplugged after {} s", *unplug_s_)};
    const auto due = begun_->first + std::chrono::duration_cast<Clock::duration>(
                                         std::chrono::duration<double>(since_first_s / speed_));
    const auto until = Clock::now() + timeout;
    std::this_thread::sleep_until(std::min(due, until));
    if (due > until) return {};
    ++next_;
    auto frame = frames_.next();
    if (!frame) return {CameraEvent::Kind::kEnd, {}, "the recording has ended"};
    if (!*frame) return {CameraEvent::Kind::kIncomplete, {}, to_string(frame->error())};
    (*frame)->T_world_camera.reset();  // a camera does not know where it is
    return {CameraEvent::Kind::kFrame, std::move(**frame), {}};
  }

 private:
  std::unique_ptr<Recording> recording_;
  double speed_;
  std::optional<double> unplug_s_;
  FramePrefetcher frames_;
  std::size_t next_;
  std::optional<std::pair<Clock::time_point, Time>> begun_;  ///< when the first frame was due, and its stamp
};

}  // namespace

Result<std::unique_ptr<CameraDriver>> open_replay(const std::string& path, const CameraRequest& request) {
  if (path.empty()) return fail(ErrorCode::kUsage, "--camera replay", "needs a recording: replay:RECORDING");
  RecordingOptions options;
  options.camera = request.intrinsics;
  options.depth_units_per_m = request.depth_units_per_m;
  options.calibration = request.calibration;
  auto recording = open_recording(path, options);
  if (!recording) return forward_error(recording);
  const std::vector<Time>& stamps = (*recording)->info().stamps;
  std::size_t first = 0;
  if (request.after)
    first = static_cast<std::size_t>(std::upper_bound(stamps.begin(), stamps.end(), *request.after) -
                                     stamps.begin());
  return std::make_unique<ReplayCamera>(std::move(*recording), request, first);
}

}  // namespace hm
