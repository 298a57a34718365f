#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/slam/place_recognition/place_verifier.hpp"
#include "hm/slam/pose_graph/pose_graph_3d_solver.hpp"
#include "hm/slam/rgbd/corrected_keyframes.hpp"
#include "hm/slam/rgbd/keyframe_surfaces.hpp"
#include "hm/slam/rgbd/rgbd_loop_params.hpp"

namespace hm {

/// The comparison of a keyframe with one of another map that most features agreed on.
struct BestMapMatch {
  int inliers = 0;  ///< 0: none had any
  PlaceOutcome outcome = PlaceOutcome::kFewMatches;
  Time stamp;  ///< of the newer keyframe
};

/// Outcomes of the candidates. `candidates` is the sum of accepted, waiting and the rejected below.
struct RgbdLoopStatistics {
  std::size_t candidates = 0;         ///< compared with their keyframe
  std::size_t accepted = 0;           ///< their features are linked
  std::size_t redundant = 0;          ///< of the accepted: no edges, the graph is more certain
  std::size_t waiting = 0;            ///< not yet confirmed by another loop
  std::size_t not_verified = 0;       ///< no motion explains enough matches
  std::size_t too_far = 0;            ///< further off than odometry can be
  std::size_t ambiguous = 0;          ///< another place, or another motion, explains as much
  std::size_t unconfirmed = 0;        ///< no other loop agreed in time
  std::size_t removed = 0;            ///< of the accepted: the solved graph contradicts them
  std::size_t submaps = 0, maps = 0;  ///< seen; left apart after connecting
  std::size_t solutions = 0;
  BestMapMatch best_of_other_map;
};

/// Result of adding one keyframe.
struct RgbdLoopStep {
  std::size_t node = 0;
  int candidates = 0;
  int loops = 0;        ///< edges added, waiting ones that became confirmed included
  bool solved = false;  ///< poses have changed
};

/// Report of the last solution and adjustment.
struct RgbdAlignmentReport {
  PoseGraphSolution graph;
  bool adjusted = false;  ///< bundle adjustment ran and its result is used
  /// Bundle adjustment ran, and depth images of different visits contradict its result: poses are those of
  /// the graph with surface factors.
  bool refused = false;
  /// Surfaces of different visits with the adjusted poses, and (`other`) with those of the graph with surface
  /// factors; no views: nothing was compared.
  SurfaceAgreement agreement;
  DisparityOffset disparity;      ///< found by the same surfaces; nothing is corrected by it
  FocalLengthCheck focal_length;  ///< the same
  /// Reason why bundle adjustment failed; empty: it did not, or was not wanted.
  std::string failure;
  bool interrupted = false;             ///< asked to stop: as far as it had come
  std::size_t observations_behind = 0;  ///< dropped: their landmark is behind their camera
  /// Matches of features between pairs of keyframes: of loops, and of other visits of their places.
  std::size_t loop_links = 0, visit_links = 0;
  std::size_t landmarks = 0, observations = 0;
  double error_before_px = 0, error_after_px = 0;  ///< reprojection, median
  /// Any part of it was.
  [[nodiscard]] bool was_stopped() const {
    return interrupted || disparity.interrupted || focal_length.interrupted;
  }
};

/// Corrects the drift of RGB-D odometry (dissertation 3.3): keyframes are nodes of a pose graph; places seen
/// again are found by their features, verified by geometry and against what odometry allows, and become
/// robust edges; submaps that a loop connects become one map. `odom` is only read. The first keyframe stays.
///
/// add() does all its work before it returns: results depend on the keyframes and their order alone. For live
/// use see LiveRgbdLoopCloser. Not thread safe.
class RgbdLoopCloser {
 public:
  /// The camera must be free of lens distortion.
  explicit RgbdLoopCloser(const PinholeCamera& camera, const RgbdLoopParams& params = {});
  ~RgbdLoopCloser();
  RgbdLoopCloser(RgbdLoopCloser&&) noexcept;
  RgbdLoopCloser& operator=(RgbdLoopCloser&&) noexcept;

  /// The next keyframe. Stamps increase; submaps never decrease. The keyframe is kept.
  RgbdLoopStep add(std::shared_ptr<const Keyframe> keyframe);
  /// Solves the graph a last time, then adjusts keyframes and landmarks together if the parameters say so.
  /// The adjustment is refused where the depth images say that features mislead it (RgbdLoopParams::
  /// kMaxSurfaceCostRatio); without depth images, or with over 5,000 keyframes, it is not judged. More
  /// keyframes may follow. Asked to stop it keeps what the adjustment has found by then.
  RgbdAlignmentReport finish(const RunContext& run = {}, const KeyframeDepths& depths = {});

  /// Poses as of the last solution; keyframes since are carried along.
  [[nodiscard]] CorrectedKeyframes corrected() const;
  [[nodiscard]] SE3 T_map_odom() const;
  [[nodiscard]] const PoseGraph3D& graph() const;
  [[nodiscard]] RgbdLoopStatistics statistics() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
