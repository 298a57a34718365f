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
  for (float k : {8.F, 12.F, 16.F, 20.F, 25.F})
    for (float kw : {25.F, 40.F, 60.F})
      for (float kd : {0.F, 0.5F, 0.8F})
        for (double lag : {1., 4.}) {
          CascadeParams params;
          params.attitude.tilt_per_s = k;
          params.attitude.rate_xy_per_s = kw;
          params.attitude.damping_xy_ratio = kd;
          QuadrotorBodySettings s;
          s.spin_up_s *= lag;
          s.spin_down_s = lag > 1 ? .05 : .025;
          QuadrotorBody body(s);
          Cascade cascade(params, QuadrotorModel{});
          cascade.start_from(body.seen(), hovering());
          CascadeCommand command;
          command.modes = kAllDirect;
          command.direct = hovering();
          command.direct.roll_rad = 0.349F;
          double t10 = 0, t90 = 0, most = 0, end = 0;
          for (int i = 0; i < 2000; ++i) {
            body.step(cascade.step(body.seen(), command));
            const double r = body.roll() / 0.349;
            if (t10 == 0 && r > .1) t10 = i;
            if (t90 == 0 && r > .9) t90 = i;
            most = std::max(most, r);
            if (std::abs(r - 1) > 0.05) end = i;
          }
          std::printf("k %g kw %g kd %g lag %g: %g ms over %.2f settle %g\n", double(k), double(kw), double(kd),
                      lag, t90 - t10, most, end);
        }
}

}  // namespace
}  // namespace hm
