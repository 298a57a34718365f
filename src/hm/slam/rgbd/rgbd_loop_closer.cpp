#include "hm/slam/rgbd/rgbd_loop_closer.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <utility>

#include "hm/core/check.hpp"
#include "hm/core/statistics.hpp"
#include "hm/slam/place_recognition/place_search.hpp"
#include "hm/slam/pose_graph/graph_part.hpp"
#include "hm/slam/rgbd/bundle_adjustment.hpp"
#include "hm/slam/rgbd/covisibility_matches.hpp"
#include "hm/slam/rgbd/keyframe_graph.hpp"
#include "hm/slam/rgbd/loop_selector.hpp"

namespace hm {
namespace {

/// Keyframes before a new one whose features are linked with its own, for landmarks.
constexpr std::size_t kLinkedBefore = 3;
// Pairs of visits for each keyframe on average, which bounds the time.
constexpr std::size_t kFactorsPerKeyframe = 4, kComparedPerKeyframe = 8, kCalibratingPerKeyframe = 1;
/// Keyframes of a submap that calibrate depth besides visits: apart enough to see a surface from elsewhere.
constexpr std::uint32_t kCalibratingApart = 4;
// Of more keyframes surfaces would take over half a gigabyte: hours of walking are not judged by depth.
constexpr std::size_t kMostJudgedKeyframes = 5000;

}  // namespace

struct RgbdLoopCloser::Impl {
  PinholeCamera camera;
  RgbdLoopParams params;
  PlaceSearch search;
  KeyframeGraph graph;
  LoopSelector selector;
  RgbdLoopStatistics statistics;
  std::vector<FeatureLink> links;
  int new_loops = 0;
  bool large_correction = false;
  PoseGraphSolution last_solution;
  SolutionWindow window;

  Impl(const PinholeCamera& c, const RgbdLoopParams& p)
      : camera(c), params(p), search(p.search), graph(p), selector(p) {}

