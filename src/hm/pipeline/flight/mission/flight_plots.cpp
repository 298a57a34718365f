#include "hm/pipeline/flight/mission/flight_plots.hpp"

#include <array>
#include <limits>

#include "hm/core/angle.hpp"

namespace hm {

FlightQuantity commanded_position(int axis) {
  return [axis](const FlightSample& sample) {
    return sample.goal_m ? (*sample.goal_m)(axis) : std::numeric_limits<double>::quiet_NaN();
  };
}

FlightQuantity estimated_position(int axis) {
  return [axis](const FlightSample& sample) { return sample.estimate.position_m(axis); };
}

FlightQuantity true_position(int axis) {
  return [axis](const FlightSample& sample) { return sample.truth.position_m(axis); };
}

FlightQuantity commanded_yaw_deg() {
  return [](const FlightSample& sample) {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    return sample.goal_yaw_rad ? *sample.goal_yaw_rad * kDegreesPerRadian : kNone;
  };
}

FlightQuantity estimated_yaw_deg() {
  return [](const FlightSample& sample) { return sample.estimate.yaw_rad * kDegreesPerRadian; };
}

FlightQuantity true_yaw_deg() {
  return [](const FlightSample& sample) { return sample.truth.yaw_rad * kDegreesPerRadian; };
}

PlotSeries flight_series(const FlightSummary& summary, std::string name, const FlightQuantity& quantity) {
  PlotSeries series;
  series.name = std::move(name);
  for (const FlightSample& sample : summary.log.samples()) {
    series.x.push_back(sample.time_s);
    series.y.push_back(quantity(sample));
  }
  return series;
}

void add_flight_plot(HtmlReport& report, std::initializer_list<PlotSeries> series, const char* y_label,
                     const char* caption) {
  PlotOptions plot;
  plot.x.label = "time (s)";
  plot.y.label = y_label;
  report.add_svg(plot_svg(std::vector<PlotSeries>(series), plot), caption);
}

void add_position_plots(HtmlReport& report, const FlightSummary& summary) {
  constexpr std::array<const char*, 3> kLabels{"x (m)", "y (m)", "z (m)"};
  constexpr std::array<const char*, 3> kCaptions{"Forward of the start.", "To the left of the start.",
                                                 "Height over the floor of the start."};
  for (std::size_t k = 0; k < kLabels.size(); ++k) {
    const int axis = static_cast<int>(k);
    PlotSeries goal = flight_series(summary, "commanded", commanded_position(axis));
    goal.style = SeriesStyle::kStep;
    add_flight_plot(report,
                    {std::move(goal), flight_series(summary, "estimated", estimated_position(axis)),
                     flight_series(summary, "true", true_position(axis))},
                    kLabels[k], kCaptions[k]);
  }
  PlotSeries heading = flight_series(summary, "commanded", commanded_yaw_deg());
  heading.style = SeriesStyle::kStep;
  add_flight_plot(report,
                  {std::move(heading), flight_series(summary, "estimated", estimated_yaw_deg()),
                   flight_series(summary, "true", true_yaw_deg())},
                  "yaw (deg)", "Heading.");
}

void add_path_plot(HtmlReport& report, const FlightSummary& summary) {
  PlotOptions plot;
  plot.x.label = "x (m)", plot.y.label = "y (m)";
  plot.equal_aspect = true;
  plot.height_px = 360;
  PlotSeries goals{"way points", {}, {}, SeriesStyle::kScatter}, estimate{"estimated", {}, {}},
      truth{"true", {}, {}};
  for (const WayPointRecord& way_point : summary.log.way_points()) {
    goals.x.push_back(way_point.goal_m.x());
    goals.y.push_back(way_point.goal_m.y());
  }
  const auto add = [](PlotSeries& series, const Trajectory& path) {
    for (const StampedPose& pose : path) {
      series.x.push_back(pose.T_world_base.translation().x());
      series.y.push_back(pose.T_world_base.translation().y());
    }
  };
  add(estimate, summary.trajectory);
  add(truth, truth_in_odom(summary));
  std::vector<PlotSeries> series{std::move(estimate), std::move(truth)};
  if (!goals.x.empty()) series.push_back(std::move(goals));
  report.add_svg(plot_svg(series, plot), "From above.");
}

void add_height_plot(HtmlReport& report, const FlightSummary& summary) {
  PlotSeries height{"by the laser", {}, {}, SeriesStyle::kScatter},
      floor{"floor", {}, {}, SeriesStyle::kStep};
  for (const MeasuredHeight& measured : summary.heights) {
    const double time_s = (measured.stamp - summary.start).seconds();
    height.x.push_back(time_s), floor.x.push_back(time_s);
    height.y.push_back(measured.height_m), floor.y.push_back(measured.floor_m);
  }
  add_flight_plot(report,
                  {std::move(height), flight_series(summary, "true", true_position(2)), std::move(floor)},
                  "height (m)", "Measured and true height, and the level of the floor below the vehicle.");
}

}  // namespace hm
