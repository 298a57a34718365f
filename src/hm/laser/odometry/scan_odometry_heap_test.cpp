// hm: compiled alone, as it replaces operator new
#include <gmock/gmock.h>

#include <cstdlib>
#include <new>

#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/laser/testing/planar_world.hpp"

// Counts what is taken from the heap in this program; the address sanitizer has a heap of its own.
#ifdef HM_SANITIZED
constexpr bool kCounting = false;
#else
constexpr bool kCounting = true;
#endif
namespace {
std::size_t taken = 0;
}

#ifndef HM_SANITIZED
void* operator new(std::size_t size) {
  ++taken;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#endif

namespace hm {
namespace {

TEST(ScanOdometryHeap, NothingIsTakenOnceItHasSeenScansOfTheSize) {
  if (!kCounting) GTEST_SKIP() << "the address sanitizer counts for itself";
  const laser_testing::PlanarWorld world = laser_testing::office_world();
  Rng rng(1);
  std::vector<PlanarScan> scans;
  for (int i = 0; i < 200; ++i) {
    laser_testing::TestLaser laser;
    laser.range_sigma_m = 0.02;
    scans.push_back(planar_scan_of_world(world, laser_testing::office_loop(0.035 * i), laser, rng));
    scans.back().stamp = Time::from_seconds(0.025 * i);
  }
  ScanOdometry odometry;
  std::size_t keyframes = 0;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const std::size_t before = taken;
    const OdometryStep step = odometry.process(scans[i]);
    keyframes += step.new_keyframe;
    if (keyframes > 2) {
      EXPECT_EQ(taken, before) << i;
    }
  }
  EXPECT_GT(keyframes, 3U);
}

}  // namespace
}  // namespace hm
