#include "hm/report/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "hm/core/check.hpp"
#include "hm/core/statistics.hpp"
#include "hm/report/plot_axis.hpp"

namespace hm {
namespace {

/// Colours that differ in lightness as well as hue; every plot carries its own style so that it stands alone.
constexpr std::string_view kStyle =
    "<style>.hm-plot{font-family:system-ui,-apple-system,'Segoe UI',Roboto,sans-serif;color:#2a2f3a;"
    "--s0:#2563b0;--s1:#d9600f;--s2:#18855a;--s3:#a13670;--s4:#b58a00;--s5:#5b5fc7;--s6:#3c98ab;--s7:#777d88;"
    "--beyond:#c2303c}"
    ".hm-plot text{fill:currentColor;font-size:15px}.hm-plot .hm-title{font-size:17px;font-weight:600}"
    ".hm-plot .hm-grid{stroke:currentColor;stroke-opacity:.13}.hm-plot "
    ".hm-frame{stroke:currentColor;stroke-opacity:.55;"
    "fill:none}.hm-plot .hm-mark{stroke:currentColor;stroke-opacity:.75;stroke-dasharray:5 4}"
    "@media(prefers-color-scheme:dark){.hm-plot{color:#dfe3ea;--s0:#6ea8f5;--s1:#ff9a52;--s2:#52c795;--s3:#"
    "e27db4;"
    "--s4:#e0bd4a;--s5:#a3a6f5;--s6:#7fd0e0;--s7:#aab0bb;--beyond:#ff7b83}}</style>";
constexpr int kColors = 8;

std::string color(std::size_t series) { return fmt::format("var(--s{})", series % kColors); }
std::string color(const PlotSeries& series, std::size_t index) {
  return series.color.empty() ? color(index) : escape_markup(series.color);
}

/// The drawing area and its two axes.
struct Frame {
  double left, right, top, bottom;
  AxisMap x, y;
};

std::string open_svg(const PlotOptions& options) {
  const std::string label =
      options.title.empty() ? options.y.label + " over " + options.x.label : options.title;
  std::string svg = fmt::format(
      "<svg class=\"hm-plot\" xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"100%\" "
      "style=\"max-width:{}px;height:auto\" role=\"img\" aria-label=\"{}\">",
      options.width_px, options.height_px, options.width_px * 23 / 20, escape_markup(label));
  svg += kStyle;
  if (!options.title.empty())
    svg +=
        fmt::format("<text class=\"hm-title\" x=\"{}\" y=\"20\">{}</text>", 12, escape_markup(options.title));
  return svg;
}

std::string no_data(const PlotOptions& options) {
  return open_svg(options) +
         fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">no data</text></svg>",
                     options.width_px / 2, options.height_px / 2);
}

int ticks_over(double height_px) { return std::max(2, static_cast<int>(height_px / 46)); }

/// Number of characters of the longest tick label of the y axis.
std::size_t longest_tick(const PlotAxis& axis, const std::pair<double, double>& range, double height_px) {
  std::size_t longest = 1;
  for (const auto& [value, text] :
       AxisMap(axis, range.first, range.second, height_px, 0).ticks(ticks_over(height_px)))
    longest = std::max(longest, text.size());
  return longest;
}

/// Label of the x axis, broken into lines that fit.
std::vector<std::string> label_lines(const PlotOptions& options) {
  const auto most = static_cast<std::size_t>(std::max(8, options.width_px / 8));
  std::vector<std::string> lines(1);
  std::istringstream words(options.x.label);
  for (std::string word; words >> word;) {
    if (!lines.back().empty() && lines.back().size() + 1 + word.size() > most) lines.emplace_back();
    if (!lines.back().empty()) lines.back() += ' ';
    lines.back() += word;
  }
  return lines;
}

/// Draws grid, ticks and labels.
std::string draw_axes(const Frame& frame, const PlotOptions& options) {
  std::string svg;
  const int x_ticks = std::max(2, static_cast<int>((frame.right - frame.left) / 80));
  const int y_ticks = ticks_over(frame.bottom - frame.top);
  for (const auto& [value, text] : frame.x.ticks(x_ticks)) {
    const double x = frame.x.at(value);
    svg += fmt::format(
        "<path class=\"hm-grid\" d=\"M{0:.1f} {1:.1f}V{2:.1f}\"/><text x=\"{0:.1f}\" y=\"{3:.1f}\" "
        "text-anchor=\"middle\">{4}</text>",
        x, frame.top, frame.bottom, frame.bottom + 18, text);
  }
  for (const auto& [value, text] : frame.y.ticks(y_ticks)) {
    const double y = frame.y.at(value);
    svg += fmt::format(
        "<path class=\"hm-grid\" d=\"M{0:.1f} {1:.1f}H{2:.1f}\"/><text x=\"{3:.1f}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5}</text>",
        frame.left, y, frame.right, frame.left - 7, y + 4.5, text);
  }
  svg += fmt::format("<path class=\"hm-frame\" d=\"M{:.1f} {:.1f}V{:.1f}H{:.1f}\"/>", frame.left, frame.top,
                     frame.bottom, frame.right);
  double y = frame.bottom + 20;
  for (const std::string& line : label_lines(options))
    svg += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>",
                       0.5 * (frame.left + frame.right), y += 18, escape_markup(line));
  svg += fmt::format("<text transform=\"translate(16 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
                     0.5 * (frame.top + frame.bottom), escape_markup(options.y.label));
  return svg;
}

