#pragma once
#include <cstddef>
#include <limits>
#include <vector>

#include "hm/slam/rgbd/keyframe_graph.hpp"
#include "hm/slam/places/place_verifier.hpp"
#include "hm/slam/rgbd/rgbd_loop_params.hpp"

namespace hm {

/// A keyframe that verify_place found to show the same place as the newest one.
struct LoopProposal {
  std::size_t from = 0, to = 0;  ///< nodes: the older, the newer
  PlaceMatch match;
  /// How much more certain the loop is of the motion than the graph was before, as a ratio of variances, mean
  /// over its directions; infinite between maps.
  double news_ratio = std::numeric_limits<double>::infinity();
};

/// What was decided when a keyframe's proposals were heard.
struct LoopVerdict {
  std::vector<LoopProposal> accepted;  ///< may hold earlier ones that are confirmed now
  std::size_t too_far = 0, ambiguous = 0, unconfirmed = 0;
};

/// Decides which loops to believe, so that no place is taken for another that looks the same:
/// 1. a loop must be where odometry allows it (uncertainty along the graph, and systematic drift);
/// 2. no other place within twice that may explain nearly as many features of the keyframe;
/// 3. a large correction, or the connection of two maps, waits until a loop of another keyframe agrees with
/// it
///    along the odometry between them.
/// Deterministic; not thread safe.
class LoopJudge {
 public:
  explicit LoopJudge(const RgbdLoopParams& params) : params_(params) {}

  /// All proposals of the newest node at once; call it for every keyframe, so that time passes.
  LoopVerdict hear(const KeyframeGraph& graph, std::vector<LoopProposal> proposals);
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }

 private:
  struct Heard {
    LoopProposal proposal;
    double chi2 = 0;        ///< against odometry; 0 between maps
    bool is_large = false;  ///< needs to be confirmed
  };
  [[nodiscard]] std::vector<Heard> against_odometry(const KeyframeGraph& graph,
                                                    std::vector<LoopProposal> proposals) const;
  void drop_rivals(const KeyframeGraph& graph, std::vector<Heard>& heard, LoopVerdict& verdict) const;
  void confirm(const KeyframeGraph& graph, std::vector<Heard> heard, LoopVerdict& verdict);
  [[nodiscard]] Mat6 with_drift(const SeenUncertainty& seen) const;

  RgbdLoopParams params_;
  std::vector<LoopProposal> waiting_;
};

}  // namespace hm
