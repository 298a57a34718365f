#include "hm/pipeline/laser/run/laser_run.hpp"

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "hm/core/process_memory.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/core/text/counted.hpp"
#include "hm/io/pose/relations_file.hpp"
#include "hm/pipeline/checks/preflight.hpp"
#include "hm/pipeline/common/run_records.hpp"
#include "hm/pipeline/laser/run/laser_evaluation.hpp"
#include "hm/pipeline/laser/run/laser_events.hpp"
#include "hm/pipeline/laser/run/laser_output.hpp"
#include "hm/pipeline/laser/run/laser_pieces.hpp"
#include "hm/pipeline/laser/run/laser_rebuild.hpp"
#include "hm/pipeline/laser/run/laser_run_view.hpp"
#include "hm/pipeline/laser/run/laser_scan_counts.hpp"
#include "hm/pipeline/laser/run/laser_tables.hpp"

namespace hm {
namespace {

constexpr std::size_t kMapSamples = 300;  // how often the map's size is noted: it costs a walk through it

/// Input of laser_choices().
struct LaserChoiceInput {
  const LaserRecording& recording;
  const LaserRunOptions& options;
  const LaserPipeline& pipeline;
};

std::string prediction_text(const LaserRecording& recording, const LaserParameters& params, bool uses_imu) {
  const LaserRunParams& run = params.run;
  if (recording.odometry.empty() || !run.use_odometry)
    return std::string("no odometry: motion is predicted from the velocity of the last scans") +
           (!run.search_motion ? ""
            : uses_imu         ? "; after a gap or a failed match, the last keyframes are searched"
                       : "; along walls that show nothing of it, and after a gap or a failed match, the "
                         "last keyframes are searched");
  if (!run.degraded_odometry)
    return "motion is predicted from the recording's odometry" +
           (recording.odometry_source.empty() ? "" : ", " + recording.odometry_source);
  const WheelNoiseParams noise = params.wheel_noise.multiplied();
  return fmt::format(
      "motion is predicted from simulated wheel odometry: the true poses of the recording ({}), with noise "
      "added to "
      "the motion between them: noise of {:g} % along and {:g} % across it, {:g} % of a turn, {:g} rad/m of "
      "heading, "
      "systematic "
      "errors of {:g} % and {:g} rad/m (seed {})",
      recording.truth_source, 100 * noise.along_ratio, 100 * noise.across_ratio, 100 * noise.angle_ratio,
      noise.angle_rad_per_m, 100 * noise.scale_sigma_ratio, noise.drift_sigma_rad_per_m, noise.seed);
}

std::string map_frame_text(const LaserPipeline& pipeline, const LaserRunOptions& options) {
  switch (pipeline.map_frame().source()) {
    case MapFrameSource::kLoops:
      return "drift is corrected by closing loops, and at the end by registering keyframes with those "
             "around: results are in the frame map; the frame odom stays continuous";
    case MapFrameSource::kSavedMap:
      return "localised in the saved map " + options.saved_map.string() + ": results are in its frame";
    case MapFrameSource::kOdometry:
      break;
  }
  return "drift is not corrected";
}

std::string range_text(const LaserChoiceInput& input) {
  const LaserRecording& recording = input.recording;
  const RangeCounts& counts = input.pipeline.range_counts();
  if (input.pipeline.uses_range())
    return fmt::format(
        "height from the range sensor: {} of {} used, the others are outside of its limits or were "
        "taken while the vehicle was tilted too far",
        counts.used, counted(counts.processed, "reading"));
  std::string why = "it gives no reading within its limits, or does not look down";
  if (!input.pipeline.matches_scans()) why = "poses are those of odometry";
  if (recording.rig && recording.rig->down) why = "a mirror measures the height";
  return fmt::format("readings of the range sensor are not used: {}", why);
}

void describe_matching(const LaserChoiceInput& input, std::vector<std::string>& choices) {
  const LaserRecording& recording = input.recording;
  const LaserParameters& params = input.options.parameters.laser;
  choices.push_back(fmt::format("poses from scan matching of {}", recording.lasers.front().name));
  if (const LaserStream& laser = recording.lasers.front(); !laser.mount_source.empty())
    choices.push_back(fmt::format("its mount is given by {}", laser.mount_source));
  if (!scans_horizontally(laser_platform(recording).rigs.front()))
    choices.emplace_back("its scan plane is not horizontal: poses may be wrong");
  if (recording.lasers.size() > 1)
    choices.push_back(fmt::format("{} not used", counted(recording.lasers.size() - 1, "more laser")));
  const bool uses_imu = !recording.imu.empty() && params.run.use_imu;
  choices.emplace_back(uses_imu ? "IMU used for attitude, yaw between scans and fusion"
                                : "no IMU: the vehicle is assumed to be level");
  choices.push_back(prediction_text(recording, params, uses_imu));
  if (!input.pipeline.measures_height())
    choices.emplace_back("no mirror or range sensor that looks down: the height is not measured");
  choices.push_back(map_frame_text(input.pipeline, input.options));
}

/// Lists in words what is used of a recording and why, with the recording's own notes.
std::vector<std::string> laser_choices(const LaserChoiceInput& input) {
  const LaserRecording& recording = input.recording;
  std::vector<std::string> choices;
  if (input.pipeline.matches_scans())
    describe_matching(input, choices);
  else
    choices.push_back(fmt::format("poses from odometry of the recording{}",
                                  scans_horizontally(laser_platform(recording).rigs.front())
                                      ? ""
                                      : ", as no laser scans horizontally: the scans only build the map"));
  // That its mount is not known is among the recording's notes.
  if (!recording.range.readings.empty() && recording.range.T_base_range) choices.push_back(range_text(input));
  choices.insert(choices.end(), recording.notes.begin(), recording.notes.end());
  return choices;
}

/// One run of run_laser().
class Run {
 public:
  Run(const LaserRunOptions& options, ResultFolder& folder, LaserRecording recording,
      std::vector<std::string> warnings, const OccupancyGrid2D* saved_map)
      : options_(options),
        folder_(folder),
        recording_(std::move(recording)),
        pipeline_(options.parameters.laser, laser_platform(recording_), saved_map,
                  options.pace == LaserPace::kRealtime ? LoopThread::kOwn : LoopThread::kCaller),
        events_(recording_, pipeline_, options.parameters.laser.run),
        records_(options.most_records),
        counts_(recording_.truth),
        tables_(folder.staging()),
        mapped_(folder.staging()) {
    summary_.warnings = std::move(warnings);
    if (options.run.view)
      view_.emplace(*options.run.view, recording_, events_.scan_count(), options.parameters.laser.run);
  }