std::string draw_marks(const Frame& frame, const PlotOptions& options) {
  std::string svg;
  for (const PlotMark& mark : options.marks) {
    const bool vertical = mark.direction == PlotMark::Direction::kVertical;
    if (!(vertical ? frame.x : frame.y).shows(mark.value)) continue;
    const double at = (vertical ? frame.x : frame.y).at(mark.value);
    const std::string label = escape_markup(mark.label);
    if (vertical) {
      const bool right_half = at > 0.5 * (frame.left + frame.right);
      svg += fmt::format(
          "<path class=\"hm-mark\" d=\"M{0:.1f} {1:.1f}V{2:.1f}\"/><text x=\"{3:.1f}\" y=\"{4:.1f}\" "
          "text-anchor=\"{5}\">{6}</text>",
          at, frame.top, frame.bottom, at + (right_half ? -5 : 5), frame.top + 12,
          right_half ? "end" : "start", label);
    } else {
      svg += fmt::format(
          "<path class=\"hm-mark\" d=\"M{1:.1f} {0:.1f}H{2:.1f}\"/><text x=\"{2:.1f}\" y=\"{3:.1f}\" "
          "text-anchor=\"end\">{4}</text>",
          at, frame.left, frame.right, at - 5, label);
    }
  }
  return svg;
}

/// Draws the colour bar in a row of its own.
std::string draw_color_bar(const PlotColorBar& bar, double y) {
  std::string svg;
  const double left = 20 + 8.2 * static_cast<double>(bar.low.size()),
               step = 140.0 / static_cast<double>(bar.colors.size());
  for (std::size_t i = 0; i < bar.colors.size(); ++i)
    svg +=
        fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"11\" fill=\"{}\"/>",
                    left + static_cast<double>(i) * step, y - 10, step + 0.5, escape_markup(bar.colors[i]));
  return svg +
         fmt::format("<text x=\"12\" y=\"{0:.1f}\">{1}</text><text x=\"{2:.1f}\" y=\"{0:.1f}\">{3}</text>", y,
                     escape_markup(bar.low), left + 148, escape_markup(bar.high));
}

/// Draws the colour bar and the names under the title, in one or more rows; nothing for a single unnamed
/// series.
std::string draw_legend(std::span<const PlotSeries> series, const PlotOptions& options, int& rows) {
  rows = 0;
  std::string svg;
  const double first_y = options.title.empty() ? 4 : 28;
  if (!options.color_bar.colors.empty()) svg += draw_color_bar(options.color_bar, first_y + 20.0 * ++rows);
  if (std::all_of(series.begin(), series.end(), [](const PlotSeries& s) { return s.name.empty(); }))
    return svg;
  double x = 12;
  ++rows;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (series[i].name.empty()) continue;
    const double width = 28 + 8.2 * static_cast<double>(series[i].name.size());
    if (x + width > options.width_px && x > 12) {
      x = 12;
      ++rows;
    }
    const double y = first_y + 20.0 * rows;
    svg += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"12\" height=\"12\" rx=\"2\" fill=\"{}\"/><text "
        "x=\"{:.1f}\" y=\"{:.1f}\">{}</text>",
        x, y - 11, color(series[i], i), x + 17, y, escape_markup(series[i].name));
    x += width + 10;
  }
  return svg;
}

