#include "hm/flight/touchdown_detector.hpp"

#include <cmath>

#include "hm/estimation/filter_math.hpp"

namespace hm {

TouchdownDetector::TouchdownDetector(const TouchdownParams& params)
    : params_(params), after_(duration_of(params.touchdown_after_s)) {}

bool TouchdownDetector::step(Time now, const GroundSigns& signs) {
  const bool sinks = signs.wanted_climb_m_s < 0;
  const bool stands = std::abs(signs.climb_m_s) < params_.touchdown_climb_m_s;
  const bool carried = signs.thrust_per_hover < params_.touchdown_thrust_ratio;
  const bool leans = signs.carried_m_s2 > params_.touchdown_carried_m_s2;
  const bool near = !signs.clearance_m || *signs.clearance_m < params_.touchdown_clearance_m;
  if (!(sinks && ((stands && carried) || (leans && near)))) {
    since_.reset();
    return false;
  }
  if (!since_) since_ = now;
  return now - *since_ >= (near ? after_ : kUnseen);
}

}  // namespace hm
