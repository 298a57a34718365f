#pragma once
#include <array>
#include <string>
#include <vector>

#include "flags/serve_flags.hpp"
#include "hm/pipeline/flight/mission/flight_mission.hpp"
#include "program.hpp"

/// Options of `hm fly`; the last ones belong to one mission each.
struct FlyFlags {
  OutputFlags output;
  ServeFlags serve;
  std::string world = "house", autopilot = "core", firmware = "build/firmware/flight.elf";
  std::vector<std::string> faults;
  int seed = -1;
  bool realtime = false;
  std::string mavlink;      ///< way to a ground station; empty: none
  std::string mavlink_key;  ///< file with the key that signs; empty: none
  std::string file;
  std::array<double, 3> goal{};
  double height_m = 1.3, duration_s = 20;

  /// Adds the options that all missions have.
  void add_to(Command command);
  /// Mission of these options, before --params and --set. Errors: kUsage for a fault that there is not and
  /// for a key without MAVLink; the key's file.
  [[nodiscard]] hm::Result<hm::FlightMissionOptions> mission(const std::string& name,
                                                             hm::FlightScript script) const;
};