/// The drawable points of a series as pieces without gaps, in pixels.
std::vector<std::vector<Vec2>> pieces_of(const PlotSeries& series, const Frame& frame) {
  std::vector<std::vector<Vec2>> pieces(1);
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const Vec2 p(frame.x.at(series.x[i]), frame.y.at(series.y[i]));
    if (p.allFinite())
      pieces.back().push_back(p);
    else if (!pieces.back().empty())
      pieces.emplace_back();
  }
  if (pieces.back().empty()) pieces.pop_back();
  return pieces;
}

std::string path_of(const std::vector<Vec2>& points, bool step) {
  std::string path = fmt::format("M{:.1f} {:.1f}", points[0].x(), points[0].y());
  for (std::size_t i = 1; i < points.size(); ++i)
    path += step ? fmt::format("H{:.1f}V{:.1f}", points[i].x(), points[i].y())
                 : fmt::format("L{:.1f} {:.1f}", points[i].x(), points[i].y());
  return path;
}

std::string draw_series(const PlotSeries& series, std::size_t index, const Frame& frame) {
  std::string svg;
  for (const std::vector<Vec2>& piece : pieces_of(series, frame)) {
    if (series.style == SeriesStyle::kScatter || piece.size() == 1) {
      for (const Vec2& p : piece)
        svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.4\" fill=\"{}\" fill-opacity=\".75\"/>",
                           p.x(), p.y(), color(series, index));
      continue;
    }
    const std::string path = path_of(piece, series.style == SeriesStyle::kStep);
    if (series.style == SeriesStyle::kArea)
      svg += fmt::format("<path d=\"{}L{:.1f} {:.1f}H{:.1f}Z\" fill=\"{}\" fill-opacity=\".25\"/>", path,
                         piece.back().x(), frame.bottom, piece.front().x(), color(series, index));
    svg += fmt::format(
        "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\" stroke-linejoin=\"round\"/>", path,
        color(series, index));
  }
  return svg;
}

/// Draws filled bands between cumulative sums, at the first series' x.
std::string draw_stack(std::span<const PlotSeries> series, const Frame& frame) {
  std::string svg;
  std::vector<double> below(series[0].x.size(), 0.0);
  for (std::size_t s = 0; s < series.size(); ++s) {
    std::vector<Vec2> top, bottom;
    for (std::size_t i = 0; i < below.size(); ++i) {
      const double value = i < series[s].y.size() && std::isfinite(series[s].y[i]) ? series[s].y[i] : 0.0;
      const double x = frame.x.at(series[0].x[i]);
      if (!std::isfinite(x)) continue;
      bottom.emplace_back(x, frame.y.at(below[i]));
      below[i] += value;
      top.emplace_back(x, frame.y.at(below[i]));
    }
    if (top.empty()) continue;
    std::reverse(bottom.begin(), bottom.end());
    std::string back = path_of(bottom, false);
    back[0] = 'L';
    svg += fmt::format("<path d=\"{}{}Z\" fill=\"{}\" fill-opacity=\".85\"/>", path_of(top, false), back,
                       color(s));
  }
  return svg;
}

std::vector<double> all_values(std::span<const PlotSeries> series, bool of_x, bool stacked) {
  std::vector<double> values;
  if (stacked && !of_x) {
    values.assign(series[0].x.size(), 0.0);
    for (const PlotSeries& s : series)
      for (std::size_t i = 0; i < std::min(values.size(), s.y.size()); ++i)
        if (std::isfinite(s.y[i])) values[i] += s.y[i];
    return values;
  }
  for (const PlotSeries& s : series)
    values.insert(values.end(), (of_x ? s.x : s.y).begin(), (of_x ? s.x : s.y).end());
  return values;
}

