#include "hm/sim/vehicle/battery.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace hm {
namespace {

/// Time in which a constant power takes the open-circuit voltage from `from_v` to `to_v`:
/// t = Q / k integral(dE / I), 1 / I = (E + sqrt(E^2 - 4 R P)) / 2 P, with E = empty + k q.
double discharge_s(const BatteryParams& p, double power_w, double from_v, double to_v) {
  const double slope_v = p.cells * (p.kCellFull_v - p.kCellEmpty_v);
  const double c2 = 4 * p.internal_resistance_ohm * power_w;
  const auto integral = [&](double e) {
    const double root = std::sqrt(e * e - c2);
    return (e * e / 2 + 0.5 * (e * root - c2 * std::log(e + root))) / (2 * power_w);
  };
  return p.capacity_ah * 3600 / slope_v * (integral(from_v) - integral(to_v));
}

TEST(VehicleBattery, ConstantPowerDischargeFollowsItsClosedForm) {
  const BatteryParams params;
  constexpr double kPower_w = 180;
  VehicleBattery battery(params);
  EXPECT_NEAR(battery.voltage_v(), 12.6, 1e-12);
  for (int second = 1; second <= 900; ++second) {
    for (int i = 0; i < 100; ++i) battery.step(kPower_w, 0.01, false);
    if (second % 300 != 0) continue;
    const double open_v = 10.2 + 2.4 * battery.charge_ratio();
    EXPECT_NEAR(discharge_s(params, kPower_w, 12.6, open_v), second, 0.01);
    EXPECT_NEAR(battery.voltage_v() * battery.current_a(), kPower_w, 1e-3);
    EXPECT_NEAR(battery.voltage_v(), open_v - 0.025 * battery.current_a(), 1e-4);
  }
}

TEST(VehicleBattery, LostCellTakesAThirdOfTheVoltage) {
  const BatteryParams params;
  VehicleBattery battery(params);
  battery.step(0, 1e-3, true);
  EXPECT_NEAR(battery.voltage_v(), 8.4, 1e-12);
  EXPECT_NEAR(battery.voltage_ratio(), 8.4 / 11.1, 1e-12);
  battery.step(0, 1e-3, false);
  EXPECT_NEAR(battery.voltage_v(), 12.6, 1e-12);
}

TEST(VehicleBattery, EmptyBatteryHasNoVoltage) {
  BatteryParams params;
  params.initial_charge_ratio = 1e-4;
  VehicleBattery battery(params);
  for (int i = 0; i < 1000; ++i) battery.step(200, 0.01, false);
  EXPECT_EQ(battery.charge_ratio(), 0);
  EXPECT_EQ(battery.voltage_v(), 0);
  EXPECT_EQ(battery.current_a(), 0);
}

TEST(VehicleBattery, MoreThanTheMaximumPowerIsNotDelivered) {
  VehicleBattery battery({});
  battery.step(1e6, 1e-3, false);
  EXPECT_NEAR(battery.voltage_v(), 6.3, 1e-9);  // half, at E^2 / 4R
  EXPECT_NEAR(battery.current_a(), 12.6 / 0.05, 1e-6);
}

TEST(VehicleBattery, WithoutResistanceTheVoltageHolds) {
  BatteryParams params;
  params.internal_resistance_ohm = 0;
  VehicleBattery battery(params);
  battery.step(126, 1e-3, false);
  EXPECT_NEAR(battery.voltage_v(), 12.6, 1e-12);
  EXPECT_NEAR(battery.current_a(), 10, 1e-12);
}

}  // namespace
}  // namespace hm
