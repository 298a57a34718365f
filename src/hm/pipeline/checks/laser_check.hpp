#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/checks/stream_report.hpp"

namespace hm {

/// Statistics of one range finder's stream.
struct LaserStreamStats {
  StreamReport stream;
  std::size_t beams = 0, fewest_beams = 0;                               ///< in a scan: most, fewest
  double angle_min_rad = 0, angle_max_rad = 0, angle_increment_rad = 0;  ///< of the first scan
  double time_increment_s = 0;
  double range_min_m = 0, range_max_m = 0;
  double returns_ratio = 0, no_returns_ratio = 0, invalid_ratio = 0;  ///< of all beams
  double nearest_m = 0, median_m = 0, farthest_m = 0;                 ///< of the returns
  double farthest_exactly_ratio = 0;  ///< of the returns: those that are exactly farthest_m
  std::vector<std::pair<float, std::size_t>> sentinels_m;
  double repeated_ratio = 0;                       ///< scans that equal the one before in every range
  std::optional<double> latency_s, max_latency_s;  ///< from stamp to arrival: median, longest
  SE3 T_base_laser;
  std::string mount_source;  ///< origin of T_base_laser; empty: the recording's format, or none
};

/// Statistics of an inertial measurement unit's stream.
struct ImuReport {
  StreamReport stream;
  bool has_orientation = false;
  double force_m_s2 = 0;           ///< median length of the specific force
  double still_force_m_s2 = 0;     ///< its mean over the stillest half second
  double still_turning_rad_s = 0;  ///< mean angular velocity over the same time: its bias
  double still_spread_m_s2 = 0;    ///< standard deviation of the force's length in that time
};

enum class LaserFindingKind {
  kStamps,      ///< stamps run backwards, repeat, were corrected, or clocks differ
  kGap,         ///< holes in a stream
  kRanges,      ///< hardly a return, all the same, frozen, or an undocumented marker
  kRangeUnits,  ///< ranges farther than a range finder sees: not in metres
  kAngles,      ///< beams that cannot stand so
  kImuUnits,    ///< accelerations or turning rates in other units, or a large bias
  kOdometry,    ///< it does not move, jumps, or has headings in degrees
  kDamage,      ///< parts of the file cannot be read
  kMissing,     ///< no scans
  kMount,       ///< it is not known how a laser is mounted
};
std::string_view to_string(LaserFindingKind kind);

/// Something that looks wrong, in words, with the number that shows it.
struct LaserFinding {
  LaserFindingKind kind;
  std::string message;
};

/// Content of a laser recording, for `hm info`.
struct LaserRecordingReport {
  std::string kind, path, odometry_source, truth_source;
  std::vector<LaserStreamStats> lasers;
  std::optional<ImuReport> imu;
  std::optional<StreamReport> ranges, odometry, truth;
  double odometry_length_m = 0, truth_length_m = 0;
  bool has_rig = false;
  std::vector<std::string> notes;
  std::vector<LaserFinding> findings;
};

/// Looks at a laser recording: streams, rates, beams, markers, units, and what seems wrong with them.
LaserRecordingReport inspect_laser_recording(const LaserRecording& recording);

/// The report's keys in snake_case with units, and its lines for a terminal.
void visit(const LaserStreamStats& laser, SummaryTree& v);
void visit(const LaserRecordingReport& report, SummaryTree& v);
std::string to_text(const LaserRecordingReport& report);

}  // namespace hm