/// Widens one range so that a unit is as long on both axes.
void equalise(std::pair<double, double>& x, std::pair<double, double>& y, double aspect) {
  const double x_span = x.second - x.first, y_span = y.second - y.first;
  auto& narrow = x_span < y_span * aspect ? x : y;
  const double wanted = x_span < y_span * aspect ? y_span * aspect : x_span / aspect;
  const double middle = 0.5 * (narrow.first + narrow.second);
  narrow = {middle - 0.5 * wanted, middle + 0.5 * wanted};
}

/// Averages the values in `steps` equal parts, to limit the size of a plot.
PlotSeries thinned(const PlotSeries& series, std::size_t steps) {
  if (series.x.size() <= steps) return series;
  PlotSeries out{series.name, {}, {}, series.style};
  for (std::size_t s = 0; s < steps; ++s) {
    const std::size_t begin = s * series.x.size() / steps, end = (s + 1) * series.x.size() / steps;
    double x = 0, y = 0, finite = 0;
    for (std::size_t i = begin; i < end; ++i) {
      x += series.x[i];
      if (!std::isfinite(series.y[i])) continue;
      y += series.y[i];
      finite += 1;
    }
    out.x.push_back(x / static_cast<double>(end - begin));
    out.y.push_back(finite > 0 ? y / finite : std::nan(""));
  }
  return out;
}

}  // namespace

std::string plot_svg(std::span<const PlotSeries> series, const PlotOptions& options) {
  bool drawable = false, area = options.stacked;
  for (const PlotSeries& s : series) {
    HM_CHECK(s.x.size() == s.y.size(), "{}: {} x, {} y", s.name, s.x.size(), s.y.size());
    for (std::size_t i = 0; i < s.x.size(); ++i)
      drawable = drawable || (std::isfinite(s.x[i]) && std::isfinite(s.y[i]) &&
                              (options.x.scale == AxisScale::kLinear || s.x[i] > 0) &&
                              (options.y.scale == AxisScale::kLinear || s.y[i] > 0));
    area = area || s.style == SeriesStyle::kArea;
  }
  if (!drawable) return no_data(options);
  int legend_rows = 0;
  const std::string legend = draw_legend(series, options, legend_rows);
  const double right = options.width_px - 16.0,
               bottom = options.height_px - 30.0 - 18.0 * static_cast<double>(label_lines(options).size());
  const double top = (options.title.empty() ? 12 : 34) + 20.0 * legend_rows;
  auto x_range = axis_range(options.x, all_values(series, true, options.stacked), false);
  auto y_range = axis_range(options.y, all_values(series, false, options.stacked), area);
  const double left = 36 + 8.4 * static_cast<double>(longest_tick(options.y, y_range, bottom - top));
  if (options.equal_aspect) equalise(x_range, y_range, (right - left) / (bottom - top));
  const Frame frame{left,
                    right,
                    top,
                    bottom,
                    AxisMap(options.x, x_range.first, x_range.second, left, right),
                    AxisMap(options.y, y_range.first, y_range.second, bottom, top)};
  static constexpr std::string_view kClip =
      "<svg x=\"{0:.1f}\" y=\"{1:.1f}\" width=\"{2:.1f}\" height=\"{3:.1f}\" "
      "viewBox=\"{0:.1f} {1:.1f} {2:.1f} {3:.1f}\">";
  std::string svg = open_svg(options) + legend + draw_axes(frame, options);
  svg += fmt::format(kClip, left, top, right - left, bottom - top);  // an inner svg clips to its box
  if (options.stacked)
    svg += draw_stack(series, frame);
  else
    for (std::size_t i = 0; i < series.size(); ++i) svg += draw_series(series[i], i, frame);
  return svg + "</svg>" + draw_marks(frame, options) + "</svg>";
}

