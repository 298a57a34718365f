#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "hm/io/bytes/append_file.hpp"
#include "hm/io/rosbag/bag_writer.hpp"
#include "hm/pipeline/common/run_records.hpp"
#include "hm/pipeline/flight/flight_observer.hpp"
#include "hm/pipeline/flight/flight_run.hpp"

namespace hm {

/// Height of the vehicle by the laser, in `odom`.
struct MeasuredHeight {
  Time stamp;
  double height_m = 0, floor_m = 0;
};

/// Records a flight while it goes on:
///   recording.bag     /scan and /imu as they reach the on-board computer, for `hm laser`; atomic, under the
///   name
///                     recording.bag.partial until the end, and readable there after a kill
///   core.trace        the core's inputs and outputs (CoreTraceRecord), readable up to the last whole record
class FlightRecorder : public FlightObserver {
 public:
  /// Error: core.trace cannot be written.
  static Result<FlightRecorder> create(const std::filesystem::path& folder);

  void on_scan(const Received<LaserScan>& scan) override;
  void on_imu(const Received<ImuSample>& sample) override;
  void on_laser_step(const LaserStep& step) override;
  void on_core_step(std::span<const CoreTraceRecord> records) override;

  /// Hands the newest records to the operating system. Error: something could not be written.
  Result<void> flush();
  /// Completes the files.
  Result<void> finish();
  [[nodiscard]] const std::vector<MeasuredHeight>& heights() const { return heights_.items(); }
  [[nodiscard]] std::size_t scans() const { return scans_; }

 private:
  FlightRecorder(const std::filesystem::path& folder, AppendFile trace)
      : bag_(folder / "recording.bag"), trace_(std::move(trace)) {}
  BagWriter bag_;
  AppendFile trace_;
  std::size_t scans_ = 0;
  EvenlyThinned<MeasuredHeight> heights_{std::size_t{1} << 14U};
};

}  // namespace hm
