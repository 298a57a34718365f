// Rows about flying: hovering, steps, way points, speed, memory; each in closed loop, against the truth.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "hm/core/process_memory.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/flight/trace/core_replay.hpp"
#include "hm/pipeline/flight/mission/flight_log.hpp"
#include "hm/sim/world/house_plan.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr int kSeeds = 20;
constexpr double kCm = 100;

int seeds_of(const BenchOptions& options) {
  return options.frame_limit > 0 ? std::min(options.frame_limit, kSeeds) : kSeeds;
}

/// A flight that is over.
struct Flown {
  FlightLog log;
  std::size_t collisions = 0;
  bool landed = false;
};

FlightScript script_of(const std::string& text) { return parse_flight_script(text, "bench").value(); }

Flown fly(const FlightSite& site, const FlightRunParams& params, const FlightScript& script,
          FlightObserver* observer = nullptr, const PilotParams& pilot_params = {}) {
  const FaultSchedule faults(script.faults);
  FlightRun run(site, params, faults, observer);
  ScriptPilot pilot(pilot_params);
  for (const FlightOrder& order : script.orders) pilot.add(order);
  pilot.close();
  Flown flown{FlightLog(faults)};
  while (!pilot.is_over()) {
    run.step(pilot.step(pilot_view(run.moment())));
    flown.log.add(run, pilot);
  }
  flown.collisions = run.collisions().size();
  flown.landed = run.moment().autopilot.state == AutopilotState::kOff && run.moment().feet_down > 2;
  return flown;
}

/// Flies the script with each seed, `change(params, seed)` first.
template <class Change>
std::vector<Flown> fly_seeds(const BenchOptions& options, const FlightScript& script, Change&& change,
                             const PilotParams& pilot = {}) {
  const FlightSite site(WorldKind::kHouse, 1);
  std::vector<Flown> flown(static_cast<std::size_t>(seeds_of(options)));
  ParallelLoop(options.threads).for_ranges(flown.size(), 1, [&](std::size_t i, std::size_t) {
    FlightRunParams params;
    params.run.seed = static_cast<int>(i) + 1;
    change(params, i);
    flown[i] = fly(site, params, script, nullptr, pilot);
  });
  return flown;
}

std::size_t collisions_of(const std::vector<Flown>& flown) {
  std::size_t count = 0;
  for (const Flown& flight : flown) count += flight.collisions + (flight.landed ? 0 : 1);
  return count;
}

/// 95 % of the seeds stay below; infinite if one did not hover.
template <class Get>
double worst_95(const std::vector<Flown>& flown, Get&& get) {
  std::vector<double> values;
  for (const Flown& flight : flown) {
    const auto hover = flight.log.hover();
    values.push_back(hover ? get(*hover) : std::numeric_limits<double>::infinity());
  }
  return quantile(values, 0.95);
}

struct StepResponse {
  double settle_s = 0, overshoot_ratio = 0;
};

/// A step from `from_x` by a metre along x: time until the truth stays within 5 cm, and overshoot.
StepResponse step_response(const FlightLog& log) {
  constexpr double kBand_m = 0.05;
  const WayPointRecord& leg = log.way_points().back();
  StepResponse response;
  for (const FlightSample& sample : log.samples()) {
    if (sample.time_s < leg.begin_s || !sample.goal_m || (*sample.goal_m - leg.goal_m).norm() > 1e-3)
      continue;
    const double off_m = sample.truth.position_m.x() - leg.goal_m.x();
    response.overshoot_ratio = std::max(response.overshoot_ratio, off_m);
    if (std::abs(off_m) > kBand_m) response.settle_s = sample.time_s - leg.begin_s;
  }
  return response;
}

FlightScript step_script() {
  return script_of("takeoff 1.3\ngoto 0 0 1.3 0\nwait 4\ngoto 1 0 1.3 0\nwait 6\nland");
}

/// PX4's default gains of position and velocity (MPC_XY_P, MPC_Z_P, MPC_XY_VEL_P_ACC ...).
void take_px4_gains(FlightRunParams& params) {
  PositionParams& gains = params.autopilot.cascade.position;
  gains.position_xy_per_s = 0.95F, gains.position_z_per_s = 1;
  gains.velocity_xy_per_s = 1.8F, gains.velocity_z_per_s = 4;
  gains.integral_xy_per_s2 = 0.4F, gains.integral_z_per_s2 = 2;
}

StepResponse worst_step(const std::vector<Flown>& flown) {
  std::vector<double> settle_s, overshoot;
  for (const Flown& flight : flown) {
    const StepResponse response = step_response(flight.log);
    settle_s.push_back(response.settle_s);
    overshoot.push_back(response.overshoot_ratio);
  }
  return {quantile(settle_s, 0.95), quantile(overshoot, 0.95)};
}

