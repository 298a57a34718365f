#include "hm/pipeline/dense/reconstruction_report.hpp"

#include <array>
#include <map>

#include "hm/report/plot.hpp"
#include "hm/pipeline/dense/alignment_summary.hpp"
#include "hm/core/process_memory.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

struct Stage {
  const char* name;
  double FrameRecord::*ms;
};
constexpr std::array<Stage, 8> kStages{{{"waiting for pictures", &FrameRecord::wait_ms},
                                        {"aligning", &FrameRecord::align_ms},
                                        {"allocating volumes", &FrameRecord::allocate_ms},
                                        {"integrating", &FrameRecord::integrate_ms},
                                        {"carving", &FrameRecord::carve_ms},
                                        {"meshing", &FrameRecord::mesh_ms},
                                        {"packing", &FrameRecord::pack_ms},
                                        {"saving", &FrameRecord::save_ms}}};

std::vector<double> values_of(const ReconstructionSummary& summary, double FrameRecord::*member) {
  std::vector<double> values;
  for (const FrameRecord& record : summary.records) values.push_back(record.*member);
  return values;
}

std::vector<double> megabytes_of(const ReconstructionSummary& summary, std::size_t FrameRecord::*member) {
  std::vector<double> values;
  for (const FrameRecord& record : summary.records)
    values.push_back(static_cast<double>(record.*member) * 1e-6);
  return values;
}

/// 1234567 -> "1,234,567".
std::string grouped(std::size_t number) {
  const std::string digits = std::to_string(number);
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && (digits.size() - i) % 3 == 0) text += ',';
    text += digits[i];
  }
  return text;
}

void add_cards(HtmlReport& report, const ReconstructionSummary& summary) {
  report.add_card({"frames",
                   grouped(summary.frames_integrated),
                   {},
                   fmt::format("of {}; {} skipped", summary.frames_total, summary.skipped.size())});
  report.add_card({"integration", fmt::format("{:.1f}", summary.integrate_ms.median), "ms",
                   fmt::format("per frame, median; 99 % under {:.1f} ms", summary.integrate_ms.p99)});
  report.add_card({"mesh", grouped(summary.triangles), "triangles",
                   fmt::format("{} vertices", grouped(summary.vertices))});
  report.add_card({"map", fmt::format("{:.1f}", static_cast<double>(summary.map_bytes) * 1e-6), "MB",
                   fmt::format("{} volumes, {:.1f} MB on disk", grouped(summary.volumes),
                               static_cast<double>(summary.map_file_bytes) * 1e-6)});
  if (!summary.error) return;
  const MeshAccuracy& accuracy = summary.error->accuracy;
  report.add_card({"surface error", fmt::format("{:.1f}", accuracy.distance_m.mean * 1e3), "mm",
                   fmt::format("mean; 95 % under {:.1f} mm, bias {:+.1f} mm", accuracy.distance_m.p95 * 1e3,
                               accuracy.bias_m * 1e3)});
  report.add_card({"completeness", fmt::format("{:.1f}", summary.error->completeness.ratio * 100), "%",
                   fmt::format("of what could be seen, within {:.0f} mm",
                               summary.parameters.mesh_error.threshold_m * 1e3)});
}

void add_time_section(HtmlReport& report, const ReconstructionSummary& summary) {
  report.begin_section("Time", fmt::format("{} frames in {:.1f} s: {:.1f} frames per second, on {} {}.",
                                           summary.frames_this_run, summary.run_s, summary.frames_per_s,
                                           summary.threads, summary.threads == 1 ? "thread" : "threads"));
  std::vector<double> frames;
  for (const FrameRecord& record : summary.records) frames.push_back(static_cast<double>(record.index));
  std::vector<PlotSeries> stages;
  std::vector<std::vector<std::string>> rows;
  for (const Stage& stage : kStages) {
    stages.push_back({stage.name, frames, values_of(summary, stage.ms), SeriesStyle::kArea});
    const Summary times = summarise(stages.back().y);
    rows.push_back({stage.name, fmt::format("{:.2f}", times.mean), fmt::format("{:.2f}", times.median),
                    fmt::format("{:.2f}", times.p99), fmt::format("{:.2f}", times.max)});
  }
  PlotOptions plot;
  plot.x.label = "frame", plot.y.label = "time (ms)";
  report.add_svg(stacked_series_svg(stages, plot), "Where the time of each frame went.");
  report.add_table({"stage", "mean (ms)", "median (ms)", "99 % (ms)", "longest (ms)"}, rows);
}

