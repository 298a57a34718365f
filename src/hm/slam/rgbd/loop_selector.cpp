#include "hm/slam/rgbd/loop_selector.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <utility>

namespace hm {
namespace {

/// A rival counts when it is within twice the deviations that a loop is allowed.
constexpr double kRivalGateFactor = 4;

SE3 between(const KeyframeGraph& graph, std::size_t a, std::size_t b) {
  return graph.graph().T_map_node[a].inverse() * graph.graph().T_map_node[b];
}

/// [translation; rotation vector] of what b is beyond a.
Vec6 apart(const SE3& a, const SE3& b) {
  PoseEdge3D edge;
  edge.T_from_to = a;
  return pose_edge_error(edge, SE3(), b);
}

template <class Items, class Node>
std::vector<std::size_t> nodes_of(const Items& items, const Node& node) {
  std::vector<std::size_t> nodes;
  for (const auto& item : items) nodes.push_back(node(item));
  return nodes;
}

double chi2_of(const Vec6& error, const Mat6& covariance) { return error.dot(covariance.llt().solve(error)); }

}  // namespace

Mat6 LoopSelector::with_drift(const SeenUncertainty& seen) const {
  Mat6 covariance = seen.covariance;
  const double drift_m = params_.kGateDriftRatio * seen.path_m,
               drift_rad = params_.kGateDrift_rad_m * seen.path_m;
  covariance.diagonal().head<3>().array() += drift_m * drift_m;
  covariance.diagonal().tail<3>().array() += drift_rad * drift_rad;
  return covariance;
}

std::vector<LoopSelector::Rated> LoopSelector::against_odometry(const KeyframeGraph& graph,
                                                                std::vector<LoopProposal> proposals) const {
  const std::size_t node = proposals.front().to;
  const std::vector<SeenUncertainty> seen_from_node =
      graph.uncertainties_seen_from(node, nodes_of(proposals, [](const LoopProposal& p) { return p.from; }));
  std::vector<Rated> rated;
  for (std::size_t i = 0; i < proposals.size(); ++i) {
    Rated one{std::move(proposals[i]), 0, true};
    const std::size_t from = one.proposal.from;
    if (const SeenUncertainty& seen = seen_from_node[i]; seen.reached) {
      const SE3 T_from_node = between(graph, from, node);
      const Vec6 error = apart(T_from_node, one.proposal.match.T_a_b);
      const Mat6 expected = inverse_covariance(T_from_node.inverse(), with_drift(seen));
      one.proposal.information_gain_ratio =
          one.proposal.match.covariance.llt()
              .solve(inverse_covariance(T_from_node.inverse(), seen.covariance))
              .trace() /
          6;
      one.chi2 = chi2_of(error, expected + one.proposal.match.covariance);
      one.is_large = error.head<3>().norm() > params_.kLargeCorrection_m ||
                     error.tail<3>().norm() > params_.kLargeCorrection_rad;
    }
    rated.push_back(std::move(one));
  }
  return rated;
}

/// Leaves the proposals that agree with the best one, or none when another place rivals it.
void LoopSelector::drop_rivals(const KeyframeGraph& graph, std::vector<Rated>& rated,
                               LoopDecision& decision) const {
  const auto is_better = [this](const Rated& a, const Rated& b) {
    const bool a_near = a.chi2 <= params_.kGateChi2, b_near = b.chi2 <= params_.kGateChi2;
    return a_near != b_near ? a_near : a.proposal.match.inliers > b.proposal.match.inliers;
  };
  const LoopProposal best = std::min_element(rated.begin(), rated.end(), is_better)->proposal;
  const std::vector<SeenUncertainty> seen = graph.uncertainties_seen_from(
      best.from, nodes_of(rated, [](const Rated& one) { return one.proposal.from; }));
  std::vector<Rated> agreeing;
  bool has_rival = false;
  for (std::size_t i = 0; i < rated.size(); ++i) {
    Rated& one = rated[i];
    const LoopProposal& p = one.proposal;
    double chi2 = 0;
    if (p.from != best.from && seen[i].reached) {
      const SE3 by_loops = best.match.T_a_b * p.match.T_a_b.inverse();
      const Mat6 loops = compose_covariance(best.match.covariance, p.match.T_a_b.inverse(),
                                            inverse_covariance(p.match.T_a_b, p.match.covariance));
      chi2 = chi2_of(apart(between(graph, best.from, p.from), by_loops), with_drift(seen[i]) + loops);
    }
    const bool agrees = chi2 <= params_.kGateChi2;
    if (agrees && one.chi2 <= params_.kGateChi2) {
      agreeing.push_back(std::move(one));
      continue;
    }
    const bool is_possible = one.chi2 <= kRivalGateFactor * params_.kGateChi2;
    if (!agrees && is_possible && p.match.inliers >= RgbdLoopParams::kRivalRatio * best.match.inliers)
      has_rival = true;
    ++(one.chi2 > params_.kGateChi2 ? decision.too_far : decision.ambiguous);
  }
  if (has_rival) {
    decision.ambiguous += agreeing.size();
    agreeing.clear();
  }
  rated = std::move(agreeing);
}

void LoopSelector::confirm(const KeyframeGraph& graph, std::vector<Rated> rated, LoopDecision& decision) {
  const std::vector<std::size_t> waiting_from = nodes_of(waiting_, [](const auto& w) { return w.from; });
  const std::vector<std::size_t> waiting_to = nodes_of(waiting_, [](const auto& w) { return w.to; });
  std::vector<SeenUncertainty> seen_from_node;
  std::vector<bool> confirmed(waiting_.size(), false);
  std::vector<LoopProposal> still_waiting;
  for (Rated& one : rated) {
    const LoopProposal& p = one.proposal;
    bool is_confirmed = !one.is_large;
    const std::vector<SeenUncertainty> seen_from = graph.uncertainties_seen_from(p.from, waiting_from);
    if (seen_from_node.empty()) seen_from_node = graph.uncertainties_seen_from(p.to, waiting_to);
    for (std::size_t w = 0; w < waiting_.size(); ++w) {
      const LoopProposal& other = waiting_[w];
      if (other.to == p.to || !seen_from[w].reached || !seen_from_node[w].reached) continue;
      // From p.from to other.to: by way of the loop p, and by way of the other loop.
      const SE3 T_to_to = between(graph, p.to, other.to), T_from_from = between(graph, p.from, other.from);
      const SE3 by_p = p.match.T_a_b * T_to_to, by_other = T_from_from * other.match.T_a_b;
      const Mat6 covariance =
          compose_covariance(p.match.covariance, T_to_to, with_drift(seen_from_node[w])) +
          compose_covariance(with_drift(seen_from[w]), other.match.T_a_b, other.match.covariance);
      if (chi2_of(apart(by_p, by_other), covariance) > params_.kGateChi2) continue;
      confirmed[w] = true;
      is_confirmed = true;
    }
    (is_confirmed ? decision.accepted : still_waiting).push_back(std::move(one.proposal));
  }
  for (std::size_t w = 0; w < confirmed.size(); ++w)
    (confirmed[w] ? decision.accepted : still_waiting).push_back(std::move(waiting_[w]));
  waiting_ = std::move(still_waiting);
}

LoopDecision LoopSelector::update(const KeyframeGraph& graph, std::vector<LoopProposal> proposals) {
  LoopDecision decision;
  if (!proposals.empty()) {
    std::vector<Rated> rated = against_odometry(graph, std::move(proposals));
    drop_rivals(graph, rated, decision);
    confirm(graph, std::move(rated), decision);
  }
  const auto is_old = [&](const LoopProposal& p) {
    return p.to + static_cast<std::size_t>(params_.kMaxWaitingKeyframes) < graph.size();
  };
  decision.unconfirmed = static_cast<std::size_t>(std::count_if(waiting_.begin(), waiting_.end(), is_old));
  std::erase_if(waiting_, is_old);
  return decision;
}

}  // namespace hm