/// True tilt after an attitude command of 20 degrees: time from 10 to 90 % of it, and overshoot.
struct AttitudeResponse {
  double rise_s = std::numeric_limits<double>::infinity(), overshoot_ratio = 0;
};

/// Hovers, then flies the command for half a second. `pitch`: about y, otherwise about x.
AttitudeResponse attitude_response(const FlightSite& site, const FlightRunParams& params, bool pitch) {
  constexpr double kTilt_rad = 0.349066, kHovering_s = 9, kCommand_s = 0.5;
  FlightRun run(site, params);
  ScriptPilot pilot;
  for (const FlightOrder& order : script_of("takeoff 1.5\nwait 60\nland").orders) pilot.add(order);
  while (run.elapsed().seconds() < kHovering_s) run.step(pilot.step(pilot_view(run.moment())));
  FlightCommand command;
  command.pilot = 1;  // as the script
  command.kind = CommandKind::kMode;
  command.mode = FlightPhase::kDirect;
  AttitudeResponse response;
  std::optional<double> from_10_s;
  const double begin_s = run.elapsed().seconds();
  for (int step = 0; run.elapsed().seconds() - begin_s < kCommand_s; ++step) {
    command.stamp = run.now();
    const FlightMoment& moment = run.step(step % 20 == 0 ? std::optional(command) : std::nullopt);
    command.kind = CommandKind::kDirect;
    command.thrust_ratio = 0.485F;
    (pitch ? command.pitch_rad : command.roll_rad) = static_cast<float>(kTilt_rad);
    const Mat3 rotation = moment.truth.T_world_base.rotation();
    const double angle = pitch ? std::asin(-rotation(2, 0)) : std::atan2(rotation(2, 1), rotation(2, 2));
    const double share = angle / kTilt_rad, now_s = run.elapsed().seconds();
    if (!from_10_s && share > 0.1) from_10_s = now_s;
    if (from_10_s && share > 0.9 && std::isinf(response.rise_s)) response.rise_s = now_s - *from_10_s;
    response.overshoot_ratio = std::max(response.overshoot_ratio, share - 1);
  }
  return response;
}

/// One way in which a vehicle differs from what the autopilot assumes.
struct Variation {
  const char* name;
  void (*change)(FlightRunParams&);
};
constexpr Variation kVariations[] = {
    {"mass +20 %", [](FlightRunParams& p) { p.vehicle.airframe.mass_kg *= 1.2; }},
    {"mass -20 %", [](FlightRunParams& p) { p.vehicle.airframe.mass_kg *= 0.8; }},
    {"motors 50 ms",
     [](FlightRunParams& p) { p.vehicle.rotor.spin_up_s = p.vehicle.rotor.spin_down_s = 0.05; }},
    {"motors 12 ms",
     [](FlightRunParams& p) { p.vehicle.rotor.spin_up_s = p.vehicle.rotor.spin_down_s = 0.012; }},
    {"no delay", [](FlightRunParams& p) { p.links.laser.latency_s = p.run.perception_s = 0; }},
    {"delay 80 ms", [](FlightRunParams& p) { p.links.laser.latency_s = 0.075; }},
    {"second-order attitude loop",
     [](FlightRunParams& p) { p.vehicle.inner_loop.inner_loop = InnerLoopKind::kSecondOrder; }},
    {"first-order attitude loop",
     [](FlightRunParams& p) { p.vehicle.inner_loop.inner_loop = InnerLoopKind::kFirstOrder; }},
};

/// A course through the hallway and the doors of the house, with the origin at the start of a flight.
FlightScript house_course() {
  const FlightRunSettings start;
  std::string text = "takeoff 1.2\n";
  const auto go = [&](double x, double y, double z = 1.2) {
    text += fmt::format("goto {:.3f} {:.3f} {:.3f} 0\n", x - start.start_x_m, y - start.start_y_m, z);
  };
  const auto inside = [](const RoomPlan& room) {
    return room.y1 < kHallCenter_y ? kHallLow_y - 0.9 : kHallHigh_y + 0.9;
  };
  // East along the rooms in the south, back along those in the north: 60 m.
  for (const std::size_t index : {0, 1, 2, 3, 8, 7, 6, 5, 4}) {
    const RoomPlan& room = house_rooms()[index];
    go(room.door_x, kHallCenter_y);
    go(room.door_x, inside(room));
    go(room.door_x, kHallCenter_y);
  }
  go(start.start_x_m, start.start_y_m);
  return script_of(text + "land");
}

