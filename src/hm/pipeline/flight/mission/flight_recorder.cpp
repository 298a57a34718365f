#include "hm/pipeline/flight/mission/flight_recorder.hpp"

namespace hm {

Result<FlightRecorder> FlightRecorder::create(const std::filesystem::path& folder) {
  auto trace = AppendFile::create(folder / "core.trace");
  if (!trace) return forward_error(trace);
  return FlightRecorder(folder, std::move(*trace));
}

void FlightRecorder::on_scan(const Received<LaserScan>& scan) {
  bag_.write_scan({"/scan", "laser"}, scan.at, scan.measured);
  ++scans_;
}

void FlightRecorder::on_imu(const Received<ImuSample>& sample) {
  bag_.write_imu({"/imu", "imu"}, sample.at, sample.measured);
}

void FlightRecorder::on_laser_step(const LaserStep& step) {
  if (!step.height || step.height->status != HeightStatus::kOk) return;
  heights_.push_back({step.height->stamp, step.height->height_m, step.height->floor_level_m});
}

void FlightRecorder::on_core_step(std::span<const CoreTraceRecord> records) {
  for (const CoreTraceRecord& record : records) trace_.append(encode(record));
}

Result<void> FlightRecorder::flush() {
  bag_.flush();
  return trace_.flush();
}

Result<void> FlightRecorder::finish() {
  if (const auto flushed = trace_.flush(); !flushed) return flushed;
  if (const auto synced = trace_.sync(); !synced) return synced;
  return bag_.finish();
}

}  // namespace hm
