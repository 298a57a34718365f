#include "hm/pipeline/scan/scan_run.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <memory>
#include <utility>

#include "hm/cameras/live_source.hpp"
#include "hm/core/check.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/pipeline/checks/preflight.hpp"
#include "hm/pipeline/common/mesh_output.hpp"
#include "hm/pipeline/common/run_records.hpp"
#include "hm/pipeline/common/sensor_prior.hpp"
#include "hm/pipeline/live/live_view.hpp"
#include "hm/pipeline/rgbd/slam_finish.hpp"
#include "hm/pipeline/scan/mapping_pace.hpp"
#include "hm/pipeline/scan/scan_frames.hpp"
#include "hm/pipeline/scan/scan_recorder.hpp"
#include "hm/pipeline/scan/scan_save.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"

namespace hm {
namespace {

namespace fs = std::filesystem;
using SteadyClock = std::chrono::steady_clock;

/// The camera as the start of tracking knows it.
bool is_from_kinect(const CameraDescription& camera) {
  RecordingInfo info;
  info.kind = RecordingKind::kTumRgbd;
  info.camera = camera.camera;
  return camera.is_kinect || is_from_kinect(info);
}

RunContext with_drops(const ScanOptions& options, const std::unique_ptr<LiveSource>& source) {
  const RunContext& run = options.run;
  RunContext scanning = run;
  scanning.threads = options.live_threads.value_or(run.threads);
  scanning.background = ThreadPriority::kLow;
  scanning.stop = {};  // Ctrl-C ends the capture; what follows is finished
  if (run.progress)
    scanning.progress = [sink = run.progress, &source](const Progress& progress) {
      const bool is_scanning = source && progress.stage == "tracking";
      if (!is_scanning) return sink(progress);
      sink({"scanning", progress.done, 0,
            fmt::format("{}, {} dropped", progress.details, source->counts().dropped_in_all())});
    };
  return scanning;
}

/// A scan from its first frame to its results.
class Scan {
 public:
  Scan(const ScanOptions& options, ResultFolder& folder, const CameraDescription& camera, TumWriter writer)
      : options_(options),
        folder_(folder),
        camera_(camera),
        recording_(options.output / "recording"),
        run_(with_drops(options, source_)),
        recorder_(std::move(writer)),
        frames_(recording_, camera.camera, [this](Time stamp) { recorder_.wait_for(stamp); }),
        pipeline_(SlamPipeline::create(
            {.camera = camera.camera, .frames = &frames_, .is_from_kinect = is_from_kinect(camera)},
            options.parameters, run_)) {}

  /// `request`: with which the driver was opened.
  Result<ScanSummary> run(const Recording* earlier, std::unique_ptr<CameraDriver> driver,
                          const CameraRequest& request);

 private:
  Result<std::unique_ptr<CameraDriver>> open_again(const CameraRequest& request) const;
  void track_earlier(const Recording& earlier);
  Result<void> capture(std::unique_ptr<CameraDriver> driver);
  [[nodiscard]] bool is_over(Time last) const;
  Result<void> track(const CapturedFrame& live);
  void say_once(std::string& said, const std::string& what) const;
  void summarise_capture();
  [[nodiscard]] Error no_frame() const;
  Result<ScanSummary> finish();
  Result<ScanSummary> save_unplugged();
  Result<void> publish_mesh();
  void use_all_threads();

