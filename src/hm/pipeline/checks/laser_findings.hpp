#pragma once
#include "hm/pipeline/checks/laser_check.hpp"

/// Checks of inspect_laser_recording(): each function appends what it finds to report.findings.
namespace hm {

/// Stamps that run backwards, streams that do not meet in time, holes, damage.
void find_odd_stamps(const LaserRecording& recording, LaserRecordingReport& report);
/// Ranges and angles that no working range finder delivers.
void find_odd_scans(const LaserStreamStats& laser, LaserRecordingReport& report);
/// Accelerations and turning rates in other units.
void find_odd_units(const ImuReport& imu, LaserRecordingReport& report);
void find_odd_odometry(const LaserRecording& recording, LaserRecordingReport& report);
/// Lasers that the transforms of a bag do not join to its base, or that move on it.
void find_odd_mounts(const LaserRecording& recording, LaserRecordingReport& report);

}  // namespace hm
