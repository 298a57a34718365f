#pragma once
#include <string>

#include "hm/pipeline/rgbd/odometry_run.hpp"
#include "hm/report/html_report.hpp"

namespace hm {

/// Content of the report besides the summary.
struct OdometryReportMaterial {
  std::string program_version;
  std::string parameters_toml;
};

/// The self-contained page of a run: path (dissertation Fig. 3.12), error, sizes of model and data
/// (Fig. 3.13), time (Fig. 3.14), what was lost and why.
std::string odometry_report_html(const OdometrySummary& summary, const OdometryReportMaterial& material);
/// The summary as JSON, with the series behind the plots.
JsonValue odometry_report_json(const OdometrySummary& summary, const std::string& program_version);

// ---- parts that the report of a whole run shares; `summary` describes it ----
void add_tracking_cards(HtmlReport& report, const SummaryTree& summary);
void add_error_cards(HtmlReport& report, const SummaryTree& summary);
/// Sections: lost stretches, sizes per frame, time per frame, quality of the images, unused frames.
void add_tracking_sections(HtmlReport& report, const VisualTrack& track, const SummaryTree& summary);
/// Adds the recording's kind, size and camera as a section.
void add_rgbd_recording_section(HtmlReport& report, const RecordingInfo& info);
JsonValue tracking_series_json(const VisualTrack& track);

}  // namespace hm