std::string histogram_svg(std::span<const float> values, int bins, const PlotOptions& options) {
  HM_CHECK(bins > 0, "bins = {}", bins);
  std::vector<double> finite;
  for (const float v : values)
    if (std::isfinite(v)) finite.push_back(static_cast<double>(v));
  PlotOptions drawn = options;
  drawn.x.scale = AxisScale::kLinear;
  if (finite.empty()) return plot_svg({}, drawn);
  if (!(drawn.x.max > drawn.x.min)) {
    drawn.x.min = quantile(finite, 0.005);
    drawn.x.max = quantile(finite, 0.995);
    if (!(drawn.x.max > drawn.x.min)) {
      drawn.x.min -= 0.5;
      drawn.x.max += 0.5;
    }
  }
  std::vector<double> counts(static_cast<std::size_t>(bins), 0.0);
  const double step = (drawn.x.max - drawn.x.min) / bins;
  std::size_t outside = 0;
  for (const double v : finite) {
    if (v < drawn.x.min || v > drawn.x.max) {
      ++outside;
      continue;
    }
    counts[std::min(counts.size() - 1, static_cast<std::size_t>((v - drawn.x.min) / step))] += 1;
  }
  PlotSeries bars{"", {}, {}, SeriesStyle::kArea};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double share = 100 * counts[i] / static_cast<double>(finite.size());
    for (const double edge : {0.0, 1.0}) {
      bars.x.push_back(drawn.x.min + (static_cast<double>(i) + edge) * step);
      bars.y.push_back(share);
    }
  }
  if (drawn.y.label.empty()) drawn.y.label = "share (%)";
  if (outside > 0)
    drawn.x.label += fmt::format("{}{:.2g} % outside", drawn.x.label.empty() ? "" : "; ",
                                 100.0 * static_cast<double>(outside) / static_cast<double>(finite.size()));
  return plot_svg(std::span(&bars, 1), drawn);
}

std::string stacked_series_svg(std::span<const PlotSeries> stages, const PlotOptions& options) {
  PlotOptions drawn = options;
  drawn.stacked = true;
  std::vector<PlotSeries> thin;
  for (const PlotSeries& stage : stages) {
    HM_CHECK(stage.x.size() == stages[0].x.size() && stage.x.size() == stage.y.size(), "{}: {} x, {} y",
             stage.name, stage.x.size(), stage.y.size());
    thin.push_back(thinned(stage, static_cast<std::size_t>(std::max(2, options.width_px / 3))));
  }
  return plot_svg(thin, drawn);
}

std::string set_aside_unphysical(std::vector<PlotSeries>& series, double limit, std::string_view unit) {
  PlotSeries beyond{{}, {}, {}, SeriesStyle::kScatter, "var(--beyond)"};
  double largest = 0;
  for (PlotSeries& values : series)
    for (std::size_t i = 0; i < values.y.size(); ++i) {
      if (!(std::abs(values.y[i]) > limit)) continue;
      largest = std::max(largest, std::abs(values.y[i]));
      beyond.x.push_back(values.x[i]);
      beyond.y.push_back(std::copysign(limit, values.y[i]));
      values.y[i] = std::nan("");
    }
  if (beyond.x.empty()) return {};
  const std::size_t count = beyond.x.size();
  beyond.name = fmt::format("{} not physical", count);
  series.push_back(std::move(beyond));
  return fmt::format(
      " {} {} beyond {:g} {}, up to {:.3g}: no vehicle and no hand moves so; look for wrong stamps there.",
      count, count == 1 ? "value lies" : "values lie", limit, unit, largest);
}

std::string trajectory_svg(std::span<const NamedTrajectory> trajectories, const PlotOptions& options) {
  PlotOptions drawn = options;
  drawn.equal_aspect = true;
  if (drawn.x.label.empty()) drawn.x.label = "x (m)";
  if (drawn.y.label.empty()) drawn.y.label = "y (m)";
  std::vector<PlotSeries> series;
  PlotSeries start{"start", {}, {}, SeriesStyle::kScatter};
  for (const NamedTrajectory& named : trajectories) {
    HM_CHECK(named.trajectory != nullptr, "{}", named.name);
    PlotSeries line{named.name, {}, {}, SeriesStyle::kLine};
    const std::size_t step = named.trajectory->size() / 4000 + 1;
    for (std::size_t i = 0; i < named.trajectory->size(); i += step) {
      const Vec3& p = (*named.trajectory)[i].T_world_base.translation();
      line.x.push_back(p.x());
      line.y.push_back(p.y());
    }
    if (!line.x.empty()) {
      start.x.push_back(line.x.front());
      start.y.push_back(line.y.front());
    }
    series.push_back(std::move(line));
  }
  series.push_back(std::move(start));
  return plot_svg(series, drawn);
}

std::string escape_markup(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') out += c;
    }
  }
  return out;
}

}  // namespace hm
