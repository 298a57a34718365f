#include "hm/pipeline/flight/mission/flight_mission.hpp"

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>

#include "hm/core/stopwatch.hpp"
#include "hm/flight/flight_text.hpp"
#include "hm/pipeline/flight/ground_station.hpp"
#include "hm/pipeline/flight/mission/flight_output.hpp"
#include "hm/pipeline/flight/page/flight_view.hpp"

namespace hm {
namespace {

constexpr std::int64_t kPollSteps = 20;  ///< between two looks at live lines
constexpr std::int64_t kPaceSteps = 5;   ///< between two looks at the clock: who steers waits no longer
constexpr std::size_t kMostPoses = std::size_t{1} << 16U;  ///< at 50 Hz those of 20 minutes
constexpr std::int64_t kSecondSteps = 1000;
constexpr std::int64_t kAfterSteps = 300;  ///< after the pilot has released control

/// One flight of fly_mission().
class Mission {
 public:
  Mission(const FlightMissionOptions& options, const FlightSite& site, FlightRecorder& recorder,
          std::unique_ptr<FlightCore> core)
      : options_(options),
        faults_(options.script.faults),
        recorder_(recorder),
        view_(options.run.view, recorder, options.parameters.perception.laser.run),
        run_(site, run_params(options), faults_, &view_, std::move(core)),
        pilot_(options.parameters.pilot),
        log_(faults_, static_cast<double>(options.parameters.flight.autopilot.guidance.takeoff_height_m)) {
    for (const FlightOrder& order : options.script.orders) pilot_.add(order);
    if (!options.live) pilot_.close();
    if (options.ground_station)
      ground_station_.emplace(*options.ground_station, options.parameters.ground_station,
                              options.mavlink_key);
    note_poses();
  }

  Result<void> fly();
  [[nodiscard]] FlightSummary summarise();
  [[nodiscard]] FlightRun& run() { return run_; }

 private:
  static FlightRunParams run_params(const FlightMissionOptions& options) {
    FlightRunParams params = options.parameters.flight;
    params.perception = options.parameters.perception.laser;
    return params;
  }
  void step();
  void take_lines();
  void obey(const std::string& line);
  void keep_pace();
  void show_texts();
  void show_progress();
  void note_poses();
  [[nodiscard]] std::string end_state() const;

