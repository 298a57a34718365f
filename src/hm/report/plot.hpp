#pragma once
#include <span>
#include <string>
#include <vector>

#include "hm/geometry/trajectory.hpp"

namespace hm {

enum class AxisScale { kLinear, kLog };
enum class SeriesStyle { kLine, kArea, kScatter, kStep };

/// An axis: its label (with unit, "time (s)"), its scale, and its range when it is not the data's.
struct PlotAxis {
  std::string label;
  AxisScale scale = AxisScale::kLinear;
  double min = 0, max = 0;  ///< used when max > min
};

/// One curve. x and y are as long as each other; values that cannot be drawn (NaN, infinite, <= 0 on a
/// log axis) leave gaps.
struct PlotSeries {
  std::string name;
  std::vector<double> x, y;
  SeriesStyle style = SeriesStyle::kLine;
};

/// A vertical or horizontal mark with a label (a bar to reach, a median).
struct PlotMark {
  enum class Direction { kVertical, kHorizontal } direction = Direction::kVertical;
  double value = 0;
  std::string label;
};

struct PlotOptions {
  std::string title;
  PlotAxis x, y;
  std::vector<PlotMark> marks;
  int width_px = 720;
  int height_px = 360;
  bool equal_aspect = false;  ///< the same scale on both axes (maps)
  bool stacked = false;       ///< areas on top of each other, sampled at the first series' x
};

/// All of these return one self-contained <svg> element (no script, no external resource; text escaped;
/// colours that adapt to a dark page), which scales with the page. A plot without a single drawable value
/// says "no data".
std::string plot_svg(std::span<const PlotSeries> series, const PlotOptions& options);

/// Bars counting the values in `bins` equal steps of the x axis' range (the data's 0.5 to 99.5
/// percentiles when not given). The share outside of the range is written in the corner.
std::string histogram_svg(std::span<const float> values, int bins, const PlotOptions& options);

/// Per-stage values over time on top of each other, with the sum on the outside: stages[i].y over
/// stages[0].x; thinned to what the width can show (mean of each step).
std::string stacked_series_svg(std::span<const PlotSeries> stages, const PlotOptions& options);

/// One path for trajectory_svg.
struct NamedTrajectory {
  std::string name;
  const Trajectory* trajectory = nullptr;
};
/// Trajectories from above (x right, y up, metres, equal scales), start marked.
std::string trajectory_svg(std::span<const NamedTrajectory> trajectories, const PlotOptions& options);

/// Text with & < > " ' written as entities and control characters removed, for SVG and HTML.
std::string escape_markup(std::string_view text);

}  // namespace hm
