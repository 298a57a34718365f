#pragma once
#include "hm/sim/vehicle/vehicle_params.hpp"

namespace hm {

/// Battery that delivers a power: open-circuit voltage linear in the charge, with an internal resistance.
/// The current I solves P = (E - R I) I; a power beyond E^2 / 4R is not delivered. An empty battery has no
/// voltage.
class VehicleBattery {
 public:
  explicit VehicleBattery(const BatteryParams& params);

  /// Delivers a power (W) for a time; `cell_lost`: one of the cells gives no voltage meanwhile.
  void step(double power_w, double step_s, bool cell_lost);

  [[nodiscard]] double charge_ratio() const { return charge_ratio_; }
  [[nodiscard]] double current_a() const { return current_a_; }
  /// Voltage at the terminals.
  [[nodiscard]] double voltage_v() const { return voltage_v_; }
  /// Voltage over nominal voltage.
  [[nodiscard]] double voltage_ratio() const;

 private:
  [[nodiscard]] double open_circuit_v(bool cell_lost) const;

  BatteryParams params_;
  double charge_ratio_ = 1, current_a_ = 0, voltage_v_ = 0;
};

}  // namespace hm
