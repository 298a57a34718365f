#include "hm/control/cascade.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "hm/control/testing/quadrotor_body.hpp"

namespace hm {
namespace {

constexpr FlightModes kAllPosition{AxisMode::kPosition, AxisMode::kPosition, AxisMode::kPosition};
constexpr FlightModes kAllDirect{AxisMode::kDirect, AxisMode::kDirect, AxisMode::kDirect};

[[maybe_unused]] CascadeCommand go_to(float x, float y, float z, float yaw = 0) {
  CascadeCommand command;
  command.modes = kAllPosition;
  command.goal.position_m = {x, y, z};
  command.goal.yaw_rad = yaw;
  return command;
}

[[maybe_unused]] RpytCommand hovering() { return {0, 0, 0, 0.4849F}; }

TEST(Cascade, Probe) {
  using Inner = QuadrotorBodySettings::InnerLoop;
  for (Inner inner : {Inner::kRotors, Inner::kSecondOrder, Inner::kFirstOrder})
    for (double mass : {1.})
      for (int delay : {0, 40, 80})
        for (double lag : {1., 4.})
          for (int axis : {0, 2}) {
            CascadeParams params;
            if (inner != Inner::kRotors) {
              params.output = CascadeOutputKind::kAttitudeThrust;
              if (lag > 1) continue;
              params.tilt_response_s = inner == Inner::kSecondOrder ? .133F : .257F;
              params.thrust_response_s = .05F;
            }
            QuadrotorBodySettings s;
            s.mass_kg *= mass;
            s.delay_steps = delay;
            s.inner = inner;
            s.spin_up_s *= lag;
            s.spin_down_s = lag > 1 ? .05 : .025;
            QuadrotorBody body(s);
            Cascade cascade(params, QuadrotorModel{});
            cascade.start_from(body.seen(), hovering());
            for (int i = 0; i < 8000; ++i) body.step(cascade.step(body.seen(), go_to(0, 0, 0)));
            const double before = body.position.norm();
            double most = 0, end = 0, other = 0, tail = 0;
            const int o = axis == 0 ? 2 : 0;
            for (int i = 0; i < 10000; ++i) {
              body.step(cascade.step(body.seen(), go_to(axis == 0, 0, axis == 2)));
              most = std::max(most, body.position[axis]);
              other = std::max(other, std::abs(body.position[o]));
              if (std::abs(body.position[axis] - 1) > 0.05) end = i;
              if (i > 9000)
                tail = std::max(tail, (body.position - Eigen::Vector3d(axis == 0, 0, axis == 2)).norm());
            }
            std::printf(
                "in %d mass %g delay %d lag %g axis %d: before %.3f over %.1f %% settle %g ms other %.3f "
                "tail %.4f hover %.3f I %.2f %.2f\n",
                int(inner), mass, delay, lag, axis, before, 100 * most - 100, end, other, tail,
                double(cascade.output().hover_thrust_ratio), double(cascade.integral_m_s2().x()),
                double(cascade.integral_m_s2().z()));
          }
}

}  // namespace
}  // namespace hm
