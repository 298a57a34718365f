#include "hm/slam/laser/keyframe_registration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stop_token>
#include <vector>

#include "hm/slam/laser/testing/drifting_drive.hpp"

namespace hm {
namespace {

using namespace laser_testing;

/// The second round through an office's corridor, its loops closed.
class KeyframeRegistrationTest : public testing::Test {
 protected:
  /// Root mean square distance from the true positions, both in the frame of the first keyframe.
  [[nodiscard]] double error_m() const {
    const std::vector<SE2>& T_map = graph_.graph().T_map_node;
    double sum = 0;
    for (std::size_t i = 0; i < T_map.size(); ++i)
      sum += ((T_map[0].inverse() * T_map[i]).translation() -
              (run_.truth[0].inverse() * run_.truth[i]).translation())
                 .squaredNorm();
    return std::sqrt(sum / static_cast<double>(T_map.size()));
  }

  /// Made once in a process.
  struct Made {
    TestDrive run = drive(office_world(), two_rounds(), kDriveLaser);
    ScanGraph2D graph = closed_graph(run);
    ScanGraph2D::State closed = graph.state();
  };
  static Made& made() {
    static Made once;
    return once;
  }
  void SetUp() override { graph_.restore(made().closed); }

  const TestDrive& run_ = made().run;
  ScanGraph2D& graph_ = made().graph;
};

TEST_F(KeyframeRegistrationTest, BringsKeyframesCloserToTheTruth) {
  const double before_m = error_m();
  const KeyframeRegistration found = register_keyframes(graph_);
  EXPECT_GT(found.registered, 5 * graph_.size());
  EXPECT_GE(found.pairs, found.registered);
  EXPECT_LT(found.moved_m, 0.3);
  EXPECT_LT(error_m(), 0.5 * before_m) << before_m;
}

TEST_F(KeyframeRegistrationTest, LeavesEdgesAndStatisticsAsTheyAre) {
  const ScanGraph2D::State before = graph_.state();
  register_keyframes(graph_);
  EXPECT_EQ(graph_.graph().edges.size(), before.graph.edges.size());
  EXPECT_EQ(graph_.statistics().accepted, before.statistics.accepted);
  EXPECT_EQ(graph_.statistics().removed, before.statistics.removed);
  EXPECT_EQ(graph_.graph().T_map_node[0].vector(), before.graph.T_map_node[0].vector());
}

TEST_F(KeyframeRegistrationTest, DoesNotDependOnTheNumberOfThreads) {
  const ScanGraph2D::State before = graph_.state();
  register_keyframes(graph_);
  const std::vector<SE2> once = graph_.graph().T_map_node;
  graph_.restore(before);
  RunContext run;
  run.threads = 3;
  register_keyframes(graph_, run);
  for (std::size_t i = 0; i < once.size(); ++i)
    EXPECT_EQ(graph_.graph().T_map_node[i].vector(), once[i].vector());
}

/// A path that never comes back gains, too: its keyframes see the same walls one after another.
TEST_F(KeyframeRegistrationTest, BringsKeyframesCloserWithoutLoops) {
  std::vector<PoseEdge2D> loops = graph_.graph().edges;
  std::erase_if(loops, [](const PoseEdge2D& edge) { return edge.kind != PoseEdgeKind::kLoop; });
  graph_.take_out(loops);
  const double before_m = error_m();
  EXPECT_GT(register_keyframes(graph_).registered, 0U);
  EXPECT_LT(error_m(), 0.5 * before_m) << before_m;
}

/// Odometry turns too far at each step. Where loops span the path they take that back; without them, it is
/// told.
TEST_F(KeyframeRegistrationTest, TellsATurnThatNoLoopChecks) {
  EXPECT_LT(register_keyframes(graph_).unchecked.angle_rad, 0.01);
  TestDrive straight = run_;
  straight.keyframes.resize(40);
  ScanGraph2D graph;
  for (const GraphKeyframe2D& keyframe : straight.keyframes) graph.add_keyframe(keyframe);
  ASSERT_EQ(graph.statistics().accepted, 0U);
  const UncheckedTurn turn = register_keyframes(graph).unchecked;
  EXPECT_NEAR(turn.angle_rad, 39 * kDriftPerStep_rad, 0.03);
  EXPECT_EQ(turn.from, straight.keyframes.front().scan.stamp);
  EXPECT_GT(turn.to, straight.keyframes[30].scan.stamp);
}

/// A floor above shows other walls at the same place.
TEST_F(KeyframeRegistrationTest, MatchesNoKeyframesOfOtherHeights) {
  TestDrive two_floors = run_;
  for (std::size_t i = run_.keyframes.size() / 2; i < run_.keyframes.size(); ++i)
    two_floors.keyframes[i].height_m = 3;
  ScanGraph2D floors = closed_graph(two_floors);
  const std::size_t pairs = register_keyframes(floors).pairs;
  EXPECT_GT(pairs, 0U);
  EXPECT_LT(pairs, register_keyframes(graph_).pairs);
}

TEST_F(KeyframeRegistrationTest, AStopEndsItWithTheRoundThatIsComplete) {
  const std::vector<SE2> before = graph_.graph().T_map_node;
  std::stop_source stop;
  std::vector<Progress> shown;
  RunContext run;
  run.stop = stop.get_token();
  run.progress = [&](const Progress& progress) {
    shown.push_back(progress);
    if (progress.done >= graph_.size()) stop.request_stop();
  };
  const KeyframeRegistration found = register_keyframes(graph_, run);
  ASSERT_FALSE(shown.empty());
  EXPECT_EQ(shown.back().total, 2 * graph_.size());
  EXPECT_GT(found.registered, 0U);

  ScanGraph2D::State state = graph_.state();
  state.graph.T_map_node = before;
  graph_.restore(state);
  EXPECT_EQ(register_keyframes(graph_, run).registered, 0U) << "a stop that came before it";
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_EQ(graph_.graph().T_map_node[i].vector(), before[i].vector());
}

}  // namespace
}  // namespace hm
