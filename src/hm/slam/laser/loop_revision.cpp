#include "hm/slam/laser/loop_revision.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "hm/core/statistics.hpp"
#include "hm/slam/laser/loop_consistency.hpp"
#include "hm/slam/laser/scan_visits.hpp"

namespace hm {
namespace {

/// Weight of a contradicted point against one that agrees.
constexpr double kContradictedWeight = 3;
/// Share of contradicted points of a window of so many places on either side.
constexpr double kContradicted = 0.25;
constexpr std::size_t kBeside = 2;
/// Keyframes around contradicted ones that are searched again; a loop leads to a place when it ends so near.
constexpr std::size_t kSearchAround = 3, kLeadsThere = 10;
/// Hypotheses that are tried at a time.
constexpr std::size_t kTrialsAtOnce = 8;

using Loops = std::vector<PoseEdge2D>;

struct Outcome {
  ScanGraph2D::State state;
  GraphAgreement agreement;
};

/// By more than one place shows on average.
bool is_better(const GraphAgreement& a, const GraphAgreement& b) {
  return a.score > b.score + b.points_per_place;
}

ScanVisits visits_of(const ScanGraph2D& graph) {
  ScanVisits visits;
  for (const GraphKeyframe2D& keyframe : graph.keyframes())
    visits.add(keyframe.scan, keyframe.T_odom_base, keyframe.height_m);
  return visits;
}

GraphAgreement agreement_of(const ScanVisits& visits, const ScanGraph2D& graph) {
  const std::vector<VisitAgreement> places = visits.compare(
      [&](Time stamp, const SE2& T_odom_base) { return *graph.T_map_base(stamp, T_odom_base); });
  const auto node_at = [keyframes = graph.keyframes()](Time stamp) {
    const auto at = std::ranges::lower_bound(
        keyframes, stamp, {}, [](const GraphKeyframe2D& keyframe) { return keyframe.scan.stamp; });
    return static_cast<std::size_t>(at - keyframes.begin());
  };
  GraphAgreement result;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto agrees = static_cast<double>(places[i].agrees),
               contradicted = static_cast<double>(places[i].seen_through);
    result.score += agrees - kContradictedWeight * contradicted;
    result.points_per_place += (agrees + contradicted) / static_cast<double>(places.size());
    ScanAgreement window;
    for (std::size_t j = i - std::min(i, kBeside); j < std::min(places.size(), i + kBeside + 1); ++j) {
      window.agrees += places[j].agrees;
      window.seen_through += places[j].seen_through;
    }
    if (window.contradicted_ratio() > kContradicted) result.contradicted.push_back(node_at(places[i].stamp));
  }
  return result;
}

/// The keyframes that are at most `reach` from one of these, in order.
std::vector<std::size_t> around(std::span<const std::size_t> nodes, std::size_t reach, std::size_t size) {
  std::vector<bool> near(size);
  for (const std::size_t node : nodes)
    for (std::size_t k = node - std::min(node, reach); k <= std::min(size - 1, node + reach); ++k)
      near[k] = true;
  std::vector<std::size_t> found;
  for (std::size_t k = 0; k < size; ++k)
    if (near[k]) found.push_back(k);
  return found;
}

/// Adds an item to the first group that it belongs to, or else as a group of its own.
template <class Item, class BelongsTo>
void add_to(std::vector<std::vector<Item>>& groups, const Item& item, const BelongsTo& belongs_to) {
  const auto group = std::ranges::find_if(groups, belongs_to);
  if (group == groups.end())
    groups.push_back({item});
  else
    group->push_back(item);
}

/// Groups of loops that are right or wrong together: those of one hypothesis, from keyframe to keyframe, and
/// those of several that begin at the same stretch of the path.
std::vector<Loops> hypotheses(const ScanGraph2D& graph) {
  std::vector<Loops> groups;
  for (const PoseEdge2D& edge : graph.graph().edges)
    if (edge.kind == PoseEdgeKind::kLoop)
      add_to(groups, edge, [&](const Loops& group) {
        return std::ranges::any_of(
            group, [&](const PoseEdge2D& loop) { return same_hypothesis(loop, edge, graph.keyframes()); });
      });
  std::vector<std::vector<Loops>> stretches;
  for (const Loops& group : groups)
    add_to(stretches, group, [&](const std::vector<Loops>& stretch) {
      return keyframes_apart(stretch.front().front().from, group.front().from) <= kReachOfAgreement;
    });
  for (const std::vector<Loops>& stretch : stretches) {
    if (stretch.size() == 1) continue;
    Loops& all = groups.emplace_back();
    for (const Loops& group : stretch) all.insert(all.end(), group.begin(), group.end());
  }
  return groups;
}

/// The hypotheses that lead to contradicted places, those that lead to most of them first.
std::vector<Loops> suspects(const ScanGraph2D& graph, std::span<const std::size_t> contradicted) {
  std::vector<std::pair<std::ptrdiff_t, Loops>> found;
  for (Loops& loops : hypotheses(graph)) {
    const auto leads_there = [&](std::size_t node) {
      return std::ranges::any_of(loops, [&](const PoseEdge2D& loop) {
        return keyframes_apart(node, loop.from) <= kLeadsThere ||
               keyframes_apart(node, loop.to) <= kLeadsThere;
      });
    };
    const auto places = std::ranges::count_if(contradicted, leads_there);
    if (places > 0) found.emplace_back(places, std::move(loops));
  }
  std::ranges::stable_sort(found, std::greater<>(), &std::pair<std::ptrdiff_t, Loops>::first);
  std::vector<Loops> sorted;
  for (auto& [places, loops] : found) sorted.push_back(std::move(loops));
  return sorted;
}

/// Revises the loops of one graph.
class Revision {
 public:
  Revision(ScanGraph2D& graph, const RevisionContext& context)
      : graph_(graph), context_(context), visits_(visits_of(graph)), now_(judged()) {}

