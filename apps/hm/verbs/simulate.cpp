#include <memory>

#include "hm/core/text/counted.hpp"
#include "hm/pipeline/simulate/laser_simulation_recording.hpp"
#include "hm/pipeline/simulate/office_recording.hpp"
#include "hm/pipeline/simulate/simulate_parameter_list.hpp"
#include "hm/pipeline/simulate/simulation_recording.hpp"
#include "program.hpp"
#include "verbs/calibration/simulate_calibration.hpp"

namespace {

constexpr std::string_view kLaserMav = "laser_mav", kXtion = "xtion", kLaserRobot = "laser_robot",
                           kLaserRobotShort = "laser_robot_8m";
constexpr double kShortRange_m = 8;
constexpr const char* kStopped = "the unfinished recording is removed";

struct SimulateFlags {
  std::string world = "house", output, sensor;
  int frames = 0, seed = -1;
  double scan_every_m = 1;
  bool drift = false, perfect = false, realistic = false, large = false;
};

template <class Enum, std::size_t N>
void choose(const std::string& name, const std::string_view (&names)[N], Enum& value) {
  for (std::size_t i = 0; i < N; ++i)
    if (name == names[i]) value = static_cast<Enum>(i);
}

std::string output_of(const SimulateFlags& flags) {
  return flags.output.empty() ? flags.world + "_recording" : flags.output;
}

hm::ParamList list_of(hm::FlawSizes& sizes) {
  hm::ParamList list;
  list.add("flaws", sizes);
  return list;
}

hm::JsonValue flaws_json(hm::FlawSizes sizes) {
  hm::JsonValue json = hm::JsonValue::object({});
  const hm::ParamList list = list_of(sizes);  // must outlive the loop
  for (const hm::ParamRef& size : list.all()) {
    const std::string name = size.name.substr(size.name.find('.') + 1);
    if (double* const* number = std::get_if<double*>(&size.value)) json[name] = **number;
    if (int* const* count = std::get_if<int*>(&size.value)) json[name] = **count;
  }
  return json;
}

std::string flaws_text(hm::FlawSizes sizes) {
  std::string text = "it is as a real recording:\n";
  const hm::ParamList list = list_of(sizes);
  for (const hm::ParamRef& size : list.all())
    text += fmt::format("  {:<28}{:>8.6}  {}\n", size.name, hm::value_text(size), size.help);
  if (sizes.flaws.has(hm::Flaw::kWheelSlip)) text += "  poses are those of wheels that slip (poses.txt)\n";
  return text;
}

hm::Result<Outcome> run_camera(const SimulateFlags& flags, Session& session) {
  hm::SimulateParameters parameters;
  hm::SimulationParams& simulation = parameters.simulation;
  choose(flags.world, hm::kWorldKindNames, simulation.world);
  choose(flags.sensor, hm::kSensorPresetNames, simulation.sensor);
  if (flags.frames > 0) simulation.frame_limit = flags.frames;
  if (flags.seed >= 0) simulation.seed = flags.seed;
  if (flags.drift) simulation.pose_drift = true;
  if (flags.perfect) simulation.effects = hm::SensorEffects::none();
  if (flags.realistic) simulation.flaws = "all";
  auto list = hm::list_simulation(parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  const hm::SimulationOptions options{simulation, output_of(flags), session.interruptible_context(kStopped)};
  const auto summary = hm::simulate_recording(options);
  if (!summary) return hm::forward_error(summary);
  Outcome outcome;
  outcome.text = fmt::format("{}: {}, {:.1f} s, path {:.1f} m, {:.0f} m2 of visible surface\n",
                             options.output.string(), hm::counted(summary->frames, "frame"),
                             summary->duration_s, summary->path_length_m, summary->truth_area_m2);
  if (summary->end_drift_m > 0)
    outcome.text += fmt::format("the poses drift: the last one is off by {:.3f} m\n", summary->end_drift_m);
  outcome.json = hm::JsonValue::object({{"frames", summary->frames},
                                        {"duration_s", summary->duration_s},
                                        {"path_length_m", summary->path_length_m},
                                        {"end_drift_m", summary->end_drift_m},
                                        {"valid_ratio", summary->valid_ratio},
                                        {"truth_area_m2", summary->truth_area_m2},
                                        {"truth_points", summary->truth_points},
                                        {"seed", simulation.seed},
                                        {"flaws", flaws_json(summary->flaws)}});
  if (!summary->flaws.flaws.is_empty()) outcome.text += flaws_text(summary->flaws);
  outcome.outputs = summary->outputs;
  return outcome;
}

hm::Result<Outcome> run_laser(const SimulateFlags& flags, Session& session) {
  hm::SimulateParameters parameters;
  hm::LaserSimulationParams& simulation = parameters.laser_simulation;
  choose(flags.world, hm::kWorldKindNames, simulation.world);
  if (flags.frames > 0) simulation.scan_limit = flags.frames;
  if (flags.seed >= 0) simulation.seed = flags.seed;
  if (flags.drift || flags.realistic) simulation.wheel_odometry = true;
  if (flags.perfect) simulation.make_perfect();
  auto list = hm::list_simulation(parameters);
  if (const auto applied = session.apply(list); !applied) return hm::forward_error(applied);
  const hm::LaserSimulationOptions options{simulation, output_of(flags),
                                           session.interruptible_context(kStopped)};
  const auto summary = hm::simulate_laser_recording(options);
  if (!summary) return hm::forward_error(summary);
  Outcome outcome;
  outcome.text = fmt::format("{}: {}, {}, {:.1f} s, path {:.1f} m over surfaces up to {:.2f} m high\n",
                             options.output.string(), hm::counted(summary->scans, "scan"),
                             hm::counted(summary->imu_samples, "IMU sample"), summary->duration_s,
                             summary->path_length_m, summary->highest_floor_m);
  outcome.json = hm::JsonValue::object({{"scans", summary->scans},
                                        {"imu_samples", summary->imu_samples},
                                        {"odometry_readings", summary->odometry_readings},
                                        {"duration_s", summary->duration_s},
                                        {"path_length_m", summary->path_length_m},
                                        {"valid_ratio", summary->valid_ratio},
                                        {"highest_floor_m", summary->highest_floor_m},
                                        {"max_tilt_rad", summary->max_tilt_rad},
                                        {"seed", simulation.seed}});
  outcome.outputs = summary->outputs;
  return outcome;
}

hm::Result<Outcome> run_office(const SimulateFlags& flags, Session& session) {
  hm::OfficeSimulationOptions simulation;
  if (flags.sensor == kLaserRobotShort) simulation.range_max_m = kShortRange_m;
  if (flags.frames > 0) simulation.scan_limit = flags.frames;
  if (flags.seed >= 0) simulation.seed = flags.seed;
  simulation.perfect = flags.perfect;
  if (flags.large) simulation.width_m *= 2, simulation.depth_m *= 2;
  simulation.scan_every_m = flags.scan_every_m;
  hm::ParamList none;
  if (const auto applied = session.apply(none); !applied) return hm::forward_error(applied);
  const hm::OfficeRecordingOptions options{simulation, output_of(flags),
                                           session.interruptible_context(kStopped)};
  const auto summary = hm::simulate_office_recording(options);
  if (!summary) return hm::forward_error(summary);
  Outcome outcome;
  outcome.text = fmt::format("{}: {}, {:.1f} s, path {:.1f} m, by the wheels {:.1f} m\n",
                             options.output.string(), hm::counted(summary->scans, "scan"),
                             summary->duration_s, summary->path_length_m, summary->wheel_path_length_m);
  outcome.json = hm::JsonValue::object({{"scans", summary->scans},
                                        {"duration_s", summary->duration_s},
                                        {"path_length_m", summary->path_length_m},
                                        {"wheel_path_length_m", summary->wheel_path_length_m},
                                        {"valid_ratio", summary->valid_ratio},
                                        {"seed", simulation.seed}});
  outcome.outputs = summary->outputs;
  return outcome;
}

hm::Result<Outcome> run(const SimulateFlags& flags, Session& session) {
  const bool boards = flags.world == "calibration", office = flags.world == "office";
  const bool robot = flags.sensor == kLaserRobot || flags.sensor == kLaserRobotShort;
  if (office != robot && !(office && flags.sensor.empty()))
    return hm::fail(hm::ErrorCode::kUsage, "--sensor", "{}",
                    office ? "the office is for laser_robot and laser_robot_8m"
                           : "a laser_robot drives in the office only");
  if (flags.large && !office)
    return hm::fail(hm::ErrorCode::kUsage, "--large", "only the office has a larger floor");
  if (flags.scan_every_m != 1 && !office)
    return hm::fail(hm::ErrorCode::kUsage, "--scan-every",
                    "only the office's robot scans by the way it drives");
  if (office) return run_office(flags, session);
  if (boards && flags.sensor == kLaserMav)
    return hm::fail(hm::ErrorCode::kUsage, "--sensor", "a laser cannot take images of boards");
  if (!boards && flags.sensor == kXtion)
    return hm::fail(hm::ErrorCode::kUsage, "--sensor", "xtion is available for calibration only");
  if (boards && !simulate_calibration_set) return tl::make_unexpected(not_built("simulate calibration"));
  if (boards)
    return simulate_calibration_set({output_of(flags), flags.sensor, flags.seed, flags.perfect}, session);
  return flags.sensor == kLaserMav ? run_laser(flags, session) : run_camera(flags, session);
}

void add_simulate(Program& program) {
  auto flags = std::make_shared<SimulateFlags>();
  Command command =
      program.add({"simulate", "Generate a recording with exact ground truth.",
                   "  hm simulate room -o recording --frames 40\n"
                   "  hm simulate house -o house --sensor kinect --set simulation.frame_stride=30\n"
                   "  hm simulate house -o flight --sensor laser_mav --set laser_simulation.speed_m_s=1.5\n"
                   "  hm simulate office -o office --seed 3\n"
                   "  hm simulate room -o real --sensor kinect --realistic --frames 60\n"
                   "  hm simulate corridor -o drifting --drift --seed 7 --frames 50\n"
                   "  hm simulate calibration -o boards --set calibration_simulation.depth_images=4",
                   [flags](Session& session) { return run(*flags, session); }});
  command
      .add_option("world", flags->world,
                  "house, room or corridor (default: house), office: a floor for a robot with a laser, or "
                  "calibration: "
                  "images of boards for `hm calibrate`")
      .one_of({"house", "room", "corridor", "office", "calibration"});
  command.add_option("-o,--output", flags->output, "folder to write (default: WORLD_recording)");
  command
      .add_option(
          "--sensor", flags->sensor,
          "hand-held depth camera: tango_tablet (default), tango_phone or kinect; laser_mav: a "
          "quadrotor with "
          "a laser and an IMU; laser_robot (office only, default there): a robot on wheels with a laser of "
          "30 m, laser_robot_8m: of 8 m; xtion (calibration only, default there)")
      .one_of(
          {"tango_tablet", "tango_phone", "kinect", "laser_mav", "laser_robot", "laser_robot_8m", "xtion"});
  command.add_option("--frames", flags->frames, "maximum number of frames or scans (default: the whole path)")
      .above_zero();
  command.add_option("--seed", flags->seed, "seed of all random numbers (default: 1)").not_negative();
  command.add_flag(
      "--drift", flags->drift,
      "let the poses drift like visual-inertial odometry; laser_mav: also record drifting wheel odometry");
  command.add_flag("--large", flags->large, "office: a floor of 120 x 80 m instead of 60 x 40 m");
  command
      .add_option("--scan-every", flags->scan_every_m,
                  "office: metres between two scans (default: 1), and half as many radians on the spot")
      .within(0.01, 1.0);
  const CommandOption perfect =
      command.add_flag("--perfect", flags->perfect, "sensors without noise, bias, delay or missing readings");
  command
      .add_flag("--realistic", flags->realistic,
                "all that real recordings suffer from (simulation.flaws=all), sizes by the seed; laser_mav: "
                "also record drifting wheel odometry; an office always is as real ones")
      .excludes(perfect);
  program.add_parameters([] { return hm::make_parameter_part(hm::list_simulation); });
}

const VerbRegistration kSimulate(30, add_simulate);

}  // namespace
