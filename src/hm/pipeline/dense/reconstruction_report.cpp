#include "hm/pipeline/dense/reconstruction_report.hpp"

#include <array>
#include <map>

#include "hm/core/process_memory.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/pipeline/dense/alignment_summary.hpp"
#include "hm/report/plot.hpp"
#include "hm/report/run_report.hpp"

namespace hm {
namespace {

struct Stage {
  const char *key, *name;
  double FrameRecord::*ms;
};
constexpr std::array<Stage, 8> kStages{{{"wait_ms", "waiting for images", &FrameRecord::wait_ms},
                                        {"align_ms", "aligning", &FrameRecord::align_ms},
                                        {"allocate_ms", "allocating blocks", &FrameRecord::allocate_ms},
                                        {"integrate_ms", "integrating", &FrameRecord::integrate_ms},
                                        {"carve_ms", "carving", &FrameRecord::carve_ms},
                                        {"mesh_ms", "meshing", &FrameRecord::mesh_ms},
                                        {"pack_ms", "packing", &FrameRecord::pack_ms},
                                        {"save_ms", "saving", &FrameRecord::save_ms}}};

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

void add_key_numbers(HtmlReport& report, const SummaryTree& summary) {
  add_cards(report, summary,
            {{"surface error", "{surface_error_mm.mean}",
              "mean; 95 % under {surface_error_mm.p95}, bias {surface_error_mm.bias}"},
             {"completeness", "{completeness_ratio}", "of what could be seen"},
             {"frames", "{frames.integrated}", "of {frames.total}; {frames.skipped} skipped"},
             {"path", "{path_length_m}", "of the camera"},
             {"voxels", "{voxel_size_m}", "edge length"},
             {"mesh", "{triangles|triangle}",
              "{vertices|vertex|vertices}[; pieces under {min_piece_size_m} are left out]"}});
}

/// First sentence of the report: contents and quality of the result.
std::string verdict_of(const SummaryTree& summary, const std::optional<SceneSize>& size) {
  const std::string what = size ? to_text(*size) + ". " : std::string();
  if (const auto measured = summary.sentence("{surface_error_mm.mean} from the true surface on average, "
                                             "{completeness_ratio} of what could be seen is there."))
    return what + *measured;
  return what + *summary.sentence(
                    "{frames.integrated} of {frames.total|frame} became a surface at voxels of "
                    "{voxel_size_m}; there is no truth to compare it with.");
}

void add_time_section(HtmlReport& report, const ReconstructionSummary& summary) {
  if (summary.frames_this_run == 0) return;  // resumed when all frames were in the map
  report.begin_section("Time", fmt::format("{} in {:.1f} s: {:.1f} frames per second, on {}.",
                                           counted(summary.frames_this_run, "frame"), summary.run_s,
                                           summary.frames_per_s, counted(summary.threads, "thread")));
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
  report.begin_section(
      "Memory",
      fmt::format(
          "At most {:.0f} MB for the whole process; the map takes {:.1f} MB ({} volumes), {:.1f} MB on disk.",
          static_cast<double>(peak_resident_bytes()) * 1e-6, static_cast<double>(summary.map_bytes) * 1e-6,
          summary.volumes, static_cast<double>(summary.map_file_bytes) * 1e-6));
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
       {"depth images", with_thousands(info.frame_count)},
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
    rows.push_back({reason, with_thousands(count)});
  }
  report.add_table({"reason", "frames"}, rows);
  report.add_collapsible(fmt::format("all {} of them", summary.skipped.size()), all);
}

}  // namespace

std::string report_html(const ReconstructionSummary& summary, const ReportMaterial& material) {
  const SummaryTree tree = describe(summary);
  HtmlReport report(folder_title(summary.recording.path), "Reconstruction");
  const bool empty = summary.triangles == 0;
  report.set_verdict(empty ? HtmlReport::Verdict::kBad : report_verdict(summary.verdict),
                     empty ? "No surface was found."
                           : verdict_sentence(summary.verdict, verdict_of(tree, material.scene.size)));
  report.set_model(material.scene.model_html);
  add_key_numbers(report, tree);
  add_warnings_section(report, summary.warnings);
  if (!material.figures.empty()) report.begin_section("Figures");
  add_floor_plan(report, material.scene);
  for (const Figure& figure : material.figures) add_figure(report, figure);
  if (summary.error) add_error_histogram(report, *summary.error);
  add_alignment_section(report, summary);
  add_visits_section(report, summary.verdict);
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
  json["poses"] = summary.pose_source.string();
  auto series = JsonValue::object();
  std::vector<std::size_t> frames;
  for (const FrameRecord& record : summary.records) frames.push_back(record.index);
  series["frame"] = JsonValue::array_of(frames);
  series["time_s"] = JsonValue::array_of(values_of(summary, &FrameRecord::time_s));
  for (const Stage& stage : kStages) series[stage.key] = JsonValue::array_of(values_of(summary, stage.ms));
  for (const auto& [key, bytes] :
       {std::pair{"resident_mb", &FrameRecord::resident_bytes}, std::pair{"map_mb", &FrameRecord::map_bytes},
        std::pair{"mesh_mb", &FrameRecord::mesh_bytes}})
    series[key] = JsonValue::array_of(megabytes_of(summary, bytes));
  json["series"] = std::move(series);
  return json;
}

}  // namespace hm
