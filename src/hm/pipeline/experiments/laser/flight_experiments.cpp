#include "hm/pipeline/experiments/laser/flight_experiments.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

#include "hm/core/angle.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/pipeline/flight/mission/flight_mission.hpp"
#include "hm/pipeline/flight/mission/flight_plots.hpp"
#include "hm/sim/world/height_course.hpp"

namespace hm {
namespace {

constexpr double kCm = 100;

/// A control law and the inner loop that flies it.
struct Law {
  const char* name;  ///< of the flight's folder
  const char* words;
  ControlLaw law;
  InnerLoopKind inner_loop;
};
constexpr Law kLaws[] = {
    {"published", "published control", ControlLaw::kPublished, InnerLoopKind::kSecondOrder},
    {"cascade", "default control", ControlLaw::kCascade, InnerLoopKind::kMotors}};

using Flight = std::shared_ptr<const FlightSummary>;

/// Flies a mission into a folder of the experiment, named after it.
Result<Flight> fly(const ExperimentOptions& options, FlightMissionOptions mission,
                   ExperimentFindings& findings) {
  mission.output = options.output / mission.mission;
  mission.existing = ExistingResult::kOverwrite;  // the folder has been opened for the whole experiment
  mission.run = options.run;
  auto flown = fly_mission(mission);
  if (!flown) return forward_error(flown);
  if (flown->interrupted) return fail(ErrorCode::kCancelled, {}, "stopped in a flight of an experiment");
  for (const std::string& warning : flown->warnings)
    findings.warnings.push_back(fmt::format("flight '{}': {}", mission.mission, warning));
  if (flown->collisions > 0)
    findings.warnings.push_back(
        fmt::format("flight '{}': {}", mission.mission, counted(flown->collisions, "collision")));
  findings.outputs.push_back(mission.output);
  return std::make_shared<const FlightSummary>(std::move(*flown));
}

/// Flies the script under each law.
Result<std::vector<Flight>> fly_laws(const ExperimentOptions& options, WorldKind world,
                                     const FlightScript& script, ExperimentFindings& findings) {
  std::vector<Flight> flights;
  for (const Law& law : kLaws) {
    FlightMissionOptions mission;
    mission.mission = law.name;
    mission.script = script;
    mission.parameters = options.parameters.flight;
    start_in(world, mission.parameters.flight.run);
    mission.parameters.flight.autopilot.law = law.law;
    mission.parameters.flight.vehicle.inner_loop.inner_loop = law.inner_loop;
    auto flown = fly(options, std::move(mission), findings);
    if (!flown) return forward_error(flown);
    flights.push_back(std::move(*flown));
  }
  return flights;
}

void add_flight_figures(HtmlReport& report, const std::vector<Flight>& flights) {
  for (std::size_t i = 0; i < flights.size(); ++i) {
    report.begin_section(
        fmt::format("Position, {}", kLaws[i].words),
        fmt::format("Commanded, estimated on board and true. The whole flight: {}/report.html",
                    kLaws[i].name));
    add_position_plots(report, *flights[i]);
    add_path_plot(report, *flights[i]);
  }
}

// --- Fig. 2.5 ---

/// There and back over the objects, rising and sinking on the way.
FlightScript height_script(bool tiny) {
  constexpr const char* kTiny = "takeoff 1.2\ngoto 2.6 0 1.3 0\nwait 1\nland\n";
  constexpr const char* kWhole =
      "takeoff 1.2\ngoto 2.6 0 1.5 0\ngoto 4.8 0 1.3 0\ngoto 6.6 0 1.7 0\ngoto 8.8 0 1.4 0\nwait 1\n"
      "goto 6.6 0 1.2 0\ngoto 4.8 0 1.6 0\ngoto 2.6 0 1.2 0\ngoto 0 0 1.4 0\nwait 1\nland\n";
  return parse_flight_script(tiny ? kTiny : kWhole, "height experiment").value();
}

/// A measured height and what was true then.
struct HeightPair {
  double time_s = 0, height_m = 0, floor_m = 0;  ///< measured
  Vec3 true_m = Vec3::Zero();                    ///< position in the course
};

std::vector<HeightPair> height_pairs(const FlightSummary& flight) {
  constexpr Duration kMostGap = Duration::from_seconds(0.1);
  std::vector<HeightPair> pairs;
  for (const MeasuredHeight& measured : flight.heights)
    if (const auto truth = pose_at(flight.truth, measured.stamp, kMostGap))
      pairs.push_back({(measured.stamp - flight.start).seconds(), measured.height_m, measured.floor_m,
                       truth->translation()});
  return pairs;
}

/// Level of the floor that was measured over an object, median over the part that is `kInside_m` from its
/// edges; NaN: it was not flown over.
double level_over(const FlatObject& object, const std::vector<HeightPair>& pairs) {
  constexpr double kInside_m = 0.15;
  std::vector<double> levels_m;
  for (const HeightPair& pair : pairs)
    if (pair.true_m.x() > object.from_x_m + kInside_m && pair.true_m.x() < object.to_x_m - kInside_m)
      levels_m.push_back(pair.floor_m);
  return levels_m.empty() ? std::nan("") : quantile(std::move(levels_m), 0.5);
}

std::vector<ExperimentRow> height_rows(const std::vector<HeightPair>& pairs) {
  constexpr double kSameLevel_m = 0.03;
  std::vector<double> height_errors_m;
  std::size_t same_level = 0;
  for (const HeightPair& pair : pairs) {
    height_errors_m.push_back(std::abs(pair.height_m - pair.true_m.z()));
    const double level_m = height_course_level_m(pair.true_m.x(), pair.true_m.y());
    same_level += std::abs(pair.floor_m - level_m) < kSameLevel_m ? 1U : 0U;
  }
  const Summary height = summarise(height_errors_m);
  const double share =
      static_cast<double>(same_level) / static_cast<double>(std::max<std::size_t>(1, pairs.size()));
  std::vector<ExperimentRow> rows{
      {"error of the height, RMS", {}, kCm * height.rmse, "cm"},
      {"error of the height, 95 % of the scans below", {}, kCm * height.p95, "cm"},
      {"error of the height, at most", {}, kCm * height.max, "cm"},
      {"scans whose floor is within 3 cm of that below the centre", {}, 100 * share, "%"}};
  for (const FlatObject& object : height_course_objects()) {
    const double level_m = level_over(object, pairs);
    if (std::isfinite(level_m))
      rows.push_back({fmt::format("level measured over the object of {:.0f} cm", kCm * object.height_m),
                      {},
                      kCm * level_m,
                      "cm"});
  }
  return rows;
}

void add_height_figure(HtmlReport& report, const std::vector<HeightPair>& pairs,
                       const FlightSummary& flight) {
  PlotSeries height{"height by the laser", {}, {}}, floor{"floor by the laser", {}, {}, SeriesStyle::kStep},
      true_height{"true height", {}, {}}, true_floor{"true floor", {}, {}, SeriesStyle::kStep};
  for (const HeightPair& pair : pairs) {
    for (PlotSeries* series : {&height, &floor, &true_height, &true_floor}) series->x.push_back(pair.time_s);
    height.y.push_back(pair.height_m), floor.y.push_back(pair.floor_m);
    true_height.y.push_back(pair.true_m.z());
    true_floor.y.push_back(height_course_level_m(pair.true_m.x(), pair.true_m.y()));
  }
  report.begin_section(
      "Height and floor",
      "The floor below the centre of the vehicle is the true one; the mirror's beams meet it "
      "a little aside. The whole flight: flight/report.html");
  add_flight_plot(report,
                  {std::move(height), std::move(true_height), std::move(floor), std::move(true_floor)},
                  "height (m)", "Height of the vehicle and level of what lies below it.");
  add_path_plot(report, flight);
}

// --- Fig. 2.8 ---

/// Greatest distances from the goal along each axis, and the RMS of all.
struct HoverDeviation {
  Vec3 max_m = Vec3::Zero();
  double rms_m = 0;
};

HoverDeviation deviation(const FlightSummary& flight, FlightMotion FlightSample::*motion) {
  constexpr double kSettling_s = 3;
  HoverDeviation result;
  double squares_m2 = 0;
  std::size_t count = 0;
  for (const OrderRecord& record : flight.orders) {
    if (record.order.kind != FlightOrder::Kind::kWait || record.outcome != OrderOutcome::kDone) continue;
    const double begin_s = (record.begin - flight.start).seconds() + kSettling_s,
                 end_s = (record.end - flight.start).seconds();
    for (const FlightSample& sample : flight.log.samples()) {
      if (sample.time_s < begin_s || sample.time_s > end_s || !sample.goal_m) continue;
      const Vec3 off_m = (sample.*motion).position_m - *sample.goal_m;
      result.max_m = result.max_m.cwiseMax(off_m.cwiseAbs());
      squares_m2 += off_m.squaredNorm();
      ++count;
    }
  }
  if (count > 0) result.rms_m = std::sqrt(squares_m2 / static_cast<double>(count));
  return result;
}

void add_hover_rows(const FlightSummary& flight, const char* law, std::vector<ExperimentRow>& rows) {
  constexpr double kPublishedXy_cm = 20, kPublishedZ_cm = 5;
  const HoverDeviation estimate = deviation(flight, &FlightSample::estimate),
                       truth = deviation(flight, &FlightSample::truth);
  for (int axis = 0; axis < 3; ++axis) {
    const char letter = "xyz"[axis];
    rows.push_back({fmt::format("{}: |{}| at most, by the estimate", law, letter),
                    axis < 2 ? kPublishedXy_cm : kPublishedZ_cm, kCm * estimate.max_m(axis), "cm"});
    rows.push_back(
        {fmt::format("{}: |{}| at most, by the truth", law, letter), {}, kCm * truth.max_m(axis), "cm"});
  }
  rows.push_back({fmt::format("{}: RMS of the distance, by the truth", law), {}, kCm * truth.rms_m, "cm"});
}

// --- Fig. 2.9 ---

FlightScript way_point_script(bool tiny) {
  constexpr const char* kTiny = "-0.6 0 1.3 45\n";
  constexpr const char* kWhole =
      "-1.1 0 1.3 0\n-2.2 0 1.3 90\n-2.2 -1 1.3 180\n-1.1 -0.6 1.3 90\n0 -1 1.3 0\n0 0 1.3 -90\n-2.2 -1 1.3 "
      "0\n"
      "0 0 1.3 0\n";
  return parse_way_points(tiny ? kTiny : kWhole, "way point experiment").value();
}

/// True heading less the commanded one when a way point was reached, absolute; NaN without either.
double turn_left_rad(const FlightLog& log, const WayPointRecord& way_point) {
  const auto& samples = log.samples();
  const auto after =
      std::ranges::upper_bound(samples, way_point.end_s.value_or(0), {}, &FlightSample::time_s);
  if (after == samples.begin() || !std::prev(after)->goal_yaw_rad) return std::nan("");
  const FlightSample& last = *std::prev(after);
  return std::abs(wrap_angle(last.truth.yaw_rad - *last.goal_yaw_rad));
}

void add_way_point_rows(const FlightSummary& flight, const char* law, std::vector<ExperimentRow>& rows) {
  double worst_m = 0, worst_turn_rad = 0;
  std::size_t reached = 0;
  for (const WayPointRecord& way_point : flight.log.way_points()) {
    if (!way_point.reached) continue;
    worst_m = std::max(worst_m, way_point.nearest_m);
    worst_turn_rad = std::fmax(worst_turn_rad, turn_left_rad(flight.log, way_point));
    ++reached;
  }
  rows.push_back({fmt::format("{}: way points reached, of {}", law, flight.log.way_points().size()),
                  {},
                  static_cast<double>(reached),
                  ""});
  rows.push_back({fmt::format("{}: true distance from them, at most", law), {}, kCm * worst_m, "cm"});
  rows.push_back({fmt::format("{}: true heading off when they are reached, at most", law),
                  {},
                  worst_turn_rad * kDegreesPerRadian,
                  "deg"});
  rows.push_back({fmt::format("{}: error of the estimate, RMS", law),
                  {},
                  kCm * flight.log.estimate_error_m().rmse,
                  "cm"});
}

/// Flies a script under both laws; `add_rows(flight, law, rows)` measures each.
template <class AddRows>
Result<ExperimentFindings> compare_laws(const ExperimentOptions& options, WorldKind world,
                                        const FlightScript& script, const AddRows& add_rows) {
  ExperimentFindings findings;
  auto flights = fly_laws(options, world, script, findings);
  if (!flights) return forward_error(flights);
  for (std::size_t i = 0; i < flights->size(); ++i) add_rows(*(*flights)[i], kLaws[i].words, findings.rows);
  findings.add_figures = [flown = std::move(*flights)](HtmlReport& report) {
    add_flight_figures(report, flown);
  };
  return findings;
}

}  // namespace

Result<ExperimentFindings> run_height_experiment(const ExperimentOptions& options) {
  const FlightSite site(make_height_course());
  ExperimentFindings findings;
  FlightMissionOptions mission;
  mission.mission = "flight";
  mission.script = height_script(options.tiny);
  mission.parameters = options.parameters.flight;
  mission.parameters.flight.run.start_x_m = mission.parameters.flight.run.start_y_m = 0;
  mission.parameters.flight.run.start_yaw_rad = 0;
  mission.site = &site;
  const auto flown = fly(options, std::move(mission), findings);
  if (!flown) return forward_error(flown);
  std::vector<HeightPair> pairs = height_pairs(**flown);
  findings.rows = height_rows(pairs);
  findings.add_figures = [flight = *flown, pairs = std::move(pairs)](HtmlReport& report) {
    add_height_figure(report, pairs, *flight);
  };
  return findings;
}

Result<ExperimentFindings> run_hover_experiment(const ExperimentOptions& options) {
  constexpr double kHover_s = 240, kTiny_s = 5, kHeight_m = 1.3;
  const auto duration = Duration::from_seconds(options.tiny ? kTiny_s : kHover_s);
  return compare_laws(options, WorldKind::kHouse, hover_script(kHeight_m, duration), add_hover_rows);
}

Result<ExperimentFindings> run_way_point_experiment(const ExperimentOptions& options) {
  return compare_laws(options, WorldKind::kRoom, way_point_script(options.tiny), add_way_point_rows);
}

}  // namespace hm
