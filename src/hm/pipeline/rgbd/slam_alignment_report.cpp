#include <array>
#include <map>

#include "hm/report/path_plots.hpp"
#include "hm/pipeline/rgbd/slam_alignment.hpp"

namespace hm {
namespace {

/// Frames that kept odometry's motion.
std::map<AlignmentStatus, std::size_t> refused(const SlamAlignmentSummary& summary) {
  std::map<AlignmentStatus, std::size_t> counts;
  for (const SlamAlignedFrame& frame : summary.frames)
    if (frame.status != AlignmentStatus::kAccepted) ++counts[frame.status];
  return counts;
}

Summary moved_m(const SlamAlignmentSummary& summary) {
  std::vector<double> shifts;
  for (const SlamAlignedFrame& frame : summary.frames)
    if (frame.status == AlignmentStatus::kAccepted) shifts.push_back(frame.shift_m);
  return summarise(shifts);
}

PlotSeries series_of(const SlamAlignmentSummary& summary, const char* name,
                     double SlamAlignedFrame::*member) {
  PlotSeries series{name, {}, {}, SeriesStyle::kLine};
  for (const SlamAlignedFrame& frame : summary.frames) {
    series.x.push_back(static_cast<double>(frame.index));
    series.y.push_back(frame.*member * 1e3);
  }
  return series;
}

}  // namespace

JsonValue to_json(const SlamAlignmentSummary& summary) {
  auto json = JsonValue::object({{"accepted", summary.accepted}, {"not_accepted", summary.not_accepted}});
  auto reasons = JsonValue::object();
  for (const auto& [status, frames] : refused(summary)) reasons[std::string(to_string(status))] = frames;
  json["refused"] = std::move(reasons);
  const Summary moved = moved_m(summary);
  json["moved_m"] = JsonValue::object({{"median", moved.median}, {"p99", moved.p99}, {"max", moved.max}});
  json["mean_ms"] = summary.milliseconds.mean;
  json["p99_ms"] = summary.milliseconds.p99;
  return json;
}

void add_alignment_section(HtmlReport& report, const SlamAlignmentSummary& summary) {
  const Summary moved = moved_m(summary);
  report.begin_section(
      "Dense alignment",
      fmt::format(
          "{} of {} depth pictures were aligned to what was seen just before them, and moved their "
          "camera by {:.1f} mm (median; {:.1f} mm at most); {:.1f} ms a frame (99 % under {:.1f} ms). "
          "Odometry, above and below, is what alignment made of it.",
          summary.accepted, summary.frames.size(), moved.median * 1e3, moved.max * 1e3,
          summary.milliseconds.mean, summary.milliseconds.p99));
  if (summary.frames.empty()) return;
  std::vector<std::vector<std::string>> rows{{"aligned", std::to_string(summary.accepted), ""}};
  for (const auto& [status, frames] : refused(summary))
    rows.push_back({std::string(to_string(status)), std::to_string(frames), summary.first_reason.at(status)});
  report.add_table({"outcome", "frames", "the first, why"}, rows);
  const std::array<PlotSeries, 2> distances{series_of(summary, "before", &SlamAlignedFrame::rms_before_m),
                                            series_of(summary, "after", &SlamAlignedFrame::rms_after_m)};
  add_frame_plot(report, distances, "distance (mm)",
                 "Distance of the depth pictures from what was seen before (rms of what agrees).");
  const std::array<PlotSeries, 2> moves{series_of(summary, "by this picture", &SlamAlignedFrame::shift_m),
                                        series_of(summary, "in all", &SlamAlignedFrame::drift_m)};
  add_frame_plot(report, moves, "moved (mm)",
                 "How far each picture moved its camera, and how far all so far have.");
}

}  // namespace hm
