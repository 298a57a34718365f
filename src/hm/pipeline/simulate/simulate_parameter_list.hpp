#pragma once
#include "hm/core/params.hpp"
#include "hm/sim/recording/laser_simulation.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm {

/// Everything that decides what a simulated recording is like.
struct SimulateParameters {
  SimulationParams simulation;
  LaserSimulationParams laser_simulation;
};

/// Its sections, named as the members.
inline ParamList list_simulation(SimulateParameters& parameters) {
  ParamList list;
  list.add("simulation", parameters.simulation);
  list.add("laser_simulation", parameters.laser_simulation);
  list.add_renamed("simulation.rolling_shutter", "simulation.flaws");
  return list;
}

}  // namespace hm
