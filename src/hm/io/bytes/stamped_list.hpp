#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/geometry/trajectory.hpp"
#include "hm/io/bytes/skip_counter.hpp"

/// The text lists that a TUM or ICL-NUIM folder consists of, read with the patience that recordings need.
/// In all of them a malformed line is an error naming file:line, except for a last line without an end, which
/// is left out as cut off; lines whose stamp does not increase are left out, as few as possible.
namespace hm::detail {

/// How a stamp in a file becomes a time: seconds, or frame numbers at a rate.
struct StampRule {
  std::optional<double> frame_rate_hz;
  [[nodiscard]] std::optional<Time> parse(std::string_view word) const;
};

struct StampedPicture {
  Time stamp;
  std::string path;  ///< as written, relative to the recording
};

struct PictureList {
  std::vector<StampedPicture> pictures;
  std::vector<SkippedLines> skipped;
};
/// Lines `stamp path`.
Result<PictureList> read_picture_list(const std::filesystem::path& path, const StampRule& rule = {});

struct AssociationList {
  PictureList depth;
  PictureList color;
};
/// Lines `stamp path stamp path`, colour and depth in either order (told by the paths' names).
Result<AssociationList> read_associations(const std::filesystem::path& path, const StampRule& rule = {});

/// Poses of a device that sometimes had none.
struct PoseList {
  Trajectory poses;
  std::vector<Time> lost;  ///< stamps of lines with NaN or a rotation of zero length, increasing
  std::vector<SkippedLines> skipped;
};
/// Lines `stamp tx ty tz qx qy qz qw`.
Result<PoseList> read_pose_list(const std::filesystem::path& path, const StampRule& rule = {});

/// The pose at a moment, interpolated; nothing when its neighbours are more than `max_gap` apart or the
/// device said in between that it was lost.
std::optional<SE3> pose_between(const PoseList& list, Time stamp, Duration max_gap);

/// For each time of `a` the index of its partner in `b`, or nothing: pairs at most `max_difference` apart,
/// closest first, each used once (the rule of TUM's associate.py). Both increase.
std::vector<std::optional<std::size_t>> associate(std::span<const Time> a, std::span<const Time> b,
                                                  Duration max_difference);

}  // namespace hm::detail
