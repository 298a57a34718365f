#include "hm/pipeline/experiments/rgbd/odometry_experiment.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <memory>

#include "hm/core/angle.hpp"
#include "hm/pipeline/experiments/common/experiment_frames.hpp"
#include "hm/pipeline/rgbd/visual_tracking.hpp"
#include "hm/report/path_plots.hpp"

namespace hm {
namespace {

constexpr std::array kComparedMethods{OdometryMethod::kPublishedRansacIcp, OdometryMethod::kTracker};
constexpr std::array kComparedMethodWords{"published pipeline", "tracker"};

/// A recording tracked by each method.
struct TrackedRecording {
  std::string words;
  Trajectory truth;
  std::array<VisualTrack, kComparedMethods.size()> tracks;
  std::array<TrajectoryError, kComparedMethods.size()> errors;
  std::array<double, kComparedMethods.size()> cpu_s{};  ///< processor time of all frames
};

Result<TrackedRecording> track_recording(const ExperimentFrames& frames, const ExperimentOptions& options) {
  TrackedRecording result;
  result.words = frames.words;
  const auto first = frames.source->read(0);
  if (!first) return forward_error(first);
  std::vector<VisualTracking> trackers;
  for (const OdometryMethod method : kComparedMethods) {
    OdometryParams params;
    params.method = method;
    params.features = options.parameters.features;
    VisualTracking::Start start;
    start.frames_total = frames.count;
    start.T_odom_first_camera = first->T_world_camera.value_or(SE3());
    trackers.emplace_back(params, frames.source->camera(), start);
  }
  const auto done = for_each_frame(frames, options.run, [&](const RgbdFrame& frame) -> Result<void> {
    if (frame.T_world_camera) result.truth.push_back({frame.stamp, *frame.T_world_camera});
    for (std::size_t i = 0; i < trackers.size(); ++i) {
      const std::clock_t begin = std::clock();  // of the whole process, whatever else the machine does
      trackers[i].take(frame.index, frame, 0);
      result.cpu_s[i] += static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
    }
    return {};
  });
  if (!done) return forward_error(done);
  for (std::size_t i = 0; i < trackers.size(); ++i) {
    result.tracks[i] = trackers[i].finish();
    auto error = evaluate_trajectory(result.truth, result.tracks[i].trajectory);
    if (!error) return forward_error(error);
    result.errors[i] = std::move(*error);
  }
  return result;
}

Result<std::vector<ExperimentFrames>> tracked_sources(const ExperimentOptions& options,
                                                      ExperimentFindings& findings) {
  std::vector<ExperimentFrames> sources;
  const int most = options.tiny ? 12 : 100'000;
  for (const char* name : {"tum_fr1_xyz", "tum_fr1_rpy", "sevenscenes_a"}) {
    const auto path = options.data / "rgbd" / name;
    std::error_code code;
    if (options.data.empty() || !std::filesystem::is_directory(path, code)) continue;
    auto opened = recorded_frames(path, most);
    if (!opened) return forward_error(opened);
    sources.push_back(std::move(*opened));
    if (options.tiny) return sources;
  }
  if (!sources.empty()) return sources;
  findings.warnings.emplace_back(
      "no recording of folder rgbd is there: a simulated Kinect in the house instead");
  SimulationParams scene = options.parameters.simulation;
  scene.world = WorldKind::kHouse;
  scene.sensor = SensorPreset::kKinect;
  sources.push_back(simulated_frames(scene, options.tiny ? 12 : 600, options.run.threads));
  return sources;
}

void add_tracking_rows(const TrackedRecording& recording, std::vector<ExperimentRow>& rows) {
  constexpr double kCm = 100, kClaimed_hz = 30;
  for (std::size_t i = 0; i < kComparedMethods.size(); ++i) {
    const auto name = fmt::format("{}, {}: ", recording.words, kComparedMethodWords[i]);
    const TrajectoryError& error = recording.errors[i];
    const VisualTrack& track = recording.tracks[i];
    rows.push_back({name + "error over a second, RMS", {}, kCm * error.per_second.translation_m.rmse, "cm"});
    rows.push_back({name + "turn over a second off by, RMS",
                    {},
                    kDegreesPerRadian * error.per_second.rotation_rad.rmse,
                    "deg"});
    rows.push_back({name + "position error, RMS", {}, kCm * error.position_m.rmse, "cm"});
    rows.push_back({name + "frames without a pose", {}, static_cast<double>(track.frames_lost), ""});
    rows.push_back(
        {name + "points in the model at the end", {}, static_cast<double>(track.model_points), ""});
    rows.push_back({name + "frames in a second of processor time", kClaimed_hz,
                    static_cast<double>(track.frames_read) / std::max(1e-6, recording.cpu_s[i]), "Hz"});
  }
}

PlotSeries over_tracked_frames(std::string name, const VisualTrack& track,
                               double (*value)(const TrackingNumbers&)) {
  PlotSeries series{std::move(name), {}, {}};
  for (const VisualFrame& frame : track.frames) {
    series.x.push_back(static_cast<double>(frame.index));
    series.y.push_back(value(frame.numbers));
  }
  return series;
}

void add_tracking_figures(HtmlReport& report, const TrackedRecording& recording) {
  report.begin_section(fmt::format("{}: paths", recording.words),
                       "Fig. 3.12 and 3.15: aligned to the true path.");
  const Trajectory published = matched_estimate(recording.errors[0]),
                   tracker = matched_estimate(recording.errors[1]);
  const NamedTrajectory paths[] = {{"truth", &recording.truth},
                                   {kComparedMethodWords[0], &published},
                                   {kComparedMethodWords[1], &tracker}};
  add_path_views(report, paths, "True and estimated path.");
  report.begin_section("Sizes of data and model", "Fig. 3.13.");
  for (std::size_t i = 0; i < kComparedMethods.size(); ++i) {
    const PlotSeries sizes[] = {
        over_tracked_frames(
            "features with depth", recording.tracks[i],
            [](const TrackingNumbers& n) { return static_cast<double>(n.features_with_depth); }),
        over_tracked_frames("model", recording.tracks[i],
                            [](const TrackingNumbers& n) { return static_cast<double>(n.model_points); })};
    add_frame_plot(report, sizes, "points", kComparedMethodWords[i]);
  }
  report.begin_section("Durations", "Fig. 3.14, milliseconds of each stage.");
  for (std::size_t i = 0; i < kComparedMethods.size(); ++i) {
    const PlotSeries stages[] = {
        over_tracked_frames("features", recording.tracks[i],
                            [](const TrackingNumbers& n) { return n.features_ms; }),
        over_tracked_frames("prediction", recording.tracks[i],
                            [](const TrackingNumbers& n) { return n.prediction_ms; }),
        over_tracked_frames("registration", recording.tracks[i],
                            [](const TrackingNumbers& n) { return n.registration_ms; }),
        over_tracked_frames("model", recording.tracks[i],
                            [](const TrackingNumbers& n) { return n.model_ms; })};
    PlotOptions plot;
    plot.title = kComparedMethodWords[i];
    plot.x.label = "frame", plot.y.label = "duration (ms)";
    report.add_svg(stacked_series_svg(stages, plot), "Stages on top of each other.");
  }
}

}  // namespace

Result<ExperimentFindings> run_odometry_experiment(const ExperimentOptions& options) {
  ExperimentFindings findings;
  const auto sources = tracked_sources(options, findings);
  if (!sources) return forward_error(sources);
  const auto recordings = std::make_shared<std::vector<TrackedRecording>>();
  for (const ExperimentFrames& frames : *sources) {
    auto tracked = track_recording(frames, options);
    if (!tracked) return forward_error(tracked);
    add_tracking_rows(*tracked, findings.rows);
    recordings->push_back(std::move(*tracked));
  }
  findings.add_figures = [recordings](HtmlReport& report) {
    for (const TrackedRecording& recording : *recordings) add_tracking_figures(report, recording);
  };
  return findings;
}

}  // namespace hm
