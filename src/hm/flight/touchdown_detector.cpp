#include "hm/flight/touchdown_detector.hpp"

#include <cmath>

#include "hm/estimation/filter_math.hpp"

namespace hm {
namespace {

/// A landing vehicle that sinks faster is not on the ground: a quarter of the sinking speed of landings.
constexpr float kStands_m_s = 0.1F;
/// Thrust below this share of hover thrust: the ground carries. A gust does not take so much for so long.
constexpr float kCarriedThrustRatio = 0.6F;
/// Duration of these conditions after which the ground is reached (PX4: 350 ms).
constexpr float kAfter_s = 0.35F;
/// A larger known distance of the feet to the ground rules it out.
constexpr float kClearance_m = 0.15F;
/// At a known distance below this the feet are down: less than the full hover thrust is then enough of a
/// sign. (With a weak battery the controller asks for more thrust than before, on the ground too.)
constexpr float kFeetDown_m = 0.05F;
/// Specific force beyond that of the rotors: the ground carries, whatever the speed seems to be.
constexpr float kCarried_m_s2 = 1.5F;

}  // namespace

bool TouchdownDetector::step(Time now, const GroundSigns& signs) {
  const bool sinks = signs.wanted_climb_m_s < 0;
  const bool stands = std::abs(signs.climb_m_s) < kStands_m_s;
  const bool touches = signs.clearance_m && *signs.clearance_m < kFeetDown_m;
  const bool carried = signs.thrust_per_hover < (touches ? 1 : kCarriedThrustRatio);
  const bool leans = signs.carried_m_s2 > kCarried_m_s2;
  const bool near = !signs.clearance_m || *signs.clearance_m < kClearance_m;
  if (!(sinks && ((stands && carried) || (leans && near)))) {
    since_.reset();
    return false;
  }
  if (!since_) since_ = now;
  return now - *since_ >= (near ? duration_of(kAfter_s) : kUnseen);
}

}  // namespace hm
