#include "hm/pipeline/scan/scan_frames.hpp"

#include <utility>

#include "hm/core/check.hpp"

namespace hm {

void ScanFrames::add(const RgbdFrame& frame) {
  const std::scoped_lock lock(mutex_);
  frames_.push_back({frame.stamp, frame.color_stamp, frame.depth.unit_m});
}

std::size_t ScanFrames::size() const {
  const std::scoped_lock lock(mutex_);
  return frames_.size();
}

Result<RgbdFrame> ScanFrames::read_with(ReadWritten how, std::size_t index) const {
  RgbdFrame written;
  {
    const std::scoped_lock lock(mutex_);
    HM_CHECK(index < frames_.size(), "frame {} of {}", index, frames_.size());
    written.stamp = frames_[index].stamp;
    written.color_stamp = frames_[index].color_stamp;
    written.depth.unit_m = frames_[index].depth_unit_m;
  }
  wait_until_written_(written.stamp);
  auto frame = how(folder_, written);
  if (frame) frame->index = index;
  return frame;
}

Result<void> ScanFrames::complete() {
  const auto recording = open_recording(folder_);
  if (!recording) return forward_error(recording);
  info_ = (*recording)->info();
  const std::scoped_lock lock(mutex_);
  info_.frame_count = info_.color_count = info_.paired_count = frames_.size();
  info_.frame_poses.assign(frames_.size(), std::nullopt);
  info_.stamps.clear();
  info_.color_stamps.clear();
  for (const Written& frame : frames_) {
    info_.stamps.push_back(frame.stamp);
    info_.color_stamps.push_back(frame.color_stamp);
  }
  return {};
}

}  // namespace hm