double course_m(const FlightScript& course) {
  double length_m = 0;
  Vec3 last = Vec3::Zero();
  for (const FlightOrder& order : course.orders) {
    if (order.kind != FlightOrder::Kind::kGoTo) continue;
    length_m += (order.position_m - last).head<2>().norm();
    last = order.position_m;
  }
  return length_m;
}

/// Keeps the inputs of a core's steps.
class StepInputs : public FlightObserver {
 public:
  void on_core_step(std::span<const CoreTraceRecord> records) override {
    for (const CoreTraceRecord& record : records)
      if (const AutopilotInputs* inputs = reader_.add(record)) steps.push_back(*inputs);
  }
  std::vector<AutopilotInputs> steps;

 private:
  CoreInputReader reader_;
};

}  // namespace

Result<BenchResult> bench_fly_hover(const BenchOptions& options) {
  constexpr double kHover_s = 243;  // the first three seconds do not count
  const auto flown = fly_seeds(options, hover_script(1.3, Duration::from_seconds(kHover_s)),
                               [](FlightRunParams&, std::size_t) {});
  BenchResult result;
  result.rows = {{"fly_hover", worst_95(flown, [](const HoverError& e) { return e.max_xy_m * kCm; }), {}},
                 {"fly_hover_z", worst_95(flown, [](const HoverError& e) { return e.max_z_m * kCm; }), {}},
                 {"fly_hover_collisions", static_cast<double>(collisions_of(flown)), {}}};
  result.details =
      JsonValue::object({{"seeds", flown.size()},
                         {"rms_cm", worst_95(flown, [](const HoverError& e) { return e.rms_m * kCm; })}});
  return result;
}

Result<BenchResult> bench_fly_step(const BenchOptions& options) {
  const auto fly_with = [&](void (*change)(FlightRunParams&)) {
    return worst_step(
        fly_seeds(options, step_script(), [&](FlightRunParams& params, std::size_t) { change(params); }));
  };
  const StepResponse ours = fly_with([](FlightRunParams&) {});
  const StepResponse px4 = fly_with(take_px4_gains);
  const StepResponse author =
      fly_with([](FlightRunParams& params) { params.autopilot.law = ControlLaw::kPublished; });
  BenchResult result;
  result.rows = {{"fly_step", ours.settle_s, px4.settle_s},
                 {"fly_step_overshoot", 100 * ours.overshoot_ratio, 100 * px4.overshoot_ratio},
                 {"fly_step_author", ours.settle_s, author.settle_s},
                 {"fly_step_author_overshoot", 100 * ours.overshoot_ratio, 100 * author.overshoot_ratio}};
  return result;
}

Result<BenchResult> bench_fly_attitude(const BenchOptions& options) {
  const FlightSite site(WorldKind::kHouse, 1);
  std::vector<double> rise_s(2 * static_cast<std::size_t>(seeds_of(options))), overshoot(rise_s.size());
  ParallelLoop(options.threads).for_ranges(rise_s.size(), 1, [&](std::size_t i, std::size_t) {
    FlightRunParams params;
    params.run.seed = static_cast<int>(i / 2) + 1;
    params.run.start_x_m = 4, params.run.start_y_m = 3;  // in the largest room
    const AttitudeResponse response = attitude_response(site, params, i % 2 == 0);
    rise_s[i] = response.rise_s;
    overshoot[i] = response.overshoot_ratio;
  });
  BenchResult result;
  result.rows = {{"fly_attitude", quantile(rise_s, 0.95), {}},
                 {"fly_attitude_overshoot", 100 * quantile(overshoot, 0.95), {}}};
  return result;
}

Result<BenchResult> bench_fly_robust(const BenchOptions& options) {
  const FlightScript script = hover_script(1.3, Duration::from_seconds(30));
  BenchResult result;
  double worst_cm = 0;
  std::size_t crashes = 0;
  for (const Variation& variation : kVariations) {
    const auto flown =
        fly_seeds(options, script, [&](FlightRunParams& params, std::size_t) { variation.change(params); });
    const double xy_cm = worst_95(flown, [](const HoverError& e) { return e.max_xy_m * kCm; });
    const std::size_t count = collisions_of(flown);
    worst_cm = std::max(worst_cm, xy_cm);
    crashes += count;
    result.details[variation.name] = JsonValue::object({{"max_xy_cm", xy_cm}, {"crashes", count}});
  }
  result.rows = {{"fly_robust", worst_cm, {}}, {"fly_robust_crashes", static_cast<double>(crashes), {}}};
  return result;
}

