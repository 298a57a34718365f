#include "hm/pipeline/flight/flight_run.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "hm/flight/trace/core_replay.hpp"
#include "hm/pipeline/flight/flight_test_support.hpp"

namespace hm {
namespace {

using test::ScriptedFlight;

FlightRunParams seeded(int seed) {
  FlightRunParams params;
  params.run.seed = seed;
  return params;
}

/// Distance from the place where the flight hovers, largest so far.
struct HoverError {
  double xy_m = 0, z_m = 0;
  void add(const Vec3& error) {
    xy_m = std::max(xy_m, error.head<2>().norm());
    z_m = std::max(z_m, std::abs(error.z()));
  }
};

HoverError hover_error(ScriptedFlight& flight, double seconds) {
  HoverError error;
  const Vec3f goal = flight.now().autopilot.reference.position_m;
  flight.watched = [&](const FlightMoment& m) {
    error.add(m.T_odom_base.translation() - Vec3(0, 0, static_cast<double>(goal.z())));
  };
  flight.run_s(seconds);
  flight.watched = nullptr;
  return error;
}

TEST(FlightRun, HoversInTheHouseAgainstTruth) {
  ScriptedFlight flight;
  ASSERT_TRUE(flight.take_off());
  const HoverError error = hover_error(flight, 10);  // with the gust that begins 10 s after the start
  EXPECT_LT(error.xy_m, 0.08);
  EXPECT_LT(error.z_m, 0.02);
  EXPECT_EQ(flight.now().collisions, 0u);
  for (const StageLatency& stage : flight.run.latencies()) {
    EXPECT_GT(stage.latency_s.count, 300u) << stage.stage;
    EXPECT_LT(stage.latency_s.max, 0.06) << stage.stage;
  }
  for (const StageCounts& stage : flight.run.counts()) {
    EXPECT_GT(stage.out, 0u) << stage.stage;
    EXPECT_EQ(stage.dropped, 0u) << stage.stage;
  }
}

/// Bits of a flight of 6 s.
std::vector<std::uint64_t> bits_of_flight(int seed) {
  ScriptedFlight flight(seeded(seed));
  std::vector<std::uint64_t> bits;
  flight.watched = [&](const FlightMoment& m) {
    if (m.stamp.ns % 100'000'000 != 0) return;
    for (const double value : m.truth.T_world_base.translation())
      bits.push_back(std::bit_cast<std::uint64_t>(value));
    for (const float value : m.estimate.position_m) bits.push_back(std::bit_cast<std::uint32_t>(value));
  };
  EXPECT_TRUE(flight.take_off(0.2));
  return bits;
}

TEST(FlightRun, TheSameSeedGivesTheSameBits) {
  const std::vector<std::uint64_t> first = bits_of_flight(3);
  EXPECT_GT(first.size(), 200u);
  EXPECT_EQ(first, bits_of_flight(3));
  EXPECT_NE(first, bits_of_flight(4));
}

/// A core that steps another one from the records of a trace, and compares.
class TraceReplay : public FlightObserver {
 public:
  void on_core_step(std::span<const CoreTraceRecord> records) override {
    for (const CoreTraceRecord& record : records) {
      const AutopilotInputs* inputs = reader_.add(decode_core_trace(encode(record)).value());
      if (inputs == nullptr) continue;
      const AutopilotOutputs outputs = core_->step(*inputs);
      ++steps;
      differ += outputs.rotor_speed_rad_s != record.output;
    }
  }
  explicit TraceReplay(const AutopilotParams& params) : core_(make_host_core(params)) {}
  int steps = 0, differ = 0;

 private:
  CoreInputReader reader_;
  std::unique_ptr<FlightCore> core_;
};

TEST(FlightRun, ATraceOfTheCoreReplaysItsMotorCommands) {
  FlightRunParams params;
  TraceReplay replay(params.autopilot);
  ScriptedFlight flight(params, "fault clock_step at 4 for 1\nfault laser_off at 6 for 0.4", &replay);
  EXPECT_TRUE(flight.take_off(3));
  EXPECT_GT(replay.steps, 6500);
  EXPECT_EQ(replay.differ, 0);
}

TEST(FlightRun, NothingOfTheTruthReachesTheCore) {
  // All sensors end. A core that could see where it is would hover on; this one stops its motors.
  ScriptedFlight flight({}, "fault laser_off at 7 for 60\nfault imu_gap at 7 for 60");
  ASSERT_TRUE(flight.take_off(0));
  flight.run_s(7.2 - flight.run.elapsed().seconds());
  EXPECT_EQ(flight.now().autopilot.state, AutopilotState::kError);
  EXPECT_EQ(flight.now().autopilot.rotor_speed_rad_s, (std::array<float, 4>{}));
  const Vec3f estimate = flight.now().estimate.position_m;
  flight.run_s(2);
  EXPECT_LT(flight.position().z(), 0.4);  // fallen
  EXPECT_EQ(flight.now().estimate.position_m, estimate);
}

TEST(FlightRun, WithoutSensorsFromTheStartItDoesNotTakeOff) {
  ScriptedFlight flight({}, "fault laser_off at 0 for 60\nfault imu_gap at 0 for 60");
  EXPECT_FALSE(flight.take_off(0));
  EXPECT_EQ(flight.last_refusal, Refusal::kNotReady);
  EXPECT_LT(flight.position().z(), kBaseOverGround_m + 0.01);
}

TEST(FlightRun, AMetreTakesTwoSeconds) {
  ScriptedFlight flight;
  ASSERT_TRUE(flight.take_off());
  const double z_m = static_cast<double>(flight.now().autopilot.reference.position_m.z());
  double furthest_m = 0, last_outside_s = 0;
  const Time begin = flight.run.now();
  flight.watched = [&](const FlightMoment& m) {
    const Vec3 p = m.T_odom_base.translation();
    furthest_m = std::max(furthest_m, p.x());
    if ((p.head<2>() - Vec2(1, 0)).norm() > 0.05) last_outside_s = (m.stamp - begin).seconds();
  };
  flight.go_to(1, 0, z_m);
  flight.run_s(4);
  EXPECT_LT(last_outside_s, 2.2);
  EXPECT_LT(furthest_m, 1.05);
}

TEST(FlightRun, PassesADoorThereAndBack) {
  FlightRunParams params;
  params.run.start_x_m = 9.4;  // before the door of the children's room
  params.autopilot.cascade.shaper.speed_m_s = 1;
  ScriptedFlight flight(params);
  ASSERT_TRUE(flight.take_off());
  flight.go_to(0, 2.2, 1.45);
  flight.run_s(4);
  EXPECT_LT((flight.position() - Vec3(0, 2.2, 1.45)).norm(), 0.2);
  flight.go_to(0, 0, 1.45);
  flight.run_s(4);
  EXPECT_LT((flight.position() - Vec3(0, 0, 1.45)).norm(), 0.2);
  EXPECT_EQ(flight.now().collisions, 0u);
  EXPECT_EQ(flight.now().autopilot.phase, FlightPhase::kPosition);
}

}  // namespace
}  // namespace hm
