#include "hm/slam/laser/loop_revision.hpp"

#include <algorithm>
#include <functional>
#include <iterator>
#include <optional>
#include <span>
#include <utility>

#include "hm/slam/laser/loop_consistency.hpp"
#include "hm/slam/laser/scan_visits.hpp"

namespace hm {
namespace {

/// How much worse a contradicted point is than one that agrees is good, and by how many points a map must be
/// better to be taken.
constexpr double kContradictedWeight = 3, kLeastGain = 300;
/// Share of contradicted points of a window of so many places on either side.
constexpr double kContradicted = 0.25;
constexpr std::size_t kBeside = 2;
/// Keyframes around contradicted ones that are searched again, and those within which a loop leads there.
constexpr std::size_t kSearchAround = 3, kLeadsThere = 10;
/// Hypotheses that are tried at a time, and in all.
constexpr std::size_t kTrialsAtOnce = 8, kMostTrials = 16;

using Loops = std::vector<PoseEdge2D>;

std::size_t apart(std::size_t i, std::size_t j) { return i > j ? i - j : j - i; }

struct Outcome {
  ScanGraph2D::State state;
  GraphAgreement agreement;
};

Outcome outcome_of(const ScanGraph2D& graph) { return {graph.state(), graph_agreement(graph)}; }

bool is_better(const GraphAgreement& a, const GraphAgreement& b) { return a.score > b.score + kLeastGain; }

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

/// Adds loops to the first group with a member near to the first of them, or else as a group of their own.
template <class IsNear>
void join(std::vector<Loops>& groups, const Loops& loops, const IsNear& is_near) {
  const auto group = std::ranges::find_if(groups, [&](const Loops& members) {
    return std::ranges::any_of(members,
                               [&](const PoseEdge2D& member) { return is_near(member, loops.front()); });
  });
  if (group == groups.end())
    groups.push_back(loops);
  else
    group->insert(group->end(), loops.begin(), loops.end());
}

/// Loops that stand or fall together: those between the same two stretches of the path that say the same, and
/// all of those that lead to the same earlier stretch.
std::vector<Loops> hypotheses(const ScanGraph2D& graph) {
  std::vector<Loops> groups, to_one;
  for (const PoseEdge2D& edge : graph.graph().edges)
    if (edge.kind == PoseEdgeKind::kLoop)
      join(groups, {edge}, [&](const PoseEdge2D& a, const PoseEdge2D& b) {
        return same_hypothesis(a, b, graph.keyframes());
      });
  for (const Loops& loops : groups)
    join(to_one, loops,
         [](const PoseEdge2D& a, const PoseEdge2D& b) { return apart(a.from, b.from) <= kReachOfAgreement; });
  std::erase_if(to_one, [&](const Loops& loops) {
    return std::ranges::any_of(groups, [&](const Loops& group) {
      return group.size() == loops.size() && group.front().from == loops.front().from &&
             group.front().to == loops.front().to;
    });
  });
  std::ranges::move(to_one, std::back_inserter(groups));
  return groups;
}

/// The hypotheses that lead to contradicted places, those that lead to most of them first.
std::vector<Loops> suspects(const ScanGraph2D& graph, std::span<const std::size_t> contradicted) {
  std::vector<std::pair<std::ptrdiff_t, Loops>> found;
  for (Loops& loops : hypotheses(graph)) {
    const auto leads_there = [&](std::size_t node) {
      return std::ranges::any_of(loops, [&](const PoseEdge2D& loop) {
        return apart(node, loop.from) <= kLeadsThere || apart(node, loop.to) <= kLeadsThere;
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

/// The graph without a hypothesis, with other loops in its place where that alone is no better.
Outcome without(ScanGraph2D& graph, const Outcome& now, const Loops& loops) {
  graph.restore(now.state);
  graph.take_out(loops);
  graph.optimise();
  Outcome then = outcome_of(graph);
  if (is_better(then.agreement, now.agreement)) return then;
  std::vector<std::size_t> nodes = then.agreement.contradicted;
  for (const PoseEdge2D& loop : loops) nodes.push_back(loop.to);
  if (graph.search_again(around(nodes, kSearchAround, graph.size()), loops) == 0) return then;
  graph.optimise();
  return outcome_of(graph);
}

Outcome searched_again(ScanGraph2D& graph, const Outcome& now) {
  if (graph.search_again(around(now.agreement.contradicted, kSearchAround, graph.size())) == 0) return now;
  graph.optimise();
  return outcome_of(graph);
}

}  // namespace

GraphAgreement graph_agreement(const ScanGraph2D& graph) {
  ScanVisits visits;
  std::vector<Time> stamps;
  for (std::size_t node = 0; node < graph.size(); ++node) {
    visits.add(graph.keyframe(node).scan, graph.keyframe(node).T_odom_base, 0);
    stamps.push_back(graph.keyframe(node).scan.stamp);
  }
  const std::vector<VisitAgreement> places = visits.compare(
      [&](Time stamp, const SE2& T_odom_base) { return *graph.T_map_base(stamp, T_odom_base); });
  GraphAgreement result;
  for (std::size_t i = 0; i < places.size(); ++i) {
    result.score += static_cast<double>(places[i].agrees) -
                    kContradictedWeight * static_cast<double>(places[i].seen_through);
    ScanAgreement window;
    for (std::size_t j = i - std::min(i, kBeside); j < std::min(places.size(), i + kBeside + 1); ++j) {
      window.agrees += places[j].agrees;
      window.seen_through += places[j].seen_through;
    }
    if (window.contradicted_ratio() > kContradicted)
      result.contradicted.push_back(
          static_cast<std::size_t>(std::ranges::lower_bound(stamps, places[i].stamp) - stamps.begin()));
  }
  return result;
}

LoopRevision revise_loops(ScanGraph2D& graph) {
  LoopRevision revision;
  Outcome now = outcome_of(graph);
  const auto keep = [&](Outcome&& then) {
    now = std::move(then);
    ++revision.changes;
  };
  for (bool changed = true; changed && !now.agreement.contradicted.empty();) {
    const std::size_t before = revision.changes;
    if (Outcome then = searched_again(graph, now); is_better(then.agreement, now.agreement))
      keep(std::move(then));
    graph.restore(now.state);
    std::optional<Outcome> best;
    std::vector<Loops> tried = suspects(graph, now.agreement.contradicted);
    tried.resize(std::min({tried.size(), kTrialsAtOnce, kMostTrials - revision.trials}));
    for (const Loops& loops : tried) {
      ++revision.trials;
      Outcome then = without(graph, now, loops);
      if (is_better(then.agreement, best ? best->agreement : now.agreement)) best = std::move(then);
    }
    if (best) keep(std::move(*best));
    graph.restore(now.state);
    changed = revision.changes > before;
  }
  return revision;
}

}  // namespace hm
