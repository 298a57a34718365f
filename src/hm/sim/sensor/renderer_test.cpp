#include "hm/sim/sensor/renderer.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "hm/sim/world/solids.hpp"

namespace hm {
namespace {

// A limit that the ray caster sets is one of the whole process.
TEST(Renderer, LoopsKeepTheirThreadsWhileOneLives) {
  World world{"box", {}};
  world.parts.push_back({Material{}, {}});
  append_box(world.parts.back().mesh, {1, -1, -1}, {2, 1, 1});
  const Renderer renderer(world);
  std::atomic<int> begun = 0;
  std::atomic<bool> met = true;
  ParallelLoop(2).for_ranges(2, 1, [&](std::size_t, std::size_t) {
    ++begun;
    for (int i = 0; begun < 2 && i < 5000; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (begun < 2) met = false;
  });
  EXPECT_TRUE(met) << "one range began when the other had ended";
}

}  // namespace
}  // namespace hm
