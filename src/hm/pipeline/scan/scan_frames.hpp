#pragma once
#include <filesystem>
#include <functional>
#include <mutex>
#include <vector>

#include "hm/io/rgbd/recording.hpp"
#include "hm/io/rgbd/tum_writer.hpp"

namespace hm {

/// The frames that a scan has given to SLAM, by their numbers there, read back from the recording that the
/// scan writes: a recording without the frames that SLAM has not seen.
class ScanFrames : public Recording {
 public:
  /// `wait_until_written`: returns when a frame with this stamp is on disk, or will never be.
  ScanFrames(std::filesystem::path recording, const PinholeCamera& camera,
             std::function<void(Time)> wait_until_written)
      : folder_(std::move(recording)), camera_(camera), wait_until_written_(std::move(wait_until_written)) {}

  /// Notes the frame with the next number.
  void add(const RgbdFrame& frame);
  [[nodiscard]] std::size_t size() const;
  /// Fills info() from the recording, which is complete now. Error: it cannot be opened.
  Result<void> complete();

  [[nodiscard]] PinholeCamera camera() const override { return camera_; }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    return read_with(read_written_frame, index);
  }
  [[nodiscard]] Result<RgbdFrame> read_depth(std::size_t index) const override {
    return read_with(read_written_depth, index);
  }
  /// After complete().
  [[nodiscard]] const RecordingInfo& info() const override { return info_; }

 private:
  using ReadWritten = Result<RgbdFrame> (*)(const std::filesystem::path& folder, const RgbdFrame& written);
  [[nodiscard]] Result<RgbdFrame> read_with(ReadWritten how, std::size_t index) const;
  struct Written {
    Time stamp, color_stamp;
    double depth_unit_m = 1e-3;
  };
  std::filesystem::path folder_;
  PinholeCamera camera_;
  std::function<void(Time)> wait_until_written_;
  mutable std::mutex mutex_;
  std::vector<Written> frames_;
  RecordingInfo info_;
};

}  // namespace hm
