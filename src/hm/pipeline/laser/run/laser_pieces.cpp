#include "hm/pipeline/laser/run/laser_pieces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "hm/io/bytes/output_file.hpp"
#include "hm/io/map/occupancy_grid_file.hpp"
#include "hm/io/pose/trajectory_file.hpp"
#include "hm/pipeline/laser/laser_map_frame.hpp"
#include "hm/pipeline/laser/run/laser_evaluation.hpp"

namespace hm {
namespace {

/// Scans of different pieces are placed so far apart that they are not compared.
constexpr double kApart_m = 1e6;

/// Poses [first, last) of a run.
struct PoseRange {
  std::size_t first = 0, last = 0;
  [[nodiscard]] std::size_t size() const { return last - first; }
};

std::vector<PoseRange> ranges_between(const Trajectory& poses, const std::vector<Time>& breaks) {
  std::vector<PoseRange> ranges;
  std::size_t first = 0;
  for (std::size_t i = 1; i <= poses.size(); ++i) {
    if (i < poses.size() && !std::ranges::binary_search(breaks, poses[i].stamp)) continue;
    if (i - first >= kLeastPieceScans) ranges.push_back({first, i});
    first = i;
  }
  return ranges;
}

/// The piece that each pose is in; the number of pieces for those in none.
std::vector<std::size_t> piece_of_poses(std::size_t poses, const std::vector<PoseRange>& ranges) {
  std::vector<std::size_t> piece(poses, ranges.size());
  for (std::size_t k = 0; k < ranges.size(); ++k)
    for (std::size_t i = ranges[k].first; i < ranges[k].last; ++i) piece[i] = k;
  return piece;
}

std::size_t pose_at_or_after(const Trajectory& poses, Time stamp) {
  const auto found = std::ranges::lower_bound(poses, stamp, {}, &StampedPose::stamp);
  return static_cast<std::size_t>(found - poses.begin());
}

/// Which pieces contradict themselves.
std::vector<bool> contradictory(const Trajectory& poses, const std::vector<PoseRange>& ranges,
                                const ScanVisits& visits) {
  const std::vector<std::size_t> piece = piece_of_poses(poses.size(), ranges);
  std::size_t alone = ranges.size();  // scans in no piece are compared with none
  const auto placed = [&](Time stamp, const SE2& T_odom_base) {
    const std::size_t pose = pose_at_or_after(poses, stamp);
    const bool in_piece = pose < poses.size() && piece[pose] < ranges.size();
    const std::size_t place = in_piece ? piece[pose] : alone++;
    return SE2(static_cast<double>(place) * kApart_m, 0, 0) * T_odom_base;
  };
  std::vector<std::vector<VisitComparison>> found(ranges.size());
  for (const VisitAgreement& agreement : visits.compare(placed)) {
    const std::size_t pose = pose_at_or_after(poses, agreement.stamp);
    if (pose < poses.size() && piece[pose] < ranges.size())
      found[piece[pose]].push_back({0, agreement.contradicted_ratio(), agreement.place_m});
  }
  std::vector<bool> result;
  for (std::vector<VisitComparison>& comparisons : found) {
    RunVerdict verdict;
    judge_visits(std::move(comparisons), kLaserVisitLimits, "scans", verdict);
    result.push_back(verdict.value != MapVerdict::kOk);
  }
  return result;
}

LaserPiece piece_of(const Trajectory& poses, const PoseRange& range, Time begin) {
  const Trajectory part(poses.begin() + static_cast<std::ptrdiff_t>(range.first),
                        poses.begin() + static_cast<std::ptrdiff_t>(range.last));
  const Time first = part.front().stamp, last = part.back().stamp;
  return {first, last, (first - begin).seconds(), (last - begin).seconds(), part.size(), path_length(part)};
}

}  // namespace

std::vector<LaserPiece> consistent_pieces(const Trajectory& T_odom_base, const std::vector<Time>& breaks,
                                          const ScanVisits& visits, Time begin) {
  std::vector<PoseRange> ranges = ranges_between(T_odom_base, breaks);
  for (bool halved = true; halved;) {
    halved = false;
    const std::vector<bool> wrong = contradictory(T_odom_base, ranges, visits);
    std::vector<PoseRange> next;
    for (std::size_t k = 0; k < ranges.size(); ++k) {
      const PoseRange range = ranges[k];
      if (!wrong[k]) {
        next.push_back(range);
        continue;
      }
      halved = true;
      const std::size_t middle = range.first + range.size() / 2;
      for (const PoseRange half : {PoseRange{range.first, middle}, PoseRange{middle, range.last}})
        if (half.size() >= kLeastPieceScans) next.push_back(half);
    }
    ranges = std::move(next);
  }
  std::vector<LaserPiece> pieces;
  for (const PoseRange& range : ranges) pieces.push_back(piece_of(T_odom_base, range, begin));
  return pieces;
}

Result<void> write_laser_pieces(const LaserPiecesInput& input, const LaserParameters& params,
                                const std::filesystem::path& folder, std::vector<LaserPiece>& pieces) {
  if (pieces.empty()) return {};
  std::vector<MultiVolumeGrid> grids;
  for (std::size_t k = 0; k < pieces.size(); ++k) grids.emplace_back(params.mvog);
  SweepPoints points(params.run.clear_without_return_m);
  const auto read = input.scans.for_each([&](const MappedScan& mapped) {
    const auto after = std::ranges::upper_bound(pieces, mapped.stamp, {}, &LaserPiece::begin);
    if (after == pieces.begin() || mapped.stamp > (after - 1)->end) return;
    const LaserScan* scan = find_scan(input.recording, mapped);
    if (!scan) return;
    points.compute_again(*scan, input.rigs[mapped.laser], mapped.sweep, SE3());
    grids[static_cast<std::size_t>(after - 1 - pieces.begin())].insert(points.beam_scan());
  });
  if (!read) return read;
  if (const auto made = make_folder_in(folder, kPiecesFolder); !made) return made;
  std::vector<LaserPiece> written;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const auto slice = laser_slice(grids[k], params.run);
    if (!slice || slice->cells.empty()) continue;
    LaserPiece piece = pieces[k];
    const auto stem = std::filesystem::path(kPiecesFolder) / fmt::format("{:02}", written.size() + 1);
    piece.map = stem.string() + ".yaml";
    if (const auto map = write_occupancy_grid(folder / piece.map, *slice); !map) return map;
    Trajectory part;
    for (const StampedPose& pose : input.T_odom_base)
      if (pose.stamp >= piece.begin && pose.stamp <= piece.end) part.push_back(pose);
    if (const auto path = write_tum_trajectory(folder / (stem.string() + ".txt"), part); !path) return path;
    written.push_back(std::move(piece));
  }
  pieces = std::move(written);
  return {};
}

}  // namespace hm