  const ScanOptions& options_;
  ResultFolder& folder_;
  CameraDescription camera_;
  fs::path recording_;
  std::unique_ptr<LiveSource> source_;
  RunContext run_;
  ScanRecorder recorder_;
  ScanFrames frames_;
  SlamPipeline pipeline_;
  std::unique_ptr<ScanSave> save_;
  ScanSummary summary_;
  RunningSummary latency_ms_;
  std::optional<Time> first_stamp_, last_stamp_;
  MappingPace pace_;
  std::string said_memory_, said_recording_;
  Stopwatch watch_;
};

void Scan::say_once(std::string& said, const std::string& what) const {
  if (what.empty() || !said.empty()) return;
  said = what;
  if (run_.log) run_.log(LogLevel::kWarning, what);
}

/// Brings SLAM to where the recording ends.
void Scan::track_earlier(const Recording& earlier) {
  FramePrefetcher reader(earlier, 0, earlier.info().frame_count, 1, {.readers = options_.run.threads});
  while (!options_.run.stop.stop_requested()) {
    auto frame = reader.next();
    if (!frame) return;
    if (!*frame) continue;
    frames_.add(**frame);
    pipeline_.add(std::move(**frame));
    ++summary_.capture.earlier_frames;
  }
}

Result<std::unique_ptr<CameraDriver>> Scan::open_again(const CameraRequest& request) const {
  auto driver = open_camera(request);
  if (!driver) return driver;
  const PinholeCamera now = (*driver)->describe().camera;
  if (now.width != camera_.camera.width || now.height != camera_.camera.height)
    return fail(ErrorCode::kUsage, camera_.name, "gives images of another size now: {} x {}", now.width,
                now.height);
  return driver;
}

bool Scan::is_over(Time last) const {
  if (options_.run.stop.stop_requested()) return true;
  return options_.duration_s && first_stamp_ && (last - *first_stamp_).seconds() >= *options_.duration_s;
}

Result<void> Scan::capture(std::unique_ptr<CameraDriver> driver) {
  constexpr std::chrono::milliseconds kWait{100};
  source_ = std::make_unique<LiveSource>(
      std::move(driver), LiveSourceOptions{},
      [this](const std::shared_ptr<const RgbdFrame>& frame) { recorder_.offer(frame); });
  Result<void> tracked;
  while (tracked && !is_over(last_stamp_.value_or(Time{}))) {
    const auto live = source_->next(kWait);
    if (live)
      tracked = track(*live);
    else if (source_->end() != CaptureEnd::kRunning)
      break;
  }
  source_->stop();  // also after an error: nothing may be offered to a recorder that has finished
  while (const auto live = tracked ? source_->next(std::chrono::milliseconds(0)) : std::nullopt)
    tracked = track(*live);
  return tracked;
}

Result<void> Scan::track(const CapturedFrame& live) {
  const RgbdFrame& frame = *live.frame;
  if (!first_stamp_) first_stamp_ = frame.stamp;
  last_stamp_ = frame.stamp;
  frames_.add(frame);
  pace_.begin(live.received);
  const SlamHooks hooks{[this](const SE3&) { pace_.pose_known(SteadyClock::now()); },
                        [this] { return pace_.is_late(source_->counts().waiting, SteadyClock::now()); }};
  const SlamStep step = pipeline_.add(frame, hooks);
  latency_ms_.add(pace_.end(step.T_odom_camera.has_value(), step.is_mapped, SteadyClock::now()));
  CaptureSummary& capture = summary_.capture;
  if (step.T_odom_camera) {
    ++capture.tracked;
    capture.mapped += step.is_mapped ? 1 : 0;
  } else {
    ++(step.status == TrackingStatus::kSkipped ? capture.unusable : capture.lost);
  }
  say_once(said_memory_, step.out_of_memory);
  say_once(said_recording_, recorder_.counts().failure);
  if (run_.view)
    run_.view->on_count("frames dropped", static_cast<double>(source_->counts().dropped_in_all()));
  return save_->after_frame(frames_.size());
}

/// Every captured frame is accounted for.
void Scan::summarise_capture() {
  CaptureSummary& capture = summary_.capture;
  const CaptureCounts counts = source_->counts();
  const RecorderCounts recorded = recorder_.counts();
  capture.camera = camera_.name;
  capture.intrinsics = camera_.intrinsics_source;
  capture.exposure = to_string(source_->camera().exposure);
  capture.ended_because = source_->end_reason();
  capture.captured = counts.captured;
  for (std::size_t i = 0; i < kDropReasons; ++i)
    capture.dropped.emplace_back(to_string(static_cast<DropReason>(i)), counts.dropped[i]);
  HM_CHECK(capture.captured ==
               capture.tracked + capture.lost + capture.unusable + counts.dropped_in_all() + counts.waiting,
           "{} captured, {} tracked, {} lost, {} unusable, {} dropped", capture.captured, capture.tracked,
           capture.lost, capture.unusable, counts.dropped_in_all());
  capture.recorded = recorded.recorded;
  capture.recorded_uncompressed = recorded.uncompressed;
  capture.not_recorded = recorded.queue_full + recorded.failed;
  if (first_stamp_) capture.duration_s = (*last_stamp_ - *first_stamp_).seconds();
  if (capture.duration_s > 0) capture.rate_hz = static_cast<double>(capture.tracked) / capture.duration_s;
  capture.latency_ms = latency_ms_.summary();
  if (!counts.first_incomplete.empty())
    summary_.warnings.push_back(fmt::format("{} incomplete; the first: {}",
                                            counted(counts.dropped_for(DropReason::kIncomplete), "image"),
                                            counts.first_incomplete));
  if (recorded.queue_full > 0)
    summary_.warnings.push_back(
        fmt::format("{} not in the recording: the disk was too slow", counted(recorded.queue_full, "frame")));
  if (!recorded.failure.empty())
    summary_.warnings.push_back(
        fmt::format("{} not in the recording: {}", counted(recorded.failed, "frame"), recorded.failure));
}

void Scan::use_all_threads() {
  run_.threads = options_.run.threads;
  pipeline_.set_threads(run_.threads);
}

Result<void> Scan::publish_mesh() {
  std::vector<fs::path> files;
  auto written = write_mesh_files(pipeline_.mesh(), {folder_.staging(), options_.run.program_version, {}},
                                  options_.parameters.reconstruction, files);
  if (written) written = folder_.publish(files, RunState::kStopped);
  summary_.outputs.insert(summary_.outputs.end(), files.begin(), files.end());
  return as_run_failure(written);
}

/// Nothing that takes long: whoever scans wants to go on. `hm slam` does the rest with the recording.
Result<ScanSummary> Scan::save_unplugged() {
  (void)recorder_.finish();  // what failed is a warning
  if (const auto saved = save_->save_all(frames_.size()); !saved) return forward_error(saved);
  summary_.capture.saved_s = std::chrono::duration<double>(SteadyClock::now() - source_->ended_at()).count();
  summarise_capture();
  save_.reset();
  for (const char* name : {"map.hmap", "trajectory.tum", "parameters.toml"})
    summary_.outputs.push_back(folder_.path() / name);
  summary_.outputs.push_back(recording_);
  use_all_threads();
  if (const auto written = publish_mesh(); !written) return forward_error(written);
  summary_.failure = Error{
      ErrorCode::kInternal,
      fmt::format("{}; recording, map and trajectory were saved {:.2f} s later. `hm scan --resume` goes on "
                  "with them, `hm slam {} -o FOLDER` closes the loops of what there is",
                  summary_.capture.ended_because, *summary_.capture.saved_s, recording_.string()),
      camera_.name};
  return std::move(summary_);
}

Error Scan::no_frame() const {
  const CaptureSummary& capture = summary_.capture;
  const std::string drops = drops_text(capture);
  return {ErrorCode::kInvalidValue,
          fmt::format("not one of {} could be used{}", counted(capture.captured, "image"),
                      drops.empty() ? "" : ": " + drops),
          camera_.name};
}

/// Completes the scan. A failure to record is an error in the end, but none that costs the results.
Result<ScanSummary> Scan::finish() {
  const auto recorded = as_run_failure(recorder_.finish());
  if (!recorded) summary_.failure = recorded.error();
  summarise_capture();
  if (frames_.size() == 0) return tl::make_unexpected(no_frame());
  save_.reset();  // the results' own map follows
  if (const auto complete = frames_.complete(); !complete) return forward_error(complete);
  use_all_threads();
  SlamRunOptions options;
  options.recording = recording_;
  options.output = options_.output;
  options.parameters = options_.parameters;
  options.run = run_;
  options.compare_with_odometry = false;  // whoever scans waits for the result; `hm slam` compares
  SlamSummary slam;
  slam.capture = summary_.capture;
  slam.warnings = summary_.warnings;
  Preflight images = check_images(frames_);
  std::ranges::move(images.warnings, std::back_inserter(slam.warnings));
  add_doubts(std::move(images.doubts), slam.verdict);
  const auto finished = finish_slam({pipeline_, frames_, folder_.staging(), options, watch_}, slam);
  if (!finished) return forward_error(finished);
  if (const auto published = folder_.publish(slam.outputs, RunState::kComplete); !published)
    return forward_error(published);
  summary_.warnings = slam.warnings;
  summary_.outputs = slam.outputs;
  summary_.outputs.push_back(recording_);
  slam.outputs = summary_.outputs;
  summary_.slam = std::move(slam);
  return std::move(summary_);
}

Result<ScanSummary> Scan::run(const Recording* earlier, std::unique_ptr<CameraDriver> driver,
                              const CameraRequest& request) {
  summary_.warnings = camera_.notes;
  SlamSaveState state;
  state.program_version = options_.run.program_version;
  auto save = ScanSave::begin(pipeline_, folder_, options_.parameters, state);
  if (!save) return forward_error(save);
  save_ = std::move(*save);
  if (earlier) {
    driver.reset();  // nobody would read it for long: its first images would be old ones
    track_earlier(*earlier);
    auto again = open_again(request);
    if (!again) return forward_error(again);
    driver = std::move(*again);
  }
  // The files are in their places before the first frame comes, which this would delay.
  if (const auto saved = save_->save_all(frames_.size()); !saved) return forward_error(saved);
  if (const auto captured = capture(std::move(driver)); !captured) return forward_error(captured);
  if (source_->end() == CaptureEnd::kFailed) return save_unplugged();
  return finish();
}

/// The recording that is to be continued, if there is one; another one that lies there is removed, or an
/// error.
Result<std::unique_ptr<Recording>> earlier_recording(const ScanOptions& options, const fs::path& folder) {
  std::error_code code;
  if (!fs::exists(folder, code)) return nullptr;
  switch (options.existing) {
    case ExistingResult::kRefuse:
      return fail(ErrorCode::kUsage, folder.string(),
                  "this is the recording of a scan: --resume continues it, --overwrite replaces it");
    case ExistingResult::kOverwrite:
      return nullptr;
    case ExistingResult::kResume:
      break;
  }
  if (!fs::exists(folder / "depth.txt", code)) return nullptr;
  auto recording = open_recording(folder);
  // Not one frame was recorded before the end.
  if (!recording && recording.error().code == ErrorCode::kNotFound) return nullptr;
  return recording;
}

/// A replay of the recording that the scan would replace, or continue with itself.
bool replays_itself(const CameraRequest& request, const fs::path& recording) {
  constexpr std::string_view kReplay = "replay:";
  std::error_code code;
  return request.camera.starts_with(kReplay) &&
         fs::equivalent(request.camera.substr(kReplay.size()), recording, code);
}

}  // namespace

Result<ScanSummary> run_scan(const ScanOptions& options) {
  if (const auto checked = check_parameters(options.parameters); !checked) return forward_error(checked);
  if (options.parameters.reconstruction.align)
    return fail(ErrorCode::kUsage, "reconstruction.align",
                "it corrects given poses, and a camera gives none");
  const fs::path recording = options.output / "recording";
  if (replays_itself(options.camera, recording))
    return fail(ErrorCode::kUsage, recording.string(),
                "this scan would write into the recording that it replays; give another folder with -o");
  auto folder =
      ResultFolder::open({options.output, options.existing, "scan", recording, options.run.program_version});
  if (!folder) return forward_error(folder);
  const auto earlier = earlier_recording(options, recording);
  if (!earlier) return forward_error(earlier);
  CameraRequest request = options.camera;
  if (*earlier && !(*earlier)->info().stamps.empty()) request.after = (*earlier)->info().stamps.back();
  auto driver = open_camera(request);
  if (!driver) return forward_error(driver);
  const CameraDescription camera = (*driver)->describe();
  std::error_code code;
  if (options.existing == ExistingResult::kOverwrite) fs::remove_all(recording, code);
  if (code) return fail(ErrorCode::kUsage, recording.string(), "cannot be replaced: {}", code.message());
  auto writer = TumWriter::append(recording, camera.camera, 1 / camera.depth_unit_m);
  if (!writer) return forward_error(writer);
  Scan scan(options, *folder, camera, std::move(*writer));
  return scan.run(earlier->get(), std::move(*driver), request);
}

void visit(const ScanSummary& summary, SummaryTree& v) {
  if (summary.slam)
    visit(*summary.slam, v);
  else
    v.group("capture", summary.capture);
}

std::string to_text(const ScanSummary& summary) {
  return summary.slam ? to_text(*summary.slam) : capture_lines(describe(summary));
}

}  // namespace hm
