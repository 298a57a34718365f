#include "hm/pipeline/flight/page/page_pilot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>

#include "hm/pipeline/flight/page/straight_way.hpp"

namespace hm {
namespace {

struct Answered {
  bool accepted = false;
  std::string reason;
};

/// A pilot at a page and a vehicle in a room.
class PageFlight : public testing::Test {
 protected:
  PageFlight() : site_(WorldKind::kRoom, 1) {
    FlightRunParams params;
    start_in(WorldKind::kRoom, params.run);
    run_.emplace(site_, params);
    pilot_.connect(
        [this](std::uint64_t sequence, bool accepted, const std::string& reason) {
          answers_[sequence] = {accepted, reason};
        },
        nullptr);
  }
  void step() { run_->step(pilot_.step(run_->moment(), run_->perception().map())); }
  bool fly_until(double limit_s, const std::function<bool()>& done) {
    const Duration end = run_->elapsed() + Duration::from_seconds(limit_s);
    while (run_->elapsed() < end) {
      if (done()) return true;
      step();
    }
    return done();
  }
  void order(const std::string& kind, std::array<double, 3> vector = {}, double yaw = 0) {
    pilot_.take({++sequence_, kind, vector, yaw});
  }
  /// The answer to an order; fails the test when there is none within a second and a half.
  Answered ask(const std::string& kind, std::array<double, 3> vector = {}) {
    order(kind, vector);
    EXPECT_TRUE(fly_until(1.5, [this] { return answers_.count(sequence_) > 0; })) << kind;
    return answers_[sequence_];
  }
  void take_off() {
    ASSERT_TRUE(fly_until(
        10, [this] { return run_->moment().estimate.planar_ready && run_->moment().estimate.height_ready; }));
    fly_until(1.1, [] { return false; });  // it stands still: gyroscopes are calibrated
    const Answered engaged = ask("toggle_engage");
    ASSERT_TRUE(engaged.accepted) << engaged.reason;
    ASSERT_TRUE(fly_until(8, [this] { return run_->moment().autopilot.state == AutopilotState::kIdle; }));
    const Answered up = ask("take_off", {0, 0, 1});
    ASSERT_TRUE(up.accepted) << up.reason;
    ASSERT_TRUE(fly_until(12, [this] { return phase() == FlightPhase::kPosition; }));
  }
  [[nodiscard]] FlightPhase phase() const { return run_->moment().autopilot.phase; }

  FlightSite site_;
  std::optional<FlightRun> run_;
  PagePilot pilot_;
  std::uint64_t sequence_ = 0;
  std::map<std::uint64_t, Answered> answers_;
};

TEST_F(PageFlight, FliesByOrdersAndHoldsWithoutInput) {
  take_off();
  // Velocity while input comes.
  const Vec3f from = run_->moment().estimate.position_m;
  for (int i = 0; i < 10; ++i) {
    order("velocity", {0.4, 0, 0});
    fly_until(0.1, [] { return false; });
  }
  EXPECT_EQ(phase(), FlightPhase::kVelocity);
  EXPECT_GT((run_->moment().estimate.position_m - from).norm(), 0.1F);
  pilot_.hold("no input for 0.3 s");
  EXPECT_TRUE(fly_until(0.1, [this] { return phase() == FlightPhase::kHold; }));
  EXPECT_TRUE(ask("land").accepted);
  EXPECT_TRUE(fly_until(20, [this] { return run_->moment().autopilot.state == AutopilotState::kIdle; }));
  EXPECT_EQ(run_->collisions().size(), 0u);
}

TEST_F(PageFlight, RefusesWithTheReason) {
  const Answered early = ask("take_off", {0, 0, 1});
  EXPECT_FALSE(early.accepted);
  EXPECT_NE(early.reason, "");
  const Answered unknown = ask("loop_the_loop");
  EXPECT_FALSE(unknown.accepted);
  EXPECT_THAT(unknown.reason, testing::HasSubstr("loop_the_loop"));
}

TEST_F(PageFlight, StopsAtOnceInTheAir) {
  take_off();
  order("velocity", {0.3, 0, 0});
  order("e_stop");
  EXPECT_TRUE(fly_until(0.2, [this] { return run_->moment().autopilot.state == AutopilotState::kError; }));
}

TEST_F(PageFlight, GoesToAFreePlaceAndNotThroughAWall) {
  take_off();
  fly_until(3, [] { return false; });  // the map grows
  const Vec3 here = run_->moment().estimate.position_m.cast<double>();
  const Answered far = ask("preview", {here.x() + 30, here.y(), here.z()});
  EXPECT_FALSE(far.accepted);
  EXPECT_THAT(far.reason, testing::AnyOf(testing::HasSubstr("stands in the way"),
                                         testing::HasSubstr("nothing is known")));
  Vec3 goal = here;
  bool found = false;
  for (int direction = 0; direction < 8 && !found; ++direction) {
    goal = here + 0.6 * Vec3(std::cos(direction * 0.785), std::sin(direction * 0.785), 0);
    found = ask("preview", {goal.x(), goal.y(), goal.z()}).accepted;
  }
  ASSERT_TRUE(found);
  ASSERT_TRUE(ask("go_to", {goal.x(), goal.y(), goal.z()}).accepted);
  EXPECT_TRUE(fly_until(
      10, [&] { return (run_->moment().estimate.position_m.cast<double>() - goal).norm() < 0.15; }));
}

TEST_F(PageFlight, GivesControlUpAtTheEnd) {
  take_off();
  pilot_.end();
  EXPECT_TRUE(fly_until(0.5, [this] { return run_->core().failure() == std::nullopt; }));
  const Answered late = ask("land");
  EXPECT_FALSE(late.accepted);
  EXPECT_THAT(late.reason, testing::HasSubstr("the flight ends"));
}

/// A hall of free cells with a wall across it.
MultiVolumeGrid hall() {
  MultiVolumeGrid grid;
  for (int i = -20; i <= 20; ++i)
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3f end(4, 0.05F * static_cast<float>(i), 1);
      for (double x : {0.0, 1.0, 2.0}) grid.insert(std::vector{end}, Eigen::Vector3d(x, 0.05 * i, 1));
    }
  return grid;
}

TEST(StraightWay, IsFreeUpToAWallAndNotBeyondWhatIsKnown) {
  const MultiVolumeGrid grid = hall();
  EXPECT_EQ(straight_way(grid, {0.5, 0, 1}, {2.5, 0, 1}).refusal, "");
  const StraightWay wall = straight_way(grid, {0.5, 0, 1}, {5, 0, 1});
  EXPECT_THAT(wall.refusal, testing::HasSubstr("stands in the way after 3."));
  const StraightWay near_wall = straight_way(grid, {0.5, 0, 1}, {3.9, 0, 1});  // the hull would touch
  EXPECT_NE(near_wall.refusal, "");
  EXPECT_THAT(straight_way(grid, {0.5, 0, 1}, {0.5, 4, 1}).refusal, testing::HasSubstr("nothing is known"));
  EXPECT_NE(straight_way(grid, {0.5, 0, 1}, {1000, 0, 1}).refusal, "");
  EXPECT_NE(straight_way(grid, {0.5, 0, 1}, {std::nan(""), 0, 1}).refusal, "");
  EXPECT_EQ(straight_way(grid, {0.5, 0, 1}, {0.5, 0, 1}).refusal, "");
}

}  // namespace
}  // namespace hm