  LoopRevision run() {
    for (bool changed = true; changed && !now_.agreement.contradicted.empty() && goes_on();) {
      const std::size_t before = result_.changes;
      keep_if_better(with_repeated_search());
      std::optional<Outcome> best;
      std::vector<Loops> tried = suspects(graph_, now_.agreement.contradicted);
      tried.resize(std::min({tried.size(), kTrialsAtOnce, kMostRevisionTrials - result_.trials}));
      for (const Loops& loops : tried) {
        if (!goes_on()) break;
        ++result_.trials;
        if (Outcome then = without(loops); !best || then.agreement.score > best->agreement.score)
          best = std::move(then);
      }
      if (best) keep_if_better(std::move(*best));
      changed = result_.changes > before;
    }
    return result_;
  }

 private:
  [[nodiscard]] bool goes_on() const {
    return result_.searched < context_.limits.searched && !context_.stop.stop_requested();
  }
  [[nodiscard]] Outcome judged() const { return {graph_.state(), agreement_of(visits_, graph_)}; }

  /// Leaves the graph in the better of both states.
  void keep_if_better(Outcome&& then) {
    if (is_better(then.agreement, now_.agreement)) {
      now_ = std::move(then);
      ++result_.changes;
    }
    graph_.restore(now_.state);
  }

  /// Searches keyframes around contradicted ones again, and those around the ends of `left_out` loops. Of the
  /// former an even choice, where they are many: neighbours would find loops that agree with theirs. Returns
  /// the number of loops accepted.
  int search_again(std::span<const std::size_t> contradicted, const Loops& left_out = {}) {
    std::vector<std::size_t> ends;
    for (const PoseEdge2D& loop : left_out) ends.push_back(loop.to);
    std::vector<std::size_t> nodes = around(ends, kSearchAround, graph_.size());
    const std::vector<std::size_t> others =
        thinned(around(contradicted, kSearchAround, graph_.size()), context_.limits.searched_at_once);
    nodes.insert(nodes.end(), others.begin(), others.end());
    std::ranges::sort(nodes);
    nodes.erase(std::ranges::unique(nodes).begin(), nodes.end());
    return graph_.search_again(nodes, left_out, [this] {
      if (!goes_on()) return false;
      if (context_.progress) context_.progress(result_);
      ++result_.searched;
      return true;
    });
  }

  Outcome with_repeated_search() {
    if (search_again(now_.agreement.contradicted) == 0) return now_;
    graph_.optimise();
    return judged();
  }

  /// Without a hypothesis, or with other loops in its place where that is better.
  Outcome without(const Loops& loops) {
    graph_.restore(now_.state);
    graph_.take_out(loops);
    graph_.optimise();
    Outcome alone = judged();
    if (search_again(alone.agreement.contradicted, loops) == 0) return alone;
    graph_.optimise();
    Outcome replaced = judged();
    return replaced.agreement.score > alone.agreement.score ? replaced : alone;
  }

  ScanGraph2D& graph_;
  const RevisionContext& context_;
  ScanVisits visits_;
  Outcome now_;
  LoopRevision result_;
};

}  // namespace

GraphAgreement graph_agreement(const ScanGraph2D& graph) { return agreement_of(visits_of(graph), graph); }

LoopRevision revise_loops(ScanGraph2D& graph, const RevisionContext& context) {
  return Revision(graph, context).run();
}

}  // namespace hm
