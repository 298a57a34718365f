#pragma once
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "hm/io/laser/laser_recording.hpp"
#include "hm/pipeline/laser/run/laser_run.hpp"

namespace hm {

/// A scan that is in the map, and how it went there.
struct MappedScan {
  std::size_t laser = 0;
  Time scan_stamp, stamp;  ///< of the scan; of its pose
  SE3 T_odom_base;
  std::vector<SweepKnot> sweep;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(laser, scan_stamp, stamp, T_odom_base, sweep);
  }
};
/// The scan itself; null where the recording has none of its stamp.
const LaserScan* find_scan(const LaserRecording& recording, const MappedScan& mapped);
/// The scan of a step; nothing where it is not in the map.
std::optional<MappedScan> mapped_scan(const LaserStep& step);

/// Scans that are in the map, in a file that bears no name and goes with the process: about 2 kB for a scan
/// of 1,081 beams, so that a run of any length needs no memory for them.
class MappedScanFile {
 public:
  /// The file is made in `folder`, at the first scan.
  explicit MappedScanFile(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// After a failure nothing more is written.
  void add(MappedScan scan);
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Error (kUnreadable): the file could not be made or written.
  [[nodiscard]] Result<void> written() const;
  /// Gives all scans in the order in which they came, bit by bit as they were. Error (kUnreadable): the file
  /// could not be made, written or read.
  Result<void> for_each(const std::function<void(const MappedScan& scan)>& take);

 private:
  struct Closer {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void open();
  void note_failure();
  void write(const void* bytes, std::size_t count);

  std::filesystem::path folder_;
  std::unique_ptr<std::FILE, Closer> file_;
  std::size_t count_ = 0;
  int failure_ = 0;  ///< errno of the first failure
};

/// Input of a map in the frame `map`: the scans of a recording, what a pipeline made of them, and
/// its present estimate of the frame.
struct RebuildInput {
  const LaserRecording& recording;
  std::vector<LaserRig> rigs;  ///< of the recording's lasers
  MappedScanFile& scans;
  const LaserMapFrame& map_frame;
};

/// The multi-volume grid anew, as if the corrections that are known now had been known when each scan came:
/// every scan of the recording is inserted again, in its order, moved by the correction of its moment. Costs
/// as much as building the map did; besides the two maps it needs one scan's points. Error: `scans` cannot be
/// read.
Result<MultiVolumeGrid> rebuild_laser_map(const RebuildInput& input, const LaserParameters& params,
                                          const RunContext& run);

}  // namespace hm
