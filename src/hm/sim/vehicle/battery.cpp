#include "hm/sim/vehicle/battery.hpp"

#include <algorithm>
#include <cmath>

namespace hm {
namespace {

constexpr double kSecondsPerHour = 3600;

}  // namespace

VehicleBattery::VehicleBattery(const BatteryParams& params)
    : params_(params), charge_ratio_(params.initial_charge_ratio), voltage_v_(open_circuit_v(false)) {}

double VehicleBattery::open_circuit_v(bool cell_lost) const {
  if (charge_ratio_ <= 0) return 0;
  const double cell_v = params_.kCellEmpty_v + (params_.kCellFull_v - params_.kCellEmpty_v) * charge_ratio_;
  return (params_.cells - (cell_lost ? 1 : 0)) * cell_v;
}

void VehicleBattery::step(double power_w, double step_s, bool cell_lost) {
  const double open_v = open_circuit_v(cell_lost), resistance = params_.internal_resistance_ohm;
  if (open_v <= 0) {
    current_a_ = voltage_v_ = 0;
    return;
  }
  const double root = std::sqrt(std::max(0.0, open_v * open_v - 4 * resistance * power_w));
  // The smaller root of P = (E - R I) I, in the form that also holds for R = 0.
  current_a_ = std::min(2 * power_w / (open_v + root), resistance > 0 ? open_v / (2 * resistance) : 1e9);
  voltage_v_ = open_v - resistance * current_a_;
  charge_ratio_ =
      std::max(0.0, charge_ratio_ - current_a_ * step_s / (params_.capacity_ah * kSecondsPerHour));
}

double VehicleBattery::voltage_ratio() const { return voltage_v_ / (params_.cells * params_.kCellNominal_v); }

}  // namespace hm
