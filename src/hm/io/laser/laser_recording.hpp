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

/// What the user may know better than the file.
struct LaserRecordingOptions {
  std::optional<LaserRecordingKind> kind = {};  ///< instead of guessing
  /// Bags: the topics to read; empty: guessed by message type, the busiest of each kind (of scans: all).
  std::string scan_topic, imu_topic, odometry_topic, pose_topic, range_topic;
};

/// All scans of one range finder, with strictly increasing stamps.
struct LaserStream {
  std::string name = {};  ///< topic, message name or "left", "right" ...
  std::vector<LaserScan> scans = {};
  /// When each scan reached the recorder; empty where the recording does not say.
  std::vector<Time> received = {};
  SE3 T_base_laser = {};       ///< as far as the format knows it
  std::size_t no_returns = 0;  ///< beams that saw nothing (sentinel, beyond the limit, inf)
  std::size_t invalid = 0;     ///< beams that cannot be readings (NaN, negative, below the near limit)
  /// Ranges that stood for "no return", and how often they occurred: the most frequent first, at most eight.
  std::vector<std::pair<float, std::size_t>> sentinels_m = {};
};

/// A stamp that was written wrongly and could be mended: other files (relations) may hold it as written.
struct MendedStamp {
  Time written, mended;
};

/// A laser recording, whole in memory: every stream in order of its own stamps.
struct LaserRecording {
  LaserRecordingKind kind = LaserRecordingKind::kRosBag;
  std::filesystem::path path = {};
  std::vector<LaserStream> lasers = {};  ///< the one to use for odometry first
  std::vector<ImuSample> imu = {};
  std::vector<RangeReading> ranges = {};   ///< downward distance sensor; infinity: nothing within reach
  Trajectory odometry = {};                ///< T_odom_base as the vehicle reported it
  Trajectory truth = {};                   ///< T_world_base, exact or corrected afterwards; never an input
  std::string truth_source = {};           ///< where it comes from, in words
  std::optional<LaserRig> rig = {};        ///< from rig.toml beside the recording, if there is one
  std::vector<SkippedLines> skipped = {};  ///< lines or messages that were left out
  std::vector<MendedStamp> mended_stamps = {};
  std::vector<std::string> damage = {};  ///< places of the file that could not be read, also told in notes
  ///< of scans and truth, in order of `written`
  std::vector<std::string> notes =
      {};  ///< what a user should know ("bag has no index: read from its chunks")
};

/// Opens a laser recording, guessing its kind from its first bytes: rosbag v2.0 (also without index or cut
/// off: as far as it goes), CARMEN log, g2o-like log with ROBOTLASER1 lines, Wean Hall log, MOOS .alog,
/// BreezySLAM .dat, a EuRoC folder with imu0/data.csv (also below mav0, or as imu0.csv). A folder with one
/// such file in it is that recording. rig.toml beside the file is its rig; groundtruth.txt (TUM) is its
/// truth. Nothing that fits is an error saying what was looked for.
Result<LaserRecording> open_laser_recording(const std::filesystem::path& path,
                                            const LaserRecordingOptions& options = {});

/// True when `path` looks like something that open_laser_recording reads (no more than a glance at it).
bool is_laser_recording(const std::filesystem::path& path);

}  // namespace hm
