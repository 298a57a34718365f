#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hm/core/check.hpp"
#include "hm/core/statistics.hpp"
#include "hm/report/plot.hpp"

namespace hm {
namespace {

/// The means of the values in `steps` equal parts, so that a plot is never larger than it can show.
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
