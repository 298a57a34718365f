#pragma once
#include <functional>
#include <string>

#include "hm/pipeline/flight/mission/flight_summary.hpp"
#include "hm/report/html_report.hpp"
#include "hm/report/plot.hpp"

namespace hm {

/// A value of a sample of a flight; NaN where there is none.
using FlightQuantity = std::function<double(const FlightSample&)>;
/// Position along an axis (0: x forward of the start, 1: y left, 2: z up), m, in `odom`.
FlightQuantity commanded_position(int axis);
FlightQuantity estimated_position(int axis);
FlightQuantity true_position(int axis);
/// Heading, degrees.
FlightQuantity commanded_yaw_deg();
FlightQuantity estimated_yaw_deg();
FlightQuantity true_yaw_deg();

/// The quantity over time, s since the start.
PlotSeries flight_series(const FlightSummary& summary, std::string name, const FlightQuantity& quantity);
/// Adds a plot of curves over time, s.
void add_flight_plot(HtmlReport& report, std::initializer_list<PlotSeries> series, const char* y_label,
                     const char* caption);

/// Adds commanded, estimated and true x, y, z and yaw over time (as dissertation Figs 2.8 left, 2.9).
void add_position_plots(HtmlReport& report, const FlightSummary& summary);
/// Adds the estimated and the true path and the way points from above (as Fig. 2.8 right).
void add_path_plot(HtmlReport& report, const FlightSummary& summary);
/// Adds measured and true height and the level of the floor over time (as Fig. 2.5). Every flight with a
/// measured height has one.
void add_height_plot(HtmlReport& report, const FlightSummary& summary);

}  // namespace hm