  std::vector<LoopProposal> propose(std::size_t node, RgbdLoopStep& step);
  void note_other_map(std::size_t older, std::size_t newer, const PlaceMatch& match);
  void link(std::size_t a, std::size_t b, const PlaceMatch& match);
  void link_with_last(std::size_t node);
  void accept(const std::vector<LoopProposal>& loops);
  void count(const LoopDecision& decision);
  void solve(bool whole);
  [[nodiscard]] std::vector<PlacedKeyframe> placed() const;
  [[nodiscard]] std::vector<FeatureLink> links_of_visits() const;
  [[nodiscard]] std::vector<SE3> poses_by_surfaces(const KeyframeSurfaces& surfaces,
                                                   const std::vector<KeyframePair>& visits) const;
  [[nodiscard]] std::vector<KeyframePair> calibrating_pairs(const std::vector<KeyframePair>& visits) const;
  void judge(std::vector<SE3>& T_map_adjusted, RgbdAlignmentReport& report, const KeyframeDepths& depths,
             const RunContext& run) const;
  void adjust(RgbdAlignmentReport& report, const RunContext& run, const KeyframeDepths& depths);
};

RgbdLoopCloser::RgbdLoopCloser(const PinholeCamera& camera, const RgbdLoopParams& params)
    : impl_(std::make_unique<Impl>(camera, params)) {
  HM_CHECK(camera.distortion.is_zero());
}
RgbdLoopCloser::~RgbdLoopCloser() = default;
RgbdLoopCloser::RgbdLoopCloser(RgbdLoopCloser&&) noexcept = default;
RgbdLoopCloser& RgbdLoopCloser::operator=(RgbdLoopCloser&&) noexcept = default;

/// The candidates that geometry confirms.
std::vector<LoopProposal> RgbdLoopCloser::Impl::propose(std::size_t node, RgbdLoopStep& step) {
  std::vector<LoopProposal> proposals;
  const Keyframe& keyframe = graph.keyframe(node);
  const std::vector<PlaceCandidate> candidates =
      search.candidates(keyframe, static_cast<std::uint32_t>(node));
  for (std::size_t rank = 0; rank < candidates.size(); ++rank) {
    const PlaceCandidate& candidate = candidates[rank];
    ++step.candidates;
    ++statistics.candidates;
    PlaceMatch match =
        verify_candidate(graph.keyframe(candidate.keyframe), keyframe, candidate, rank, params.verifier);
    note_other_map(candidate.keyframe, node, match);
    if (match.is_same_place())
      proposals.push_back({candidate.keyframe, node, std::move(match)});
    else
      ++(match.outcome == PlaceOutcome::kAmbiguous ? statistics.ambiguous : statistics.not_verified);
  }
  return proposals;
}

void RgbdLoopCloser::Impl::note_other_map(std::size_t older, std::size_t newer, const PlaceMatch& match) {
  BestMapMatch& best = statistics.best_of_other_map;
  if (graph.map_of(older) != graph.map_of(newer) && match.inliers > best.inliers)
    best = {match.inliers, match.outcome, graph.keyframe(newer).stamp};
}

void RgbdLoopCloser::Impl::link(std::size_t a, std::size_t b, const PlaceMatch& match) {
  for (const auto& [feature_a, feature_b] : match.pairs)
    links.push_back({static_cast<std::uint32_t>(a), feature_a, static_cast<std::uint32_t>(b), feature_b});
}

/// Links features with those of the keyframes before, where odometry agrees: for methods without landmarks.
void RgbdLoopCloser::Impl::link_with_last(std::size_t node) {
  for (std::size_t back = 1; back <= std::min(node, kLinkedBefore); ++back) {
    const Keyframe &before = graph.keyframe(node - back), &now = graph.keyframe(node);
    if (before.submap != now.submap) break;
    const PlaceMatch match = verify_place(before, now, params.verifier);
    if (!match.is_same_place()) continue;
    const SE3 error = match.T_a_b.inverse() * (before.T_odom_camera.inverse() * now.T_odom_camera);
    if (error.translation().norm() < params.kLargeCorrection_m && error.angle() < params.kLargeCorrection_rad)
      link(node - back, node, match);
  }
}

/// Links the features of accepted loops; those that reduce the uncertainty of the graph become edges.
void RgbdLoopCloser::Impl::accept(const std::vector<LoopProposal>& loops) {
  for (const LoopProposal& loop : loops) {
    link(loop.from, loop.to, loop.match);
    ++statistics.accepted;
    if (loop.information_gain_ratio < params.kMinInformationGainRatio) {
      ++statistics.redundant;
      continue;
    }
    const SE3 error = loop.match.T_a_b.inverse() *
                      (graph.graph().T_map_node[loop.from].inverse() * graph.graph().T_map_node[loop.to]);
    large_correction |= graph.map_of(loop.from) != graph.map_of(loop.to) ||
                        error.translation().norm() > params.kLargeCorrection_m ||
                        error.angle() > params.kLargeCorrection_rad;
    graph.add_loop(
        {loop.from, loop.to, loop.match.T_a_b, loop.match.covariance.inverse(), PoseEdgeKind::kLoop});
    ++new_loops;
  }
}

void RgbdLoopCloser::Impl::count(const LoopDecision& decision) {
  statistics.too_far += decision.too_far;
  statistics.ambiguous += decision.ambiguous;
  statistics.unconfirmed += decision.unconfirmed;
  statistics.waiting = selector.waiting();
}

void RgbdLoopCloser::Impl::solve(bool whole) {
  const KeyframeGraphSolution result = graph.solve(window.next(graph.size(), whole));
  last_solution = result.solution;
  for (const PoseEdge3D& edge : result.removed)
    std::erase_if(links,
                  [&](const FeatureLink& l) { return l.keyframe_a == edge.from && l.keyframe_b == edge.to; });
  statistics.removed += result.removed.size();
  ++statistics.solutions;
  new_loops = 0;
  large_correction = false;
}

RgbdLoopStep RgbdLoopCloser::add(std::shared_ptr<const Keyframe> keyframe) {
  Impl& m = *impl_;
  RgbdLoopStep step;
  step.node = m.graph.add(std::move(keyframe));
  m.large_correction |= m.graph.keyframe(step.node).end_of_drift.has_value();
  if (m.params.bundle_adjustment && m.graph.keyframe(step.node).observations.empty())
    m.link_with_last(step.node);
  if (m.params.enabled) {
    const LoopDecision decision = m.selector.update(m.graph, m.propose(step.node, step));
    m.search.add(m.graph.keyframe(step.node));
    m.accept(decision.accepted);
    m.count(decision);
    step.loops = static_cast<int>(decision.accepted.size());
  }
  step.solved = m.large_correction || m.new_loops >= m.params.kLoopsPerSolution;
  if (step.solved) m.solve(m.large_correction);
  return step;
}

std::vector<PlacedKeyframe> RgbdLoopCloser::Impl::placed() const {
  std::vector<PlacedKeyframe> placed;
  for (std::size_t node = 0; node < graph.size(); ++node)
    placed.push_back({&graph.keyframe(node), graph.graph().T_map_node[node], graph.map_of(node)});
  return placed;
}

/// Links between all visits of a place, besides those of the pairs that loops have compared.
std::vector<FeatureLink> RgbdLoopCloser::Impl::links_of_visits() const {
  std::vector<KeyframePair> linked;
  for (const FeatureLink& link : links)
    if (linked.empty() || linked.back() != KeyframePair(link.keyframe_a, link.keyframe_b))
      linked.emplace_back(link.keyframe_a, link.keyframe_b);
  std::ranges::sort(linked);
  return match_covisible(placed(), camera, params.verifier, linked);
}

/// The graph's poses with relative surface factors between successive keyframes and between visits.
std::vector<SE3> RgbdLoopCloser::Impl::poses_by_surfaces(const KeyframeSurfaces& surfaces,
                                                         const std::vector<KeyframePair>& visits) const {
  PoseGraph3D with_surfaces = graph.graph();
  std::vector<KeyframePair> pairs = thinned(visits, kFactorsPerKeyframe * graph.size());
  for (std::uint32_t node = 1; node < graph.size(); ++node)
    if (graph.keyframe(node).submap == graph.keyframe(node - 1).submap) pairs.emplace_back(node - 1, node);
  for (const auto& [a, b] : pairs) {
    const SE3 T_a_b = graph.graph().T_map_node[a].inverse() * graph.graph().T_map_node[b];
    if (auto factor = surfaces.factor(a, b, T_a_b)) with_surfaces.edges.push_back(std::move(*factor));
  }
  return solve_pose_graph(with_surfaces, params.solver).converged ? with_surfaces.T_map_node
                                                                  : graph.graph().T_map_node;
}

/// Pairs of keyframes that say whether depth is right at all distances.
std::vector<KeyframePair> RgbdLoopCloser::Impl::calibrating_pairs(
    const std::vector<KeyframePair>& visits) const {
  std::vector<KeyframePair> pairs = thinned(visits, kCalibratingPerKeyframe * graph.size());
  for (std::uint32_t node = kCalibratingApart; node < graph.size(); ++node)
    if (graph.keyframe(node).submap == graph.keyframe(node - kCalibratingApart).submap)
      pairs.emplace_back(node - kCalibratingApart, node);
  return pairs;
}

/// Refuses the adjusted poses where the surfaces of different visits agree much better with others, which
/// then replace them: features mislead where colour is not registered to depth exactly.
void RgbdLoopCloser::Impl::judge(std::vector<SE3>& T_map_adjusted, RgbdAlignmentReport& report,
                                 const KeyframeDepths& depths, const RunContext& run) const {
  const std::vector<KeyframePair> visits = pairs_of_visits(placed(), camera);
  if (visits.empty() || graph.size() > kMostJudgedKeyframes) return;
  const KeyframeSurfaces surfaces(camera, graph.keyframes(), depths, run);
  std::vector<SE3> by_surfaces = poses_by_surfaces(surfaces, visits);
  report.agreement =
      surfaces.agreement(thinned(visits, kComparedPerKeyframe * graph.size()), T_map_adjusted, by_surfaces);
  const std::vector<KeyframePair> calibrating = calibrating_pairs(visits);
  report.disparity = surfaces.disparity_offset(calibrating, by_surfaces, run);
  report.focal_length = surfaces.focal_length(calibrating, by_surfaces, run);
  const double cost = report.agreement.cost, other_cost = report.agreement.other_cost;
  report.refused =
      cost > params.kMaxSurfaceCostRatio * other_cost && cost - other_cost > params.kMinSurfaceCostGain;
  if (!report.refused) return;
  T_map_adjusted = std::move(by_surfaces);
}

/// Landmarks and keyframes together; kept when it explains the images better, and depth does not contradict.
void RgbdLoopCloser::Impl::adjust(RgbdAlignmentReport& report, const RunContext& run,
                                  const KeyframeDepths& depths) {
  if (run.stop.stop_requested()) {
    report.interrupted = true;
    return;
  }
  std::vector<const Keyframe*> keyframes;
  for (const auto& keyframe : graph.keyframes()) keyframes.push_back(keyframe.get());
  Bundle bundle{camera, graph.graph().T_map_node, {}, graph.first_nodes(), {}};
  std::vector<FeatureLink> all_links = links;
  if (params.enabled && params.match_covisible) {
    const std::vector<FeatureLink> of_visits = links_of_visits();
    all_links.insert(all_links.end(), of_visits.begin(), of_visits.end());
    report.visit_links = of_visits.size();
  }
  make_landmarks(bundle, keyframes, all_links);
  for (const PoseEdge3D& edge : graph.graph().edges)
    if (edge.kind == PoseEdgeKind::kOdometry) bundle.edges.push_back(edge);
  const BundleResult result = adjust_bundle(bundle, {}, run);
  report.landmarks = bundle.landmarks.size();
  report.observations = result.observations;
  report.observations_behind = result.observations_behind;
  report.interrupted = result.interrupted;
  if (!result.converged && !bundle.landmarks.empty()) report.failure = result.message;
  report.error_before_px = result.error_before_px;
  report.error_after_px = result.error_after_px;
  if (!result.converged || !(result.final_cost < result.initial_cost)) return;
  if (depths.read && !run.stop.stop_requested()) judge(bundle.T_map_camera, report, depths, run);
  report.adjusted = !report.refused;
  graph.set_poses(std::move(bundle.T_map_camera));
}

RgbdAlignmentReport RgbdLoopCloser::finish(const RunContext& run, const KeyframeDepths& depths) {
  RgbdAlignmentReport report;
  if (impl_->graph.size() == 0) return report;
  impl_->solve(true);
  report.graph = impl_->last_solution;
  report.loop_links = impl_->links.size();
  if (impl_->params.bundle_adjustment) impl_->adjust(report, run, depths);
  return report;
}

CorrectedKeyframes RgbdLoopCloser::corrected() const { return impl_->graph.corrected(); }
SE3 RgbdLoopCloser::T_map_odom() const { return impl_->graph.T_map_odom(); }
const PoseGraph3D& RgbdLoopCloser::graph() const { return impl_->graph.graph(); }
RgbdLoopStatistics RgbdLoopCloser::statistics() const {
  RgbdLoopStatistics statistics = impl_->statistics;
  statistics.submaps = static_cast<std::size_t>(impl_->graph.submaps());
  statistics.maps = impl_->graph.first_nodes().size();
  return statistics;
}

}  // namespace hm
