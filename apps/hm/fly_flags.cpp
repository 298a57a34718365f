#include "fly_flags.hpp"

#include <algorithm>
#include <iterator>

#include "hm/pipeline/flight/emulated_board.hpp"

namespace {

hm::Result<std::unique_ptr<hm::FlightCore>> start_board(const hm::FlightRunParams& parameters,
                                                        const std::string& image) {
  if (const auto checked = hm::check_default_core(parameters); !checked) return hm::forward_error(checked);
  auto board = hm::EmulatedBoard::start({image});
  if (!board) return hm::forward_error(board);
  return std::unique_ptr<hm::FlightCore>(std::move(*board));
}

hm::Result<void> add_faults(const std::vector<std::string>& texts, hm::FlightScript& script) {
  for (const std::string& text : texts) {
    const auto fault = hm::parse_flight_line("fault " + text, "--fault");
    if (!fault) return hm::forward_error(fault);
    script.faults.push_back(std::get<hm::ScriptedFault>(*fault));
  }
  return {};
}

}  // namespace

void FlyFlags::add_to(CLI::App& command) {
  output.add_to(command, "MISSION_flight, FILE_flight");
  command.add_option("--world", world, "house, room or corridor (default: house)")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(hm::kWorldKindNames), std::end(hm::kWorldKindNames))));
  command
      .add_option(
          "--autopilot", autopilot,
          "who flies: core, the autopilot of this library (default), or qemu, the same as firmware on an "
          "emulated board, in lock-step")
      ->check(CLI::IsMember({"core", "qemu"}));
  command
      .add_option("--firmware", firmware,
                  "with --autopilot qemu: its image (default: build/firmware/flight.elf)")
      ->type_name("FILE");
  command.add_option("--seed", seed, "seed of all random numbers (default: 1)")
      ->check(CLI::NonNegativeNumber);
  command
      .add_option("--fault", faults,
                  "let something fail, seconds since the start: \"laser_off at 12 for 2\" (repeatable)")
      ->take_all()
      ->allow_extra_args(false);
  command.add_option("--mavlink", mavlink,
                     "fly in real time beside a ground station, which sees the vehicle and may fly it: "
                     "udp:127.0.0.1:14550 (QGroundControl), udp:listen:PORT, serial:DEVICE:BAUD");
  command.add_flag("--realtime", realtime, "fly no faster than the clock on the wall");
}

hm::Result<hm::FlightMissionOptions> FlyFlags::mission(const std::string& name,
                                                       hm::FlightScript script) const {
  if (const auto added = add_faults(faults, script); !added) return hm::forward_error(added);
  hm::FlightMissionOptions options;
  options.mission = name;
  options.script = std::move(script);
  const auto named = std::ranges::find(hm::kWorldKindNames, world);  // add_to() admits no other
  start_in(static_cast<hm::WorldKind>(named - std::begin(hm::kWorldKindNames)),
           options.parameters.flight.run);
  if (seed >= 0) options.parameters.flight.run.seed = seed;
  options.realtime = realtime || !mavlink.empty();
  if (autopilot == "qemu")
    options.make_core = [image = firmware](const hm::FlightRunParams& parameters) {
      return start_board(parameters, image);
    };
  options.output = output.folder(file.empty() ? name : file, "flight");
  options.existing = output.existing();
  return options;
}