  const FlightMissionOptions& options_;
  FaultSchedule faults_;
  FlightRecorder& recorder_;
  FlightView view_;
  FlightRun run_;
  ScriptPilot pilot_;
  std::optional<GroundStation> ground_station_;
  FlightLog log_;
  Stopwatch watch_;
  std::int64_t steps_ = 0;
  std::size_t lines_ = 0, texts_ = 0;
  bool interrupted_ = false;
  EvenlyThinned<StampedPose> truth_{kMostPoses}, estimate_{kMostPoses};
  double run_s_ = 0;
};

void Mission::step() {
  auto command = pilot_.step(pilot_view(run_.moment()));
  if (!command && ground_station_) command = ground_station_->step(run_.moment());
  if (options_.page) {
    const auto of_page = options_.page->step(run_.moment(), run_.perception().map(), !command);
    if (!command) command = of_page;
  }
  run_.step(command);
  view_.step(run_);
  log_.add(run_, pilot_);
  ++steps_;
  if (options_.realtime && steps_ % kPaceSteps == 0) keep_pace();
  if (steps_ % kPollSteps != 0) return;
  note_poses();
  show_texts();
  view_.show_way_points(pilot_.records());
  if (options_.live) take_lines();
}

Result<void> Mission::fly() {
  while (!pilot_.is_over()) {
    if (options_.run.stop.stop_requested() && !interrupted_) {
      interrupted_ = true;
      if (options_.page) options_.page->end();
      pilot_.land_now("stopped");
      log_.note(run_.elapsed().seconds(), "stopped: lands");
    }
    step();
    if (steps_ % kSecondSteps != 0) continue;
    show_progress();
    if (const auto flushed = recorder_.flush(); !flushed) return flushed;
  }
  for (std::int64_t i = 0; i < kAfterSteps; ++i) step();
  run_.finish();
  run_s_ = watch_.seconds();
  return recorder_.finish();
}

/// A line of somebody who flies live; what is wrong with it is said, and nothing happens.
void Mission::obey(const std::string& line) {
  constexpr std::string_view kNow = "now ";
  const bool at_once = line.starts_with(kNow);
  const std::string_view order_text = std::string_view(line).substr(at_once ? kNow.size() : 0);
  const auto parsed = parse_flight_line(order_text, fmt::format("line {}", lines_));
  const auto say = [&](const std::string& text) {
    if (options_.run.log) options_.run.log(LogLevel::kWarning, text);
  };
  if (!parsed) return say(to_string(parsed.error()));
  const auto* order = std::get_if<FlightOrder>(&*parsed);
  if (!order) return say(fmt::format("line {}: faults are given before the flight (--fault)", lines_));
  if (at_once || order->kind == FlightOrder::Kind::kEStop)
    pilot_.interrupt(*order);
  else
    pilot_.add(*order);
}

void Mission::take_lines() {
  for (const std::string& line : options_.live->take()) {
    ++lines_;
    if (line.substr(0, line.find('#')).find_first_not_of(" \t\r") != std::string::npos) obey(line);
  }
  if (options_.live->ended() && !options_.page) pilot_.close();
}

/// Warnings of another autopilot, for whoever waits for it to fly.
void Mission::show_texts() {
  const auto texts = run_.core().texts().subspan(texts_);
  texts_ += texts.size();
  if (!options_.run.log) return;
  for (const CoreText& said : texts)
    if (said.is_warning) options_.run.log(LogLevel::kWarning, "autopilot: " + said.text);
}

void Mission::keep_pace() {
  const double ahead_s = run_.elapsed().seconds() - watch_.seconds();
  if (ahead_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(ahead_s));
}

void Mission::show_progress() {
  if (!options_.run.progress) return;
  const double flown_s = run_.elapsed().seconds();
  const OrderRecord* order = pilot_.current();
  options_.run.progress(
      {"flying", static_cast<std::size_t>(flown_s), 0,
       fmt::format("{:.0f} s, {:.1f} times real time, {}, {}", flown_s,
                   flown_s / std::max(watch_.seconds(), 1e-9), text_of(run_.moment().autopilot.state),
                   order ? order->order.text : std::string("waiting for orders"))});
}

void Mission::note_poses() {
  const FlightMoment& moment = run_.moment();
  truth_.push_back({moment.stamp, moment.truth.T_world_base});
  if (!moment.estimate.planar_ready || !moment.estimate.height_ready) return;
  estimate_.push_back({moment.stamp, link_state(estimate_in_map(moment)).T_odom_base});
}

std::string Mission::end_state() const {
  const FlightMoment& moment = run_.moment();
  constexpr int kStands = 3;
  if (moment.autopilot.state == AutopilotState::kError) return "error";
  if (in_air(moment.autopilot.state)) return "flying";
  return moment.feet_down >= kStands ? "landed" : "fallen";
}

FlightSummary Mission::summarise() {
  FlightSummary summary;
  summary.mission = options_.mission;
  summary.parameters = options_.parameters;
  summary.log = log_;
  summary.interrupted = interrupted_;
  summary.flight_s = run_.elapsed().seconds();
  summary.run_s = run_s_;
  summary.collisions = run_.collisions().size();
  summary.end_state = end_state();
  summary.scans = recorder_.scans();
  summary.orders.assign(pilot_.records().begin(), pilot_.records().end());
  summary.heights = recorder_.heights();
  summary.counts = run_.counts();
  summary.latencies = run_.latencies();
  summary.truth = truth_.take();
  summary.trajectory = estimate_.take();
  summary.T_world_odom = run_.T_world_odom();
  summary.start = summary.truth.front().stamp;
  summary.map = run_.perception().map().size();
  const auto needs_camera = [](const ScriptedFault& fault) { return fault.kind == FaultKind::kCameraBlack; };
  if (std::ranges::any_of(faults_.all(), needs_camera))
    summary.warnings.emplace_back("the fault camera_black changed nothing: this vehicle flies by its laser");
  if (const auto failure = run_.core().failure()) {
    summary.core_failure = to_string(*failure);
    summary.warnings.push_back("the autopilot failed: " + *summary.core_failure);
  }
  return summary;
}

}  // namespace

Result<FlightSummary> fly_mission(const FlightMissionOptions& options) {
  if (const auto checked = check_parameters(options.parameters); !checked) return forward_error(checked);
  auto folder =
      ResultFolder::open({options.output, options.existing, "fly", {}, options.run.program_version});
  if (!folder) return forward_error(folder);
  std::unique_ptr<FlightCore> core;
  if (options.make_core) {
    auto made = options.make_core(options.parameters.flight);
    if (!made) return forward_error(made);
    core = std::move(*made);
  }
  auto recorder = as_run_failure(FlightRecorder::create(folder->staging()));
  if (!recorder) return forward_error(recorder);
  const FlightRunSettings& settings = options.parameters.flight.run;
  std::optional<FlightSite> generated;
  const FlightSite& site = options.site ? *options.site : generated.emplace(settings.world, settings.seed);
  Mission mission(options, site, *recorder, std::move(core));
  if (const auto flown = as_run_failure(mission.fly()); !flown) return forward_error(flown);
  FlightSummary summary = mission.summarise();
  const auto written = write_flight_results({options, site, mission.run(), folder->staging()}, summary);
  if (!written) return forward_error(written);
  const auto published =
      folder->publish(summary.outputs, summary.interrupted ? RunState::kStopped : RunState::kComplete);
  if (!published) return forward_error(published);
  return summary;
}

}  // namespace hm
