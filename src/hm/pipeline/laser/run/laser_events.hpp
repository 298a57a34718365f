#pragma once
#include <span>
#include <vector>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"

namespace hm {

/// The sensors of a recording's vehicle.
LaserPlatform laser_platform(const LaserRecording& recording);

/// Something that reaches the vehicle's computer at a moment.
struct LaserEvent {
  enum class Kind { kImu, kOdometry, kRange, kScan };
  Time due;  ///< of a scan: its end
  Kind kind = Kind::kScan;
  std::size_t stream = 0;  ///< of scans: the laser
  std::size_t index = 0;
};

/// All streams of a recording that a pipeline uses, merged in order of time.
class LaserEvents {
 public:
  LaserEvents(const LaserRecording& recording, const LaserPipeline& pipeline, const LaserRunParams& params);
  [[nodiscard]] std::span<const LaserEvent> all() const { return events_; }
  [[nodiscard]] std::size_t scan_count() const { return scan_dues_.size(); }
  /// Scans due after `after` and not later than `until`.
  [[nodiscard]] std::size_t scans_between(Time after, Time until) const;
  /// The first and last moment; zero without events.
  [[nodiscard]] Time begin() const { return events_.empty() ? Time{} : events_.front().due; }
  [[nodiscard]] Time end() const { return events_.empty() ? Time{} : events_.back().due; }

 private:
  std::vector<LaserEvent> events_;
  std::vector<Time> scan_dues_;
};

/// Gives an event of this recording to a pipeline.
void give(LaserPipeline& pipeline, const LaserRecording& recording, const LaserEvent& event);

}  // namespace hm
