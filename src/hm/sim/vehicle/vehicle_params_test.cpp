#include "hm/sim/vehicle/vehicle_params.hpp"

#include <gtest/gtest.h>

#include <set>

namespace hm {
namespace {

TEST(VehicleParams, AreListedOnceAndWithinTheirRanges) {
  VehicleParams params;
  ParamList list;
  list.add("vehicle", params);
  EXPECT_TRUE(list.check());
  std::set<std::string> names;
  for (const ParamRef& param : list.all()) {
    EXPECT_TRUE(names.insert(param.name).second) << param.name;
    EXPECT_FALSE(param.help.empty()) << param.name;
  }
  ASSERT_TRUE(list.set("vehicle.inner_loop=first-order"));
  EXPECT_EQ(params.inner_loop.inner_loop, InnerLoopKind::kFirstOrder);
  ASSERT_TRUE(list.set("vehicle.mass_kg=2"));
  EXPECT_EQ(params.airframe.mass_kg, 2);
  EXPECT_FALSE(list.set("vehicle.mass_kg=-1"));
  params.airframe.mass_kg = -1;
  EXPECT_FALSE(list.check());
}

TEST(VehicleParams, PerfectOnesHaveNoDisturbance) {
  VehicleParams params;
  params.make_perfect();
  EXPECT_EQ(params.rotor.thrust_mismatch_ratio + params.rotor.thrust_noise_ratio, 0);
  EXPECT_EQ(params.wind.turbulence_m_s + params.wind.gust_m_s, 0);
  EXPECT_EQ(params.airframe.com_offset_m, 0);
  EXPECT_EQ(params.vibration.vibration_m_s2 + params.vibration.vibration_rad_s, 0);
  EXPECT_EQ(params.vibration.imu_misalignment_rad, 0);
  EXPECT_GT(params.rotor.kDragConstant_n_s2_m, 0);
}

}  // namespace
}  // namespace hm
