#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/io/bytes/skipped_lines.hpp"
#include "hm/sensors/imu.hpp"
#include "hm/sensors/laser_rig.hpp"
#include "hm/sensors/laser_scan.hpp"

namespace hm {

enum class LaserRecordingKind { kRosBag, kCarmen, kG2oLaser, kWeanHall, kMoos, kBreezySlam, kEurocImu };
std::string_view to_string(LaserRecordingKind kind);

/// Options that override what the file says.
struct LaserRecordingOptions {
  std::optional<LaserRecordingKind> kind = {};  ///< instead of detection
  /// Topics to read from bags; empty: chosen by message type, the topic with most messages (for scans: all
  /// topics).
  std::string scan_topic, imu_topic, odometry_topic, pose_topic, range_topic;
};

/// All scans of one range finder, with strictly increasing stamps.
struct LaserStream {
  std::string name = {};  ///< topic, message name or "left", "right" ...
  std::vector<LaserScan> scans = {};
  /// Time at which the recorder received each scan; empty if not recorded.
  std::vector<Time> received = {};
  std::string frame_id = {};  ///< name of its coordinate frame, if the format gives one
  SE3 T_base_laser = {};      ///< if the recording or its rig.toml provides it, else identity
  std::string mount_source =
      {};  ///< origin of T_base_laser where a bag or rig.toml provides it, for the user
  std::string mount_problem = {};  ///< why the transforms of a bag do not provide it, for the user
  std::size_t no_returns = 0;      ///< beams without return (sentinel, beyond the limit, inf)
  std::size_t invalid = 0;         ///< invalid beams (NaN, negative, below the near limit)
  /// Ranges used as "no return" markers and their counts: the most frequent first, at most eight.
  std::vector<std::pair<float, std::size_t>> sentinels_m = {};
};

/// All readings of one range sensor, with strictly increasing stamps.
struct RangeStream {
  std::string name = {};                    ///< topic
  std::vector<RangeReading> readings = {};  ///< distances; infinity: no return
  std::string frame_id = {};                ///< name of its coordinate frame
  std::optional<SE3> T_base_range = {};     ///< if rig.toml or the transforms of a bag provide it
  std::string mount_source = {};            ///< origin of T_base_range, or why it is unknown, for the user
};

/// A stamp that was written wrongly and has been corrected; other files (relations) may use the written one.
struct CorrectedStamp {
  Time written, corrected;
};

/// Heading of odometry as a text log has it: not wrapped, so that its unit can be judged.
struct WrittenHeading {
  Time stamp;
  double heading_rad = 0;
};

/// Laser recording, completely in memory; every stream is sorted by its own stamps.
struct LaserRecording {
  LaserRecordingKind kind = LaserRecordingKind::kRosBag;
  std::filesystem::path path = {};
  std::vector<LaserStream> lasers = {};  ///< the first one is used for odometry
  std::vector<ImuSample> imu = {};
  RangeStream range = {};
  Trajectory odometry = {};                           ///< T_odom_base as the vehicle reported it
  std::vector<WrittenHeading> written_headings = {};  ///< of odometry, in the order of the file; CARMEN only
  std::string odometry_source = {};                   ///< origin, for the user, where the file names it
  Trajectory truth = {};                   ///< T_world_base, exact or corrected afterwards; never an input
  std::string truth_source = {};           ///< origin, for the user
  std::optional<LaserRig> rig = {};        ///< from rig.toml beside the recording, if present
  std::vector<SkippedLines> skipped = {};  ///< skipped lines or messages
  std::vector<CorrectedStamp> corrected_stamps = {};  ///< of scans and truth, sorted by `written`
  std::vector<std::string> damage = {};               ///< unreadable parts of the file, also listed in notes
  std::vector<std::string> notes = {};  ///< messages for the user ("bag has no index: read from its chunks")
};

/// Opens a laser recording; its kind is recognised from its first bytes: rosbag v2.0 (also without index or
/// truncated: as far as readable), CARMEN log, g2o-like log with ROBOTLASER1 lines, Wean Hall log, MOOS
/// .alog, BreezySLAM .dat, a EuRoC folder with imu0/data.csv (also below mav0, or as imu0.csv). A folder that
/// contains exactly one such file is accepted. rig.toml beside the file provides the rig; groundtruth.txt
/// (TUM) provides the truth. Errors name the file; if nothing fits, they list what was looked for.
Result<LaserRecording> open_laser_recording(const std::filesystem::path& path,
                                            const LaserRecordingOptions& options = {});

/// True when `path` looks like a recording for open_laser_recording (a quick check of its first bytes).
bool is_laser_recording(const std::filesystem::path& path);

}  // namespace hm
