#include "flags/fly_flags.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <span>

#include "hm/core/text/nearest_name.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/link/mavlink_key.hpp"
#include "hm/link/transport/transport_url.hpp"
#include "hm/pipeline/flight/emulated_board.hpp"
#include "hm/pipeline/flight/external/mavlink_autopilot.hpp"

namespace {

hm::Result<std::unique_ptr<hm::FlightCore>> start_board(const hm::FlightRunParams& parameters,
                                                        const std::string& image) {
  if (const auto checked = hm::check_default_core(parameters); !checked) return hm::forward_error(checked);
  auto board = hm::EmulatedBoard::start({image});
  if (!board) return hm::forward_error(board);
  return std::unique_ptr<hm::FlightCore>(std::move(*board));
}

constexpr std::string_view kMavlink = "mavlink:";

hm::Result<std::unique_ptr<hm::FlightCore>> start_external(const hm::FlightRunParams& parameters,
                                                           const std::string& url,
                                                           const std::optional<hm::MavlinkKey>& key) {
  if (parameters.vehicle.inner_loop.inner_loop != hm::InnerLoopKind::kMotors)
    return hm::fail(hm::ErrorCode::kUsage, "vehicle.inner_loop",
                    "an autopilot behind MAVLink turns the motors itself: it needs motors");
  auto transport = hm::open_transport(url);
  if (!transport) return hm::forward_error(transport);
  hm::MavlinkAutopilotSetup setup;
  setup.key = key;
  setup.commands = parameters.autopilot.commands;
  setup.takeoff_height_m = parameters.autopilot.guidance.takeoff_height_m;
  setup.max_rotor_speed_rad_s = static_cast<float>(parameters.vehicle.rotor.max_speed_rad_s);
  return std::unique_ptr<hm::FlightCore>(
      std::make_unique<hm::MavlinkAutopilot>(std::move(*transport), setup));
}

/// A usage error of --world; empty: none.
std::string check_world(const std::string& text) {
  const std::span<const std::string_view> names(hm::kWorldKindNames);
  if (std::ranges::find(names, text) != names.end()) return {};
  return hm::unknown_name("world", text, names);
}

/// A usage error of --autopilot; empty: none.
std::string check_autopilot(const std::string& text) {
  if (text == "core" || text == "qemu" || text.starts_with(kMavlink)) return {};
  return fmt::format("'{}' is neither core, qemu nor mavlink:URL", text);
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

void FlyFlags::add_to(Command command) {
  output.add_to(command, "MISSION_flight, FILE_flight");
  serve.add_to(command);
  command.add_option("--world", world, "house, room or corridor (default: house)").check(check_world);
  command
      .add_option(
          "--autopilot", autopilot,
          "who flies: core, the autopilot of this library (default); qemu, the same as firmware on an "
          "emulated board, in lock-step; or mavlink:URL, another autopilot (PX4), URL as of --mavlink")
      .check(check_autopilot);
  command
      .add_option("--firmware", firmware,
                  "with --autopilot qemu: its image (default: build/firmware/flight.elf)")
      .type_name("FILE");
  command.add_option("--seed", seed, "seed of all random numbers (default: 1)").not_negative();
  command
      .add_option("--fault", faults,
                  "let something fail, seconds since the start: \"laser_off at 12 for 2\" (repeatable)")
      .repeatable();
  command.add_option("--mavlink", mavlink,
                     "fly in real time beside a ground station, which sees the vehicle and may fly it: "
                     "udp:127.0.0.1:14550 (QGroundControl), udp:listen:PORT, serial:DEVICE:BAUD");
  command
      .add_option("--mavlink-key", mavlink_key,
                  "sign MAVLink (--mavlink, --autopilot mavlink:URL) and hear signed frames only: a file "
                  "with 32 bytes or 64 hexadecimal digits")
      .type_name("FILE");
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
  if (!mavlink_key.empty()) {
    if (mavlink.empty() && !autopilot.starts_with(kMavlink))
      return hm::fail(hm::ErrorCode::kUsage, "--mavlink-key", "needs --mavlink or --autopilot mavlink:URL");
    constexpr std::size_t kMostBytes = 4096;
    const auto bytes = hm::read_file_bytes(mavlink_key, kMostBytes);
    if (!bytes) return hm::forward_error(bytes);
    const auto key = hm::parse_mavlink_key(*bytes, mavlink_key);
    if (!key) return hm::forward_error(key);
    options.mavlink_key = *key;
  }
  if (autopilot == "qemu")
    options.make_core = [image = firmware](const hm::FlightRunParams& parameters) {
      return start_board(parameters, image);
    };
  if (autopilot.starts_with(kMavlink))
    options.make_core = [url = autopilot.substr(kMavlink.size()),
                         key = options.mavlink_key](const hm::FlightRunParams& parameters) {
      return start_external(parameters, url, key);
    };
  options.output = output.folder(file.empty() ? name : file, "flight");
  options.existing = output.existing();
  return options;
}