void add_memory_section(HtmlReport& report, const ReconstructionSummary& summary) {
  report.begin_section("Memory", fmt::format("At most {:.0f} MB for the whole process.",
                                             static_cast<double>(peak_resident_bytes()) * 1e-6));
  const auto time_s = values_of(summary, &FrameRecord::time_s);
  const std::array<PlotSeries, 3> series{
      {{"process", time_s, megabytes_of(summary, &FrameRecord::resident_bytes), SeriesStyle::kLine},
       {"map", time_s, megabytes_of(summary, &FrameRecord::map_bytes), SeriesStyle::kLine},
       {"mesh", time_s, megabytes_of(summary, &FrameRecord::mesh_bytes), SeriesStyle::kLine}}};
  PlotOptions plot;
  plot.x.label = "time (s)", plot.y.label = "memory (MB)";
  report.add_svg(plot_svg(series, plot), "Memory over the run.");
}

void add_recording_section(HtmlReport& report, const ReconstructionSummary& summary) {
  const RecordingInfo& info = summary.recording;
  const PinholeCamera& camera = info.camera;
  report.begin_section("Recording");
  report.add_table(
      {"what", "value"},
      {{"folder", info.path.string()},
       {"kind", std::string(to_string(info.kind))},
       {"depth pictures", grouped(info.frame_count)},
       {"camera", fmt::format("{} x {}, f {:.1f} {:.1f}, c {:.1f} {:.1f} ({})", camera.width, camera.height,
                              camera.fx, camera.fy, camera.cx, camera.cy, info.camera_source)},
       {"depth unit", fmt::format("{:g} mm", info.depth_unit_m * 1e3)},
       {"path", fmt::format("{:.2f} m", path_length(summary.trajectory))}});
}

void add_skipped(HtmlReport& report, const ReconstructionSummary& summary) {
  if (summary.skipped.empty()) return;
  std::map<std::string, std::size_t> reasons;
  std::string all;
  for (const SkippedFrame& frame : summary.skipped) {
    ++reasons[frame.reason];
    all += fmt::format("{}: {}\n", frame.index, frame.reason);
  }
  report.begin_section("Skipped frames");
  std::vector<std::vector<std::string>> rows;
  for (const auto& [reason, count] : reasons) {
    if (rows.size() == 12) break;
    rows.push_back({reason, std::to_string(count)});
  }
  report.add_table({"reason", "frames"}, rows);
  report.add_collapsible(fmt::format("all {} of them", summary.skipped.size()), all);
}

}  // namespace

std::string report_html(const ReconstructionSummary& summary, const ReportMaterial& material) {
  using Verdict = HtmlReport::Verdict;
  HtmlReport report("Reconstruction of " + summary.recording.path.filename().string());
  const bool empty = summary.triangles == 0;
  report.set_verdict(
      empty                      ? Verdict::kBad
      : summary.warnings.empty() ? Verdict::kGood
                                 : Verdict::kDoubtful,
      empty ? "No surface was found."
            : fmt::format("{} frames became a mesh of {} triangles at {:g} mm, {:.1f} frames per second.",
                          grouped(summary.frames_integrated), grouped(summary.triangles),
                          summary.parameters.tsdf.voxel_size_m * 1e3, summary.frames_per_s));
  add_cards(report, summary);
  add_warnings_section(report, summary.warnings);
  if (!material.pictures.empty()) report.begin_section("Pictures");
  for (const MeshPicture& picture : material.pictures) add_picture(report, picture);
  if (summary.error) add_error_histogram(report, *summary.error);
  add_alignment_section(report, summary);
  add_time_section(report, summary);
  add_memory_section(report, summary);
  add_recording_section(report, summary);
  add_skipped(report, summary);
  return page_with_parameters(report, material.parameters_toml, material.program_version);
}

JsonValue report_json(const ReconstructionSummary& summary, const std::string& program_version) {
  auto json = to_json(summary);
  json["version"] = program_version;
  json["recording"] = summary.recording.path.string();
  auto series = JsonValue::object();
  auto frames = JsonValue::array();
  for (const FrameRecord& record : summary.records) frames.push_back(record.index);
  series["frame"] = std::move(frames);
  const auto add = [&](const char* key, const std::vector<double>& values) {
    series[key] = JsonValue::array_of(values);
  };
  add("time_s", values_of(summary, &FrameRecord::time_s));
  add("wait_ms", values_of(summary, &FrameRecord::wait_ms));
  add("align_ms", values_of(summary, &FrameRecord::align_ms));
  add("allocate_ms", values_of(summary, &FrameRecord::allocate_ms));
  add("integrate_ms", values_of(summary, &FrameRecord::integrate_ms));
  add("carve_ms", values_of(summary, &FrameRecord::carve_ms));
  add("mesh_ms", values_of(summary, &FrameRecord::mesh_ms));
  add("pack_ms", values_of(summary, &FrameRecord::pack_ms));
  add("save_ms", values_of(summary, &FrameRecord::save_ms));
  add("resident_mb", megabytes_of(summary, &FrameRecord::resident_bytes));
  add("map_mb", megabytes_of(summary, &FrameRecord::map_bytes));
  add("mesh_mb", megabytes_of(summary, &FrameRecord::mesh_bytes));
  json["series"] = std::move(series);
  return json;
}

}  // namespace hm
