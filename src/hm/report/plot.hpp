#pragma once
#include <span>
#include <string>
#include <vector>

#include "hm/geometry/trajectory.hpp"

namespace hm {

enum class AxisScale { kLinear, kLog };
enum class SeriesStyle { kLine, kArea, kScatter, kStep };

/// Axis with label (with unit, "time (s)"), scale, and range if not that of the data.
struct PlotAxis {
  std::string label;
  AxisScale scale = AxisScale::kLinear;
  double min = 0, max = 0;  ///< used when max > min
};

/// One curve. x and y have the same length; values that cannot be drawn (NaN, infinite, <= 0 on a log axis)
/// leave gaps.
struct PlotSeries {
  std::string name;
  std::vector<double> x, y;
  SeriesStyle style = SeriesStyle::kLine;
  std::string color = {};  ///< CSS; empty: that of its number
};

/// A bar of colours with the values at its ends, over the plot.
struct PlotColorBar {
  std::vector<std::string> colors;
  std::string low, high;  ///< "0", "24 mm"
};

/// Vertical or horizontal line with a label (a target, a median).
struct PlotMark {
  enum class Direction { kVertical, kHorizontal } direction = Direction::kVertical;
  double value = 0;
  std::string label;
};

struct PlotOptions {
  std::string title;
  PlotAxis x, y;
  std::vector<PlotMark> marks;
  PlotColorBar color_bar;  ///< drawn if it has colours
  int width_px = 460;      ///< of the drawing; at 350 px, a phone's, letters of 15 px are still 11 px high
  int height_px = 300;
  bool equal_aspect = false;  ///< the same scale on both axes (maps)
  bool stacked = false;       ///< areas on top of each other, sampled at the first series' x
};

/// Draws curves. All functions here return one self-contained <svg> element (no scripts or external
/// resources; text escaped; colours adapt to dark mode), which scales with the page. A plot without drawable
/// values shows "no data".
std::string plot_svg(std::span<const PlotSeries> series, const PlotOptions& options);

/// Draws a histogram with `bins` equal bins over the x axis' range (by default the data's 0.5 to 99.5
/// percentiles). The share outside the range is written in the corner.
std::string histogram_svg(std::span<const float> values, int bins, const PlotOptions& options);

/// Draws stacked values of several stages over time, stages[i].y over stages[0].x; averaged to the resolution
/// of the plot.
std::string stacked_series_svg(std::span<const PlotSeries> stages, const PlotOptions& options);

/// Limits of what an indoor vehicle or a hand can do; larger values come from a wrong time stamp or lost
/// tracking.
inline constexpr double kMaxSpeed_m_s = 30, kMaxTurnRate_rad_s = 20;
/// Takes values beyond +-limit out of the series and adds them as red points at the limit, named with their
/// number. Returns a sentence for the caption, with a space before it; empty where there are none.
std::string set_aside_unphysical(std::vector<PlotSeries>& series, double limit, std::string_view unit);

/// One path for trajectory_svg.
struct NamedTrajectory {
  std::string name;
  const Trajectory* trajectory = nullptr;
};
/// Draws trajectories from above (x right, y up, metres, equal scales), with the start marked.
std::string trajectory_svg(std::span<const NamedTrajectory> trajectories, const PlotOptions& options);

/// Escapes & < > " ' as entities and removes control characters, for SVG and HTML.
std::string escape_markup(std::string_view text);

}  // namespace hm
