#pragma once
#include <cstddef>
#include <limits>
#include <vector>

#include "hm/slam/place_recognition/place_verifier.hpp"
#include "hm/slam/rgbd/keyframe_graph.hpp"
#include "hm/slam/rgbd/rgbd_loop_params.hpp"

namespace hm {

/// A keyframe that verify_place found to show the same place as the newest one.
struct LoopProposal {
  std::size_t from = 0, to = 0;  ///< nodes: the older, the newer
  PlaceMatch match;
  /// Ratio of the graph's variance of the motion to the loop's, mean over its directions; infinite between
  /// maps.
  double information_gain_ratio = std::numeric_limits<double>::infinity();
};

/// Decision on the proposals of a keyframe.
struct LoopDecision {
  std::vector<LoopProposal> accepted;  ///< may hold earlier ones that are confirmed now
  std::size_t too_far = 0, ambiguous = 0, unconfirmed = 0;
};

/// Selects the loops that become part of the graph, so that no place is taken for another that looks the
/// same:
/// 1. a loop must be where odometry allows it (uncertainty along the graph, and systematic drift);
/// 2. no other place within twice that may explain nearly as many features of the keyframe;
/// 3. a large correction, or the connection of two maps, waits until a loop of another keyframe agrees with
/// it
///    along the odometry between them.
/// The time of an update does not grow with the graph (PathUncertainty). Deterministic; not thread safe.
class LoopSelector {
 public:
  explicit LoopSelector(const RgbdLoopParams& params) : params_(params) {}

  /// Decides on all proposals of the newest node at once. To be called for every keyframe, also without any:
  /// loops wait for a number of keyframes.
  LoopDecision update(const KeyframeGraph& graph, std::vector<LoopProposal> proposals);
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

 private:
  struct Rated {
    LoopProposal proposal;
    double chi2 = 0;        ///< against odometry; 0 between maps
    bool is_large = false;  ///< needs to be confirmed
  };
  [[nodiscard]] std::vector<Rated> against_odometry(const KeyframeGraph& graph,
                                                    std::vector<LoopProposal> proposals) const;
  void drop_rivals(const KeyframeGraph& graph, std::vector<Rated>& rated, LoopDecision& decision) const;
  void confirm(const KeyframeGraph& graph, std::vector<Rated> rated, LoopDecision& decision);
  [[nodiscard]] Mat6 with_drift(const SeenUncertainty& seen) const;

  RgbdLoopParams params_;
  std::vector<LoopProposal> waiting_;
};

}  // namespace hm
