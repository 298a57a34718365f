#include "hm/pipeline/flight/page/flight_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <variant>
#include <vector>

#include "hm/io/bytes/json.hpp"
#include "hm/pipeline/flight/flight_test_support.hpp"
#include "hm/pipeline/live/station_view.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

/// A flight in the house that is shown to viewers.
class ShownFlight : public testing::Test {
 protected:
  ShownFlight() {
    flight_.watched = [this](const FlightMoment&) { shown_.step(flight_.run); };
  }
  [[nodiscard]] std::vector<LiveFrame> frames(LiveKind kind) const {
    std::vector<LiveFrame> all;
    for (const LiveItem& item : store_.items(kind))
      all.push_back(decode_live_payload(kind, *item.payload).value());
    return all;
  }
  [[nodiscard]] std::vector<Eigen::Vector3f> obstacles() const {
    for (const LiveFrame& frame : frames(LiveKind::kScan))
      if (const auto& scan = std::get<ScanFrame>(frame); scan.which == ScanFrame::Which::kObstacles)
        return scan.points_m;
    return {};
  }
  [[nodiscard]] std::vector<Eigen::Vector3f> path(PathFrame::Which which) const {
    for (const LiveFrame& frame : frames(LiveKind::kPath))
      if (const auto& path = std::get<PathFrame>(frame); path.which == which) return path.points_m;
    return {};
  }

  LiveStore store_;
  StationView view_{store_};
  FlightObserver nobody_;
  LaserRunParams laser_;
  FlightView shown_{&view_, nobody_, laser_};
  test::ScriptedFlight flight_{test::in_the_room(), {}, &shown_};
};

TEST_F(ShownFlight, ObstaclesAreShownWhileTheyBrakeIt) {
  ASSERT_TRUE(flight_.take_off(0));
  FlightCommand steer;
  steer.kind = CommandKind::kMode;
  steer.mode = FlightPhase::kVelocity;
  flight_.step(steer);
  FlightCommand forward;
  forward.kind = CommandKind::kVelocity;
  forward.velocity_m_s = {0.8F, 0, 0};
  const auto brakes = [](const FlightMoment& m) { return m.autopilot.safety.has(FailSafe::kObstacleAhead); };
  bool braked = false;
  for (int i = 0; i < 200 && !braked; ++i) {
    flight_.step(forward);
    braked = flight_.seconds_until(brakes, 0.05) >= 0;
    ASSERT_TRUE(braked || obstacles().empty());
  }
  ASSERT_TRUE(braked);
  flight_.run_s(0.1);
  const auto points = obstacles();
  ASSERT_FALSE(points.empty());
  const Vec3 place = flight_.position();
  for (const auto& point : points) {
    const Vec3 way = point.cast<double>() - place;
    EXPECT_GT(way.x(), 0.2) << "before it";
    EXPECT_LT(way.norm(), 3) << "near it";
    EXPECT_NEAR(way.z(), 0, 0.2) << "at its height";
  }
  flight_.run_s(3);
  EXPECT_LT(flight_.now().estimate.velocity_m_s.norm(), 0.1F) << "it has stopped";
  EXPECT_EQ(obstacles(), points) << "what stopped it stays, whatever direction a standing vehicle drifts in";
  steer.mode = FlightPhase::kPosition;
  flight_.step(steer);
  flight_.go_to(0, 0, 1.3);
  flight_.run_s(0.5);
  EXPECT_TRUE(obstacles().empty()) << "it flies elsewhere";
}

TEST_F(ShownFlight, DeviationNumbersAndTruthAreShown) {
  ASSERT_TRUE(flight_.take_off(2));
  view_.flush();
  const auto pose = std::get<PoseFrame>(frames(LiveKind::kPose).front());
  EXPECT_GT(pose.deviation_m, 0.0005F);
  EXPECT_LT(pose.deviation_m, 0.2F);
  const auto statistics =
      parse_json(std::get<JsonFrame>(frames(LiveKind::kStatistics).front()).text, "statistics");
  ASSERT_TRUE(statistics);
  EXPECT_GT(statistics->find("stages")->number_at("match", -1), 0);
  EXPECT_GT(statistics->find("rates")->number_at("perception", -1), 5) << "scans a second";
  EXPECT_GE(statistics->find("counts")->number_at("serial up dropped", -1), 0);
  EXPECT_GT(statistics->find("memory")->number_at("map", -1), 1000);
  EXPECT_GT(statistics->find("memory")->number_at("process", -1), 1e6);
  const auto truth = path(PathFrame::Which::kTruth);
  ASSERT_FALSE(truth.empty());
  EXPECT_LT((truth.back().cast<double>() - flight_.position()).norm(), 0.05);
}

TEST_F(ShownFlight, WayPointsAreThoseOfTheScript) {
  ScriptPilot pilot;
  const auto script = parse_way_points("1 0 1.2\n1 1 1.2\n", "tour");
  ASSERT_TRUE(script);
  for (const FlightOrder& order : script->orders) pilot.add(order);
  shown_.show_way_points(pilot.records());
  EXPECT_THAT(path(PathFrame::Which::kWayPoints),
              testing::ElementsAre(Eigen::Vector3f(1, 0, 1.2F), Eigen::Vector3f(1, 1, 1.2F)));
}

}  // namespace
}  // namespace hm
