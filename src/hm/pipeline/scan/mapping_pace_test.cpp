#include "hm/pipeline/scan/mapping_pace.hpp"

#include <gtest/gtest.h>

namespace hm {
namespace {

/// A camera at 30 Hz before a machine that needs so long to track and to map a frame.
struct Machine {
  double track_ms = 10, keyframe_ms = 0, map_ms = 15;
  MappingPace pace;
  double now_ms = 0;
  std::size_t frames = 0, mapped = 0;
  double latency_ms = 0;  ///< of the last frame

  static MappingPace::Clock::time_point at(double ms) {
    return MappingPace::Clock::time_point(std::chrono::microseconds(static_cast<long>(1000 * ms)));
  }
  void frame() {
    constexpr double kPeriod_ms = 33;
    const double received_ms = kPeriod_ms * static_cast<double>(frames++);
    now_ms = std::max(now_ms, received_ms);
    pace.begin(at(received_ms));
    now_ms += track_ms;
    pace.pose_known(at(now_ms));
    now_ms += keyframe_ms;
    const bool is_waiting = now_ms >= kPeriod_ms * static_cast<double>(frames);
    const bool is_mapped = !pace.is_late(is_waiting ? 1 : 0, at(now_ms));
    if (is_mapped) now_ms += map_ms;
    mapped += is_mapped ? 1 : 0;
    latency_ms = pace.end(true, is_mapped, at(now_ms));
  }
};

TEST(MappingPace, AFastMachineMapsEveryFrame) {
  Machine machine;
  for (int i = 0; i < 100; ++i) machine.frame();
  EXPECT_EQ(machine.mapped, 100u);
  EXPECT_NEAR(machine.latency_ms, 10, 1e-9);
}

TEST(MappingPace, AFrameThatTookLongIsNotMappedAndTheNextOneIsInTime) {
  Machine machine;
  for (int i = 0; i < 50; ++i) machine.frame();
  machine.track_ms = 25;  // leaves 8 ms until the next frame
  machine.frame();
  EXPECT_EQ(machine.mapped, 50u);
  machine.track_ms = 10;
  machine.frame();
  EXPECT_NEAR(machine.latency_ms, 10, 1e-9);
  EXPECT_EQ(machine.mapped, 51u);
}

TEST(MappingPace, ASlowMachineMapsEveryThirdFrameAndKeepsUp) {
  Machine machine;
  machine.track_ms = 15;
  machine.map_ms = 40;
  double worst_ms = 0;
  for (int i = 0; i < 300; ++i) {
    machine.frame();
    worst_ms = std::max(worst_ms, machine.latency_ms);
  }
  EXPECT_NEAR(static_cast<double>(machine.mapped), 100, 2);
  EXPECT_LT(worst_ms, 40);
}

TEST(MappingPace, AKeyframeHasItsPoseBeforeTheModelIsExtendedAndLeavesLessTimeToMap) {
  Machine machine;
  for (int i = 0; i < 50; ++i) machine.frame();
  machine.keyframe_ms = 15;  // leaves 8 ms until the next frame
  machine.frame();
  EXPECT_NEAR(machine.latency_ms, 10, 1e-9);
  EXPECT_EQ(machine.mapped, 50u);
}

TEST(MappingPace, AFrameWithoutPoseTakesUntilThatIsKnown) {
  MappingPace pace;
  pace.begin(Machine::at(5));
  EXPECT_NEAR(pace.end(false, false, Machine::at(35)), 30, 1e-9);
}

}  // namespace
}  // namespace hm
