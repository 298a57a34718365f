#pragma once
#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "hm/laser/matching/pl_icp.hpp"
#include "hm/slam/laser/loop_consistency.hpp"
#include "hm/slam/laser/scan_submaps.hpp"
#include "hm/slam/laser/search/correlative_search.hpp"

namespace hm {

enum class LoopOutcome {
  kAccepted,
  kNoMatch,    ///< no pose in the window fits the scan
  kAmbiguous,  ///< several poses fit nearly as well, or it corrects much, leaves a direction free and ends no
               ///< contradiction
  kLimitReached,  ///< the search exceeded its limit
  kNotVerified,   ///< PL-ICP does not confirm the match, or the loop is excluded
  kAlone,         ///< it corrects much, and no other loop agrees (until one does)
};
std::string_view to_string(LoopOutcome outcome);

/// Pose of a keyframe relative to an earlier one, with the covariance of its match as (x, y, angle).
struct LoopMatch {
  std::size_t from;
  SE2 T_from_base;
  Mat3 covariance;
};

/// Result of the search for a keyframe in a submap.
struct FoundLoop {
  LoopOutcome outcome = LoopOutcome::kNoMatch;  ///< why there is no match
  double score = 0;
  SearchWindow window;  ///< that was searched, in the frame of the submap's anchor
  std::optional<LoopMatch> match;
};

/// How far two scans are apart: rotation by one radian reduces their overlap like a translation by 0.7 m.
double apart_m(const SE2& motion);

/// Whether PL-ICP ends near its guess, with small errors, and pairs most of the points that two single scans
/// can be expected to share. The match must have succeeded.
bool confirms_shared(const ScanMatch& match, const SE2& guess, const ScanGraph2DParams& params);

/// Finds keyframes in earlier submaps by correlative search, and confirms them with PL-ICP.
class LoopFinder {
 public:
  explicit LoopFinder(const ScanGraph2DParams& params);

  /// Searches the last keyframe of a path in a submap of it, in a window in the frame of the submap's anchor;
  /// with `may_widen`, in a wider one where that finds nothing and the path contradicts itself there.
  FoundLoop find(const MappedKeyframes& path, const ScanSubmap& submap, const SearchWindow& window,
                 bool may_widen);

 private:
  /// Search for the last keyframe of a path in a submap.
  struct Search {
    const MappedKeyframes& path;
    const ScanSubmap& submap;
    const CorrelativeMap& map;
    std::vector<Vec2> points_m;
    SearchWindow window;
    CorrelativeSearchParams params;
  };
  [[nodiscard]] std::optional<LoopMatch> verified(const Search& search, const SE2& T_anchor_base);
  [[nodiscard]] std::optional<LoopMatch> verified_along_walls(const Search& search,
                                                              const CorrelativeMatch& ambiguous);
  [[nodiscard]] Mat3 with_free_sigma(const ScanMatch& match, const PlanarScan& reference,
                                     const PlanarScan& scan);
  [[nodiscard]] Vec3 free_motion(const PlanarScan& reference, const PlanarScan& scan,
                                 const SE2& T_reference_scan, const Vec2& axis);

  ScanGraph2DParams params_;
  SubmapRasters rasters_;
  PlIcp matcher_;
};

}  // namespace hm
