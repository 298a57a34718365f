#include "hm/slam/laser/loop_revision.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "hm/slam/laser/laser_loop_closer.hpp"
#include "hm/slam/laser/loop_consistency.hpp"
#include "hm/slam/laser/testing/drifting_drive.hpp"

namespace hm {
namespace {

using namespace laser_testing;

using Edges = std::vector<PoseEdge2D>;

Edges loops_of(const ScanGraph2D& graph) {
  Edges loops;
  for (const PoseEdge2D& edge : graph.graph().edges)
    if (edge.kind == PoseEdgeKind::kLoop) loops.push_back(edge);
  return loops;
}

/// The second round through an office's corridor, its loops closed.
class LoopRevisionTest : public testing::Test {
 protected:
  LoopRevisionTest() = default;
  ~LoopRevisionTest() override {
    const ScanGraphStatistics& counts = graph_.statistics();
    EXPECT_EQ(counts.candidates, counts.accepted + counts.no_match + counts.ambiguous + counts.limit_reached +
                                     counts.not_verified + counts.alone);
  }
  LoopRevisionTest(const LoopRevisionTest&) = delete;
  LoopRevisionTest& operator=(const LoopRevisionTest&) = delete;
  /// Puts loops into the graph as a search that was misled would have done.
  void add(const Edges& loops) {
    ScanGraph2D::State state = graph_.state();
    for (const PoseEdge2D& loop : loops) {
      state.graph.edges.push_back(loop);
      state.paths.add_edge(loop);
    }
    graph_.restore(state);
    graph_.optimise();
  }
  /// A run of loops that all say that the second round passes `shift` beside the first.
  [[nodiscard]] Edges wrong_loops(std::size_t first_to, std::size_t count, const Vec2& shift) const {
    Edges loops;
    for (std::size_t to = first_to; to < first_to + count; ++to) {
      const std::size_t from = to - 83;
      const SE2 true_motion = run_.truth[from].inverse() * run_.truth[to];
      loops.push_back({from, to, SE2(true_motion.translation() + shift, true_motion.angle()),
                       Mat3(Vec3(1e4, 1e4, 1e5).asDiagonal()), PoseEdgeKind::kLoop});
    }
    return loops;
  }
  [[nodiscard]] double error_m(const PoseEdge2D& loop) const {
    const SE2 true_motion = run_.truth[loop.from].inverse() * run_.truth[loop.to];
    return (true_motion.translation() - loop.T_from_to.translation()).norm();
  }
  [[nodiscard]] double worst_loop_m() const {
    double worst = 0;
    for (const PoseEdge2D& loop : loops_of(graph_)) worst = std::max(worst, error_m(loop));
    return worst;
  }

