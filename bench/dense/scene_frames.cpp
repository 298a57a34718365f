#include "dense/scene_frames.hpp"

#include <cstdlib>
#include <filesystem>
#include <functional>

#include "hm/core/parallel.hpp"

namespace hm::bench {
namespace {

using ReadFrame = std::function<Result<RgbdFrame>(std::size_t index)>;

class ChunkedFrames : public FrameSource {
 public:
  ChunkedFrames(PinholeCamera camera, std::size_t frame_count, const FrameRange& range, ReadFrame read)
      : camera_(camera), range_(range), read_(std::move(read)) {
    const std::size_t available = (frame_count + range.stride - 1) / range.stride;
    count_ = range.limit ? std::min(range.limit, available) : available;
  }

  PinholeCamera camera() const override { return camera_; }

  Result<std::span<const RgbdFrame>> next_chunk() override {
    frames_.clear();
    for (; frames_.size() < range_.chunk && next_ < count_; ++next_) {
      auto frame = read_(next_ * range_.stride);
      if (!frame) return forward_error(frame);
      frames_.push_back(std::move(*frame));
    }
    return std::span<const RgbdFrame>(frames_);
  }

 private:
  PinholeCamera camera_;
  FrameRange range_;
  ReadFrame read_;
  std::size_t count_ = 0, next_ = 0;
  std::vector<RgbdFrame> frames_;
};

}  // namespace

std::filesystem::path data_folder() {
  if (const char* given = std::getenv("HM_DATA")) return given;
  return std::filesystem::path(HM_SOURCE_DIR) / "../shared/data";
}

Result<std::unique_ptr<FrameSource>> open_frames(const std::string& recording, const FrameRange& range) {
  const auto path = data_folder() / "rgbd" / recording;
  if (!std::filesystem::exists(path))
    return fail(ErrorCode::kNotFound, path.string(),
                "the recording is absent (HM_DATA names the folder of data)");
  auto opened = open_recording(path);
  if (!opened) return forward_error(opened);
  const std::shared_ptr<const Recording> kept = std::move(*opened);
  return std::make_unique<ChunkedFrames>(kept->info().camera.without_distortion(), kept->info().frame_count,
                                         range, [kept](std::size_t index) { return kept->read(index); });
}

std::unique_ptr<FrameSource> simulated_frames(const Simulation& simulation, const FrameRange& range) {
  const auto loop = std::make_shared<ParallelLoop>(available_threads());
  return std::make_unique<ChunkedFrames>(
      simulation.camera(), simulation.frame_count(), range,
      [&simulation, loop](std::size_t index) -> Result<RgbdFrame> { return simulation.frame(index, *loop); });
}

}  // namespace hm::bench