Result<BenchResult> bench_fly_waypoints(const BenchOptions& options) {
  const FlightScript course = house_course();
  PilotParams pilot;
  pilot.arrival_m = 0.05;  // by the estimate, which itself is a few centimetres off
  const auto flown = fly_seeds(
      options, course,
      [](FlightRunParams& params, std::size_t) { params.autopilot.cascade.shaper.speed_m_s = 1; }, pilot);
  double worst_m = 0, speed_m_s = std::numeric_limits<double>::infinity();
  std::size_t missed = 0;
  for (const Flown& flight : flown) {
    const auto& legs = flight.log.way_points();
    for (const WayPointRecord& leg : legs) {
      missed += leg.reached ? 0 : 1;
      worst_m = std::max(worst_m, leg.nearest_m);
    }
    if (!legs.empty() && legs.back().end_s)
      speed_m_s = std::min(speed_m_s, course_m(course) / (*legs.back().end_s - legs.front().begin_s));
  }
  BenchResult result;
  result.rows = {{"fly_waypoints", worst_m * kCm, {}},
                 {"fly_waypoints_speed", speed_m_s, {}},
                 {"fly_waypoints_collisions", static_cast<double>(collisions_of(flown) + missed), {}}};
  result.details = JsonValue::object({{"course_m", course_m(course)},
                                      {"way_points", flown.front().log.way_points().size()},
                                      {"missed", missed}});
  return result;
}

Result<BenchResult> bench_fly_speed(const BenchOptions& options) {
  const FlightSite site(WorldKind::kHouse, 1);
  const FlightScript script = hover_script(1.3, Duration::from_seconds(60));
  double fastest = 0;
  for (int round = 0; round < std::max(1, options.rounds); ++round) {
    const Stopwatch watch;
    const Flown flown = fly(site, {}, script);
    fastest = std::max(fastest, flown.log.samples().back().time_s / watch.seconds());
  }
  BenchResult result;
  result.rows = {{"fly_speed", fastest, {}}};
  return result;
}

Result<BenchResult> bench_fly_soak(const BenchOptions& options) {
  constexpr double kHour_s = 3600, kQuickHour_s = 120;
  const double hover_s = options.frame_limit > 0 ? kQuickHour_s : kHour_s;
  const FlightSite site(WorldKind::kHouse, 1);
  FlightRun run(site, {}, {});
  FlightLog log;
  ScriptPilot pilot;
  for (const FlightOrder& order : hover_script(1.3, Duration::from_seconds(hover_s)).orders) pilot.add(order);
  pilot.close();
  std::size_t quarter_bytes = 0, end_bytes = 0;
  while (!pilot.is_over()) {
    run.step(pilot.step(pilot_view(run.moment())));
    log.add(run, pilot);
    const double now_s = run.elapsed().seconds();
    if (quarter_bytes == 0 && now_s >= hover_s / 4) quarter_bytes = resident_bytes();
    if (now_s <= hover_s)
      end_bytes = quarter_bytes > 0 && run.now().ns % 1'000'000'000 == 0 ? resident_bytes() : end_bytes;
  }
  BenchResult result;
  const double growth = static_cast<double>(end_bytes) / static_cast<double>(quarter_bytes) - 1;
  result.rows = {{"fly_soak", 100 * growth, {}}};
  result.details = JsonValue::object({{"after_a_quarter_mb", static_cast<double>(quarter_bytes) * 1e-6},
                                      {"at_the_end_mb", static_cast<double>(end_bytes) * 1e-6},
                                      {"collisions", run.collisions().size()}});
  return result;
}

Result<BenchResult> bench_core_host(const BenchOptions& options) {
  using Clock = std::chrono::steady_clock;
  const FlightSite site(WorldKind::kHouse, 1);
  StepInputs inputs;
  const FlightRunParams params;
  (void)fly(site, params, script_of("takeoff 1.2\ngoto 2 0 1.2\nvelocity 0 0.2 0 20 for 1\nwait 3\nland"),
            &inputs);
  // Every step counts with its fastest round: what is left is its own work.
  std::vector<double> fastest_us(inputs.steps.size(), std::numeric_limits<double>::infinity());
  for (int round = 0; round < std::max(options.rounds, 10); ++round) {
    const auto core = std::make_unique<Autopilot>(params.autopilot);
    for (std::size_t i = 0; i < fastest_us.size(); ++i) {
      const auto begin = Clock::now();
      core->step(inputs.steps[i]);
      fastest_us[i] =
          std::min(fastest_us[i], std::chrono::duration<double, std::micro>(Clock::now() - begin).count());
    }
  }
  const Summary summary = summarise(fastest_us);
  BenchResult result;
  result.rows = {{"core_host", summary.max, {}}};
  result.details = JsonValue::object({{"steps", fastest_us.size()},
                                      {"median_us", summary.median},
                                      {"p99_us", summary.p99},
                                      {"state_bytes", sizeof(Autopilot)}});
  return result;
}

}  // namespace hm::bench
