#include <unistd.h>

#include <memory>
#include <string>
#include <utility>

#include "flags/fly_flags.hpp"
#include "hm/link/transport/transport_url.hpp"
#include "hm/pipeline/flight/mission/flight_mission.hpp"

namespace {

constexpr const char* kOnStop = "the vehicle lands, then the results are written";

hm::Result<Outcome> outcome_of_flight(const hm::Result<hm::FlightSummary>& summary) {
  auto outcome = outcome_of(summary);
  if (!outcome) return outcome;
  if (std::string mishap = mishap_of(*summary); !mishap.empty())
    outcome->failure = hm::Error{hm::ErrorCode::kNoResult, std::move(mishap), {}};
  return outcome;
}

hm::Result<Outcome> fly(const FlyFlags& flags, const std::string& name, hm::FlightScript script,
                        Session& session, hm::LiveLines* live = nullptr) {
  auto options = flags.mission(name, std::move(script));
  if (!options) return hm::forward_error(options);
  options->live = live;
  options->realtime |= live != nullptr;
  auto list = hm::list_flight_mission(options->parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  std::unique_ptr<hm::Transport> ground_station;
  if (!flags.mavlink.empty()) {
    auto opened = hm::open_transport(flags.mavlink);
    if (!opened) return hm::forward_error(opened);
    ground_station = std::move(*opened);
    options->ground_station = ground_station.get();
  }
  options->run = session.interruptible_context(kOnStop);
  std::optional<hm::PagePilot> pilot;
  if (flags.serve.is_wanted) pilot.emplace();
  auto serving = flags.serve.open({.verb = "fly",
                                   .name = name,
                                   .pilot = pilot ? &*pilot : nullptr,
                                   .report_to_come = options->output / "report.html"},
                                  list, options->run);
  if (!serving) return hm::forward_error(serving);
  if (pilot) {
    hm::Station& station = serving->session()->station();
    pilot->connect([&station](std::uint64_t sequence, bool accepted,
                              const std::string& reason) { station.answer(sequence, accepted, reason); },
                   serving->view());
    options->page = &*pilot;
    options->realtime = true;
  }
  const auto summary = hm::fly_mission(*options);
  serving->finish(summary);
  return outcome_of_flight(summary);
}

hm::Result<Outcome> fly_live(const FlyFlags& flags, Session& session) {
  hm::LiveLines lines(STDIN_FILENO);
  return fly(flags, "teleop", {}, session, &lines);
}

/// A mission whose script stands in a file, and how that is read.
struct FileMission {
  const char *name, *about, *example, *help;
  hm::Result<hm::FlightScript> (*read)(const std::filesystem::path& path);
};
void add_file_mission(Program& program, const std::shared_ptr<FlyFlags>& flags, const FileMission& mission) {
  const auto run = [flags, mission](Session& session) -> hm::Result<Outcome> {
    const auto script = mission.read(flags->file);
    if (!script) return hm::forward_error(script);
    return fly(*flags, fmt::format("{} {}", mission.name, flags->file), *script, session);
  };
  Command command = program.add({fmt::format("fly {}", mission.name), mission.about, mission.example, run});
  command.add_option("file", flags->file, mission.help).required();
  flags->add_to(command);
}

void add_hover(Program& program, const std::shared_ptr<FlyFlags>& flags) {
  const auto run = [flags](Session& session) {
    const auto duration = hm::Duration::from_seconds(flags->duration_s);
    return fly(*flags, "hover", hm::hover_script(flags->height_m, duration), session);
  };
  Command hover = program.add({"fly hover", "Take off, hover, land.",
                               "  hm fly hover -o hovered\n"
                               "  hm fly hover -o gust --duration 8 --fault \"gust at 6 for 2\"",
                               run});
  hover.add_option("--height", flags->height_m, "metres above the place (default: 1.3)").within(0.2, 100.0);
  hover.add_option("--duration", flags->duration_s, "seconds (default: 20)").within(0.001, 86400.0);
  flags->add_to(hover);
}

void add_go(Program& program, const std::shared_ptr<FlyFlags>& flags) {
  const auto run = [flags](Session& session) {
    return fly(*flags, "go", hm::go_to_script({flags->goal[0], flags->goal[1], flags->goal[2]}), session);
  };
  Command go = program.add({"fly go", "Fly to a place, metres from the start: forward, left, up; then land.",
                            "  hm fly go 3 0 1.2 -o there", run});
  for (std::size_t k = 0; k < 3; ++k)
    go.add_option(std::string(1, "xyz"[k]), flags->goal[k], "metres").required().within(-1000.0, 1000.0);
  flags->add_to(go);
}

void add_fly(Program& program) {
  const auto flags = std::make_shared<FlyFlags>();
  program.add({"fly",
               "Fly a simulated vehicle with a laser in closed loop, by a script or live.",
               "  hm fly hover\n"
               "  hm fly go 3 0 1.2 -o there",
               {}});
  add_hover(program, flags);
  add_file_mission(
      program, flags,
      {"waypoints", "Visit way points: lines x y z [yaw], metres from the start and degrees.",
       "  hm fly waypoints tour.txt -o toured", "text file with a way point a line", hm::read_way_points});
  add_go(program, flags);
  add_file_mission(
      program, flags,
      {"script", "Fly a script: takeoff, goto, step, velocity, wait, hold, return, land, estop, fault.",
       "  hm fly script tour.fly -o scripted", "text file with an order a line", hm::read_flight_script});
  Command teleop = program.add({"fly teleop",
                                "Fly live, in real time, by lines of a script on standard input; `now hold` "
                                "takes the place of what runs.",
                                "  printf 'takeoff 0.5\\nland\\n' | hm fly teleop -o live",
                                [flags](Session& session) { return fly_live(*flags, session); }});
  flags->add_to(teleop);
  program.add_parameters([] { return hm::make_parameter_part(hm::list_flight_mission); });
}

const VerbRegistration kFly(75, add_fly);

}  // namespace