  [[nodiscard]] bool matches_scans() const { return pipeline_.matches_scans(); }
  Result<void> process_all();
  Result<LaserSummary> finish();

 private:
  [[nodiscard]] bool wait_until_due(const LaserEvent& event, const Stopwatch& watch);
  void close_loops();
  void collect();
  void note(LaserScanRecord record);
  void show_progress() const;
  void describe();
  void count_guess(const LaserStep& step);
  void count();
  [[nodiscard]] Result<std::optional<MultiVolumeGrid>> correct();
  [[nodiscard]] Result<void> cut_into_pieces();
  [[nodiscard]] Error nothing_posed() const;

  const LaserRunOptions& options_;
  ResultFolder& folder_;
  LaserRecording recording_;
  LaserPipeline pipeline_;
  LaserEvents events_;
  LaserSummary summary_;
  EvenlyThinned<LaserScanRecord> records_;
  LaserScanCounts counts_;
  LaserTables tables_;
  MappedScanFile mapped_;  ///< where `map` is not `odom`
  /// Motion that was guessed at this stretch, and observed since the last of it.
  double guess_m_ = 0, observed_m_ = 0;
  std::optional<Vec3> last_place_;
  std::vector<Time> breaks_;          ///< stamps of poses that nothing joins with the one before
  std::optional<LaserRunView> view_;  ///< of somebody who watches
  RunningSummary scan_ms_, match_ms_, insert_ms_;
  double insert_sum_ms_ = 0;
  Stopwatch run_watch_;
  std::size_t scans_since_sample_ = 0;
};

/// Live: sleeps until the event is due. False when it is a scan that is to be dropped, as newer ones wait
/// already.
bool Run::wait_until_due(const LaserEvent& event, const Stopwatch& watch) {
  const double due_s = (event.due - events_.begin()).seconds();
  while (!options_.run.stop.stop_requested() && watch.seconds() < due_s)
    std::this_thread::sleep_for(std::chrono::duration<double>(std::min(0.05, due_s - watch.seconds())));
  if (event.kind != LaserEvent::Kind::kScan) return true;
  const Time now = events_.begin() + Duration::from_seconds(watch.seconds());
  return events_.scans_between(event.due, now) <
         static_cast<std::size_t>(options_.parameters.laser.run.queue_scans);
}

Result<void> Run::process_all() {
  const Stopwatch watch;
  for (const LaserEvent& event : events_.all()) {
    if (options_.run.stop.stop_requested()) {
      summary_.interrupted = true;
      break;
    }
    if (options_.pace == LaserPace::kRealtime && !wait_until_due(event, watch)) {
      ++summary_.scans_dropped;
      continue;
    }
    if (event.kind == LaserEvent::Kind::kScan) ++summary_.scans_read;
    give(pipeline_, recording_, event);
    collect();
    // A disk that is full is known now, rather than at the end.
    for (const auto& written : {mapped_.written(), tables_.written()})
      if (!written) return as_run_failure(written);
  }
  close_loops();
  collect();
  return as_run_failure(tables_.finish());
}

void Run::close_loops() {
  if (options_.run.progress && pipeline_.map_frame().source() == MapFrameSource::kLoops)
    options_.run.progress({"closing loops", 0, 0, {}});
  pipeline_.finish(options_.run);
}

void Run::collect() {
  auto steps = pipeline_.take_steps();
  if (steps.empty()) return;
  for (LaserStep& step : steps) {
    if (view_) view_->show(step, pipeline_, summary_.trajectory_odom);
    LaserScanRecord record;
    record.time_s = (step.stamp - events_.begin()).seconds();
    record.step = std::move(step);
    if (scans_since_sample_++ % std::max<std::size_t>(1, events_.scan_count() / kMapSamples) == 0)
      record.map = pipeline_.map().size();
    note(std::move(record));
  }
  show_progress();
}

void Run::show_progress() const {
  if (!options_.run.progress) return;
  options_.run.progress(
      {"laser", records_.count() + summary_.scans_dropped, events_.scan_count(),
       fmt::format("map {:.1f} MB, process {} MB", static_cast<double>(pipeline_.map().bytes()) * 1e-6,
                   resident_bytes() / 1'000'000)});
}

/// Keeps what results and report need of a scan: numbers of every one, all of an even thinning, and on disk
/// the tables and what a new map needs.
void Run::note(LaserScanRecord record) {
  const LaserStep& step = record.step;
  scan_ms_.add(step.total_ms);
  if (step.matched_scan) match_ms_.add(step.match_ms);
  if (step.odometry.new_keyframe) ++summary_.keyframes;
  if (step.odometry.searched) ++summary_.scans_searched;
  if (step.odometry.status == OdometryStatus::kFound) ++summary_.scans_found;
  if (step.odometry.status == OdometryStatus::kRestarted) ++summary_.restarts;
  if (!step.T_odom_base) {
    ++summary_.scans_failed;
    ++summary_.failure_reasons[step.reason];
  } else {
    if (step.matched_scan) ++summary_.scans_matched;
    if (step.matched_scan && !step.odometry.confirmed) breaks_.push_back(step.stamp);
    count_guess(step);
    insert_ms_.add(step.insert_ms);
    insert_sum_ms_ += step.insert_ms;
    summary_.beams += step.beams.returns + step.beams.no_returns;
    summary_.trajectory_odom.push_back({step.stamp, *step.T_odom_base});
  }
  if (auto mapped = mapped_scan(step)) mapped_.add(std::move(*mapped));
  tables_.add(step);
  counts_.add(record);
  record.step.sweep = {};
  records_.push_back(std::move(record));
}

/// A stretch of motion that was guessed ends when a metre of it was observed.
void Run::count_guess(const LaserStep& step) {
  constexpr double kEnd_m = 1;
  if (step.matched_scan && !step.odometry.length_observed) ++summary_.scans_length_unobserved;
  const double guess_m = step.odometry.guessed_m;
  const double moved_m = last_place_ ? (step.T_odom_base->translation() - *last_place_).norm() : 0;
  last_place_ = step.T_odom_base->translation();
  observed_m_ = guess_m > 0 ? 0 : observed_m_ + moved_m;
  guess_m_ = observed_m_ > kEnd_m ? 0 : guess_m_ + guess_m;
  summary_.guessed_m += guess_m;
  summary_.longest_guess_m = std::max(summary_.longest_guess_m, guess_m_);
}

void Run::count() {
  summary_.records = records_.take();
  summary_.height_error = counts_.height_error();
  summary_.scans_unconfirmed = breaks_.size();
  summary_.odometry_delay_s = pipeline_.odometry_delay().seconds();
  std::stable_sort(summary_.trajectory_odom.begin(), summary_.trajectory_odom.end(),
                   [](const StampedPose& a, const StampedPose& b) { return a.stamp < b.stamp; });
  const auto twice =
      std::unique(summary_.trajectory_odom.begin(), summary_.trajectory_odom.end(),
                  [](const StampedPose& a, const StampedPose& b) { return a.stamp == b.stamp; });
  summary_.trajectory_odom.erase(twice, summary_.trajectory_odom.end());
  summary_.scan_ms = scan_ms_.summary();
  summary_.match_ms = match_ms_.summary();
  summary_.insert_ms = insert_ms_.summary();
  if (summary_.beams > 0)
    summary_.insert_us_per_beam = insert_sum_ms_ * 1e3 / static_cast<double>(summary_.beams);
}

void Run::describe() {
  summary_.recording = recording_.path;
  summary_.kind = std::string(to_string(recording_.kind));
  summary_.parameters = options_.parameters;
  summary_.pace = options_.pace;
  summary_.matched_scans = pipeline_.matches_scans();
  for (std::size_t laser = 0; laser < recording_.lasers.size(); ++laser)
    if (pipeline_.uses(laser))
      summary_.laser += (summary_.laser.empty() ? "" : ", ") + recording_.lasers[laser].name;
  summary_.scans_total = events_.scan_count();
  summary_.recording_s = (events_.end() - events_.begin()).seconds();
  summary_.truth = recording_.truth;
  summary_.truth_source = recording_.truth_source;
  summary_.choices = laser_choices({recording_, options_, pipeline_});
}

Error Run::nothing_posed() const {
  if (summary_.interrupted) return {ErrorCode::kCancelled, "stopped before the first scan had a pose", {}};
  std::string most = "there is no scan between laser.begin_s and its end";
  std::size_t count = 0;
  for (const auto& [reason, scans] : summary_.failure_reasons)
    if (scans > count) count = scans, most = fmt::format("{} x {}", scans, reason);
  return {ErrorCode::kInvalidValue,
          fmt::format("not one of {} got a pose ({})", counted(events_.scan_count(), "scan"), most),
          options_.recording.string()};
}

/// The path in the frame `map`, and the map of that path where it is another than that of odometry.
Result<std::optional<MultiVolumeGrid>> Run::correct() {
  const LaserMapFrame& frame = pipeline_.map_frame();
  MapFrameSummary& map = summary_.map_frame = summarise_map_frame(frame);
  // On a thread of their own, loops cost a scan nothing.
  const bool on_own_thread = map.source == MapFrameSource::kLoops && options_.pace == LaserPace::kRealtime;
  if (map.source != MapFrameSource::kOdometry && !on_own_thread) map.ms = counts_.map_frame_ms();
  if (frame.loops()) map.wrong_loops = count_wrong_loops(frame.loops()->graph(), recording_.truth);
  if (map.source == MapFrameSource::kSavedMap) {
    map.localisation = counts_.localisation();
    map.localisation->map = options_.saved_map;
  }
  summary_.trajectory = frame.corrected(summary_.trajectory_odom);
  if (!map.corrected) return std::nullopt;
  for (std::size_t i = 0; i < summary_.trajectory.size(); ++i)
    map.max_shift_m = std::max(map.max_shift_m, (summary_.trajectory[i].T_world_base.translation() -
                                                 summary_.trajectory_odom[i].T_world_base.translation())
                                                    .norm());
  const Stopwatch watch;
  auto grid = rebuild_laser_map({recording_, laser_platform(recording_).rigs, mapped_, frame},
                                options_.parameters.laser, options_.run);
  if (!grid) return forward_error(grid);
  map.rebuild_s = watch.seconds();
  map.mvog_odom = pipeline_.map().size();
  return std::optional(std::move(*grid));
}

/// The pieces of a broken map, and their files.
Result<void> Run::cut_into_pieces() {
  if (summary_.verdict.value != MapVerdict::kBroken || !pipeline_.matches_scans()) return {};
  summary_.pieces = consistent_pieces(summary_.trajectory_odom, breaks_, pipeline_.visits(), events_.begin());
  return write_laser_pieces({recording_, laser_platform(recording_).rigs, mapped_, summary_.trajectory_odom},
                            options_.parameters.laser, folder_.staging(), summary_.pieces);
}

Error not_localised(const LocalisationSummary& place) {
  return {ErrorCode::kNoResult,
          fmt::format(
              "the vehicle was not found in the map: {} searches, of which {} ambiguous, {} without a place, "
              "{} ended by the search limit",
              place.searches, place.ambiguous, place.not_found, place.limit_reached),
          place.map.string()};
}

Result<LaserSummary> Run::finish() {
  describe();
  count();
  if (summary_.trajectory_odom.empty()) return tl::make_unexpected(nothing_posed());
  const auto made = as_run_failure(correct());
  if (!made) return forward_error(made);
  const std::optional<MultiVolumeGrid>& corrected = *made;
  if (const auto& place = summary_.map_frame.localisation; place && place->located == 0)
    return tl::make_unexpected(not_localised(*place));
  summary_.verdict = judge_laser_run(recording_, summary_, pipeline_.visits(), pipeline_.map_frame());
  summary_.run_s = run_watch_.seconds();
  const MultiVolumeGrid& map = corrected ? *corrected : pipeline_.map();
  summary_.columns_refused = map.columns_refused();
  judge_memory_limit({"mvog.max_map_mb", options_.parameters.laser.mvog.max_map_mb, summary_.columns_refused,
                      "column update"},
                     summary_.warnings, summary_.verdict);
  if (view_) view_->show_end(map, summary_);
  summary_.floors = pipeline_.floors();
  summary_.mvog = map.size();
  summary_.bounds_m = map.bounds();
  summary_.planar = is_planar(map);
  LaserRunOptions staged = options_;
  staged.output = folder_.staging();
  if (const auto cut = as_run_failure(cut_into_pieces()); !cut) return forward_error(cut);
  if (!summary_.pieces.empty()) summary_.outputs.push_back(folder_.staging() / kPiecesFolder);
  const auto written =
      write_laser_results({map, corrected ? &pipeline_.map() : nullptr}, recording_, staged, summary_);
  if (!written) return forward_error(written);
  const auto published =
      folder_.publish(summary_.outputs, summary_.interrupted ? RunState::kStopped : RunState::kComplete);
  if (!published) return forward_error(published);
  return std::move(summary_);
}

Result<LaserRecording> open(const LaserRunOptions& options) {
  if (!is_laser_recording(options.recording) && open_recording(options.recording))
    return fail(ErrorCode::kUnsupported, options.recording.string(),
                "this is a recording of depth images, not of a laser; `hm reconstruct` is for it");
  auto recording = open_laser_recording(options.recording, options.recording_options);
  if (!recording) return recording;
  std::erase_if(recording->lasers, [](const LaserStream& stream) { return stream.scans.empty(); });
  if (recording->lasers.empty())
    return fail(ErrorCode::kNotFound, options.recording.string(), "the recording holds no laser scan");
  const LaserParameters& params = options.parameters.laser;
  if (params.run.degraded_odometry) {
    if (recording->truth.empty())
      return fail(ErrorCode::kUsage, options.recording.string(),
                  "laser.degraded_odometry needs true poses, and the recording has none");
    recording->odometry = degrade_to_wheel_odometry(recording->truth, params.wheel_noise);
  }
  if (params.run.poses == LaserPoseSource::kOdometry && recording->odometry.empty())
    return fail(ErrorCode::kUsage, options.recording.string(),
                "laser.poses = odometry, but the recording has no odometry");
  return recording;
}

}  // namespace

Result<LaserSummary> run_laser(const LaserRunOptions& options) {
  if (const auto checked = check_parameters(options.parameters); !checked) return forward_error(checked);
  auto folder = ResultFolder::open(
      {options.output, options.existing, "laser", options.recording, options.run.program_version});
  if (!folder) return forward_error(folder);
  auto recording = open(options);
  if (!recording) return forward_error(recording);
  auto warnings = check_before_laser_run(*recording, options.force);
  if (!warnings) return forward_error(warnings);
  if (!options.relations.empty())  // before the work, not after it
    if (const auto relations = read_relations(options.relations); !relations) return forward_error(relations);
  std::optional<OccupancyGrid2D> saved_map;
  if (!options.saved_map.empty()) {
    auto grid = read_saved_laser_map(options.saved_map, options.parameters.laser.run);
    if (!grid) return forward_error(grid);
    saved_map = std::move(*grid);
  }
  Run run(options, *folder, std::move(*recording), std::move(*warnings), saved_map ? &*saved_map : nullptr);
  if (saved_map && !run.matches_scans())
    return fail(ErrorCode::kUsage, options.recording.string(),
                "a place in a map is found by scan matching, and here poses come from odometry");
  if (const auto done = run.process_all(); !done) return forward_error(done);
  return run.finish();
}

}  // namespace hm