  TestDrive run_ = drive(office_world(), two_rounds(), kDriveLaser);
  ScanGraph2D graph_ = closed_graph(run_);
};

TEST_F(LoopRevisionTest, LeavesAMapThatAgreesWithItselfAlone) {
  const GraphAgreement agreement = graph_agreement(graph_);
  EXPECT_TRUE(agreement.contradicted.empty());
  EXPECT_GT(agreement.score, 10'000);
  const PoseGraph2D before = graph_.graph();
  const LoopRevision revision = revise_loops(graph_);
  EXPECT_EQ(revision.trials, 0U);
  EXPECT_EQ(revision.changes, 0U);
  ASSERT_EQ(graph_.graph().edges.size(), before.edges.size());
  for (std::size_t i = 0; i < graph_.size(); ++i)
    EXPECT_EQ(graph_.graph().T_map_node[i].vector(), before.T_map_node[i].vector());
}

/// Wrong loops that agree with each other, in place of the right ones of that stretch.
TEST_F(LoopRevisionTest, TakesLoopsToALookAlikePlaceOut) {
  Edges replaced = loops_of(graph_);
  std::erase_if(replaced, [](const PoseEdge2D& loop) { return loop.to < 95 || loop.to > 125; });
  graph_.take_out(replaced);
  const std::size_t removed = graph_.statistics().removed;
  EXPECT_EQ(removed, replaced.size());
  const Edges wrong = wrong_loops(102, 12, {0, 1.2});
  add(wrong);
  ASSERT_GT(worst_loop_m(), 1.1);
  EXPECT_FALSE(graph_agreement(graph_).contradicted.empty());
  const LoopRevision revision = revise_loops(graph_);
  EXPECT_GE(revision.changes, 1U);
  EXPECT_LT(worst_loop_m(), 0.1);
  EXPECT_TRUE(graph_agreement(graph_).contradicted.empty());
  EXPECT_GE(graph_.statistics().removed, removed + wrong.size());
  // The right ones are found in their place.
  EXPECT_TRUE(std::ranges::any_of(loops_of(graph_),
                                  [](const PoseEdge2D& loop) { return loop.to > 101 && loop.to < 114; }));
}

/// Loops that were missed are found when the whole drive is known.
TEST_F(LoopRevisionTest, SearchesContradictedPlacesAgain) {
  const double agreed = graph_agreement(graph_).score;
  Edges missed = loops_of(graph_);
  std::erase_if(missed, [](const PoseEdge2D& loop) { return loop.to < 100; });
  graph_.take_out(missed);
  graph_.optimise();
  ASSERT_FALSE(graph_agreement(graph_).contradicted.empty());
  EXPECT_GE(revise_loops(graph_).changes, 1U);
  EXPECT_TRUE(graph_agreement(graph_).contradicted.empty());
  EXPECT_GT(graph_agreement(graph_).score, 0.9 * agreed);
  EXPECT_LT(worst_loop_m(), 0.1);
}

/// Hypotheses, right and wrong: leaving some out is nowhere better than what the revision finds.
TEST_F(LoopRevisionTest, IsAsGoodAsEveryChoiceOfHypotheses) {
  Edges all = loops_of(graph_);
  graph_.take_out(all);
  std::vector<Edges> hypotheses;
  const auto right = [&](std::size_t first_to, std::size_t end_to) {
    Edges loops = all;
    std::erase_if(loops, [&](const PoseEdge2D& loop) { return loop.to < first_to || loop.to >= end_to; });
    hypotheses.push_back(loops);
  };
  right(84, 88);
  hypotheses.push_back(wrong_loops(96, 6, {0, 1.0}));
  hypotheses.push_back(wrong_loops(104, 6, {-0.8, 0.6}));
  right(118, 121);
  right(128, 134);
  for (const Edges& loops : hypotheses) {
    ASSERT_FALSE(loops.empty());
    add(loops);
  }
  const ScanGraph2D::State begin = graph_.state();
  double best = graph_agreement(graph_).score;
  const double at_first = best;
  for (unsigned choice = 0; choice < 1U << hypotheses.size(); ++choice) {
    graph_.restore(begin);
    for (std::size_t k = 0; k < hypotheses.size(); ++k)
      if ((choice >> k) % 2 != 0) graph_.take_out(hypotheses[k]);
    graph_.optimise();
    best = std::max(best, graph_agreement(graph_).score);
  }
  EXPECT_GT(best, at_first + 1000);
  graph_.restore(begin);
  revise_loops(graph_);
  EXPECT_GE(graph_agreement(graph_).score, best - 300);
  EXPECT_LT(worst_loop_m(), 0.1);
}

TEST_F(LoopRevisionTest, SameBitsEveryTime) {
  graph_.take_out(loops_of(graph_));
  add(wrong_loops(102, 12, {0, 1.2}));
  const ScanGraph2D::State begin = graph_.state();
  EXPECT_GE(revise_loops(graph_).changes, 1U);
  const PoseGraph2D once = graph_.graph();
  graph_.restore(begin);
  revise_loops(graph_);
  ASSERT_EQ(graph_.graph().edges.size(), once.edges.size());
  for (std::size_t i = 0; i < graph_.size(); ++i)
    EXPECT_EQ(graph_.graph().T_map_node[i].vector(), once.T_map_node[i].vector());
}

/// An excluded hypothesis is not accepted again.
TEST_F(LoopRevisionTest, FindsOtherLoopsThanTheExcludedOnes) {
  const Edges all = loops_of(graph_);
  graph_.take_out(all);
  std::vector<std::size_t> nodes;
  for (std::size_t node = 84; node < graph_.size(); ++node) nodes.push_back(node);
  EXPECT_EQ(graph_.search_again(nodes, all), 0);
  EXPECT_GT(graph_.search_again(nodes), 10);
  for (const PoseEdge2D& loop : loops_of(graph_))
    EXPECT_TRUE(std::ranges::any_of(
        all, [&](const PoseEdge2D& known) { return same_hypothesis(loop, known, graph_.keyframes()); }));
}

TEST(LoopRevision, HasNothingToDoInGraphsWithoutASecondVisit) {
  ScanGraph2D graph;
  EXPECT_EQ(revise_loops(graph).trials, 0U);
  EXPECT_EQ(graph_agreement(graph).score, 0);
  graph.add_keyframe(drive(room_world(), {SE2()}, kDriveLaser).keyframes.front());
  EXPECT_EQ(revise_loops(graph).trials, 0U);
  EXPECT_EQ(graph.size(), 1U);
}

TEST_F(LoopRevisionTest, EndsWhenStopped) {
  graph_.take_out(loops_of(graph_));
  add(wrong_loops(102, 12, {0, 1.2}));
  const PoseGraph2D before = graph_.graph();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(revise_loops(graph_, {.stop = stop.get_token()}).trials, 0U);
  EXPECT_EQ(graph_.graph().edges.size(), before.edges.size());
}

/// The work is bounded, however much is contradicted; what was found until then counts.
TEST_F(LoopRevisionTest, SearchesNoMoreKeyframesThanItsLimit) {
  graph_.take_out(loops_of(graph_));
  add(wrong_loops(102, 12, {0, 1.2}));
  const double before = graph_agreement(graph_).score;
  std::size_t calls = 0;
  const auto progress = [&](const LoopRevision& so_far) { EXPECT_EQ(so_far.searched, calls++); };
  const LoopRevision revision = revise_loops(graph_, {.progress = progress, .limits = {.searched = 40}});
  EXPECT_EQ(revision.searched, 40U);
  EXPECT_EQ(calls, 40U);
  EXPECT_GE(graph_agreement(graph_).score, before);
}

/// A map that is contradicted nearly everywhere is repaired by the loops of every few keyframes.
TEST_F(LoopRevisionTest, RepairsByAChoiceOfTheContradictedKeyframes) {
  graph_.take_out(loops_of(graph_));
  add(wrong_loops(102, 12, {0, 1.2}));
  const std::size_t contradicted = graph_agreement(graph_).contradicted.size();
  ASSERT_GT(contradicted, 30U);
  const LoopRevision revision = revise_loops(graph_, {.limits = {.searched_at_once = contradicted / 3}});
  EXPECT_GE(revision.changes, 1U);
  EXPECT_TRUE(graph_agreement(graph_).contradicted.empty());
  EXPECT_LT(worst_loop_m(), 0.1);
}

/// A search is ended by who waits for it, too.
TEST_F(LoopRevisionTest, EndsWithinASearch) {
  graph_.take_out(loops_of(graph_));
  add(wrong_loops(102, 12, {0, 1.2}));
  std::stop_source stop;
  const auto progress = [&](const LoopRevision& so_far) {
    if (so_far.searched == 5) stop.request_stop();
  };
  EXPECT_LE(revise_loops(graph_, {.stop = stop.get_token(), .progress = progress}).searched, 6U);
}

/// A drive goes on after its loops were revised, as if they had not been.
TEST(LoopRevision, MoreKeyframesCanBeAdded) {
  const TestDrive run = drive(office_world(), two_rounds(), kDriveLaser);
  LaserLoopCloser with, plain;
  for (std::size_t i = 0; i < run.keyframes.size(); ++i) {
    with.add(run.keyframes[i]);
    plain.add(run.keyframes[i]);
    if (i == 60) with.finish();
  }
  EXPECT_EQ(with.revision().changes, 0U);
  with.finish();
  plain.finish();
  ASSERT_EQ(with.graph().graph().edges.size(), plain.graph().graph().edges.size());
  for (std::size_t i = 0; i < run.keyframes.size(); ++i)
    EXPECT_LT(
        (with.graph().graph().T_map_node[i].inverse() * plain.graph().graph().T_map_node[i]).vector().norm(),
        1e-3);
}

}  // namespace
}  // namespace hm
