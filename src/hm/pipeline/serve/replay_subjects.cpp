#include "hm/pipeline/serve/replay_subjects.hpp"

#include <vector>

#include "hm/mapping/dense_pipeline.hpp"
#include "hm/pipeline/dense/dense_parameter_list.hpp"
#include "hm/pipeline/laser/run/laser_events.hpp"
#include "hm/pipeline/laser/run/laser_run_view.hpp"
#include "hm/pipeline/live/live_view.hpp"
#include "hm/pipeline/rgbd/rgbd_parameter_list.hpp"
#include "hm/pipeline/rgbd/slam_pipeline.hpp"

namespace hm {
namespace {

/// Frames of a depth camera, read ahead.
class ReplayOfFrames : public ReplaySubject {
 public:
  ReplayOfFrames(const Recording& recording, const RunContext& run) : recording_(recording), run_(run) {}
  [[nodiscard]] std::size_t count() const override { return recording_.info().frame_count; }
  [[nodiscard]] Time stamp(std::size_t moment) const override { return recording_.info().stamps[moment]; }
  void restart() override {
    frames_.reset();
    forget();
    run_.view->on_restart();
  }
  void show(std::size_t moment) override {
    if (!frames_) frames_.emplace(recording_, moment, count());
    auto frame = frames_->next();
    if (!frame) return;
    if (*frame) return show(std::move(**frame));
    run_.view->on_camera({stamp(moment), nullptr, recording_.camera(), {}, to_string(frame->error())});
  }

 protected:
  virtual void forget() = 0;
  virtual void show(RgbdFrame frame) = 0;

  const Recording& recording_;
  RunContext run_;

 private:
  std::optional<FramePrefetcher> frames_;
};

class ReplayOfPoses : public ReplayOfFrames {
 public:
  ReplayOfPoses(const Recording& recording, const DenseParameters& parameters, const RunContext& run)
      : ReplayOfFrames(recording, run), parameters_(parameters) {
    begin();
  }

 private:
  void begin() {
    pipeline_.emplace(parameters_, recording_.camera(), run_.threads);
    pipeline_->observe_mesh(run_.view);
    integrated_ = skipped_ = 0;
  }
  void forget() override { begin(); }
  void settle() override { run_.view->on_mesh_complete(pipeline_->mesher()); }
  void show(RgbdFrame frame) override {
    const FrameOutcome outcome = pipeline_->process(frame);
    const auto T_map_camera = outcome.integrated ? std::optional(outcome.T_world_camera) : std::nullopt;
    run_.view->on_camera({frame.stamp, &frame, recording_.camera(), T_map_camera, outcome.skipped_because});
    (outcome.integrated ? integrated_ : skipped_) += 1;
    show_numbers(outcome, frame.index + 1);
  }
  void show_numbers(const FrameOutcome& outcome, std::size_t done) const {
    LiveNumbers numbers{"replay", done, count(), {}, {}, {}};
    numbers.stages_ms = {{"allocate", outcome.scan.allocate_ms},
                         {"integrate", outcome.scan.integrate_ms},
                         {"carve", outcome.scan.carve_ms},
                         {"mesh", outcome.mesh_ms},
                         {"pack", outcome.pack_ms}};
    numbers.counts = {{"frames integrated", integrated_}, {"frames skipped", skipped_}};
    numbers.memory = {{"map", static_cast<double>(pipeline_->grid().map_bytes())}};
    run_.view->on_numbers(numbers);
  }

  const DenseParameters& parameters_;
  std::optional<DensePipeline> pipeline_;
  double integrated_ = 0, skipped_ = 0;  ///< frames
};

/// Gives the frames that were added to a pipeline again, by their order.
class AddedFrames : public FrameSource {
 public:
  explicit AddedFrames(const Recording& recording) : recording_(recording) {
    indices_.reserve(recording.info().frame_count);  // read while others are added
  }
  [[nodiscard]] PinholeCamera camera() const override { return recording_.camera(); }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    return recording_.read(indices_[index]);
  }
  [[nodiscard]] Result<RgbdFrame> read_depth(std::size_t index) const override {
    return recording_.read_depth(indices_[index]);
  }
  void add(std::size_t index) { indices_.push_back(index); }

 private:
  const Recording& recording_;
  std::vector<std::size_t> indices_;
};

class ReplayOfTracking : public ReplayOfFrames {
 public:
  ReplayOfTracking(const Recording& recording, const RgbdParameters& parameters, const RunContext& run)
      : ReplayOfFrames(recording, run), parameters_(parameters) {
    begin();
  }

 private:
  void begin() {
    pipeline_.reset();
    added_ = std::make_unique<AddedFrames>(recording_);
    SlamInput input{recording_.camera()};
    input.frames = added_.get();
    pipeline_ = std::make_unique<SlamPipeline>(SlamPipeline::create(input, parameters_, run_));
  }
  void forget() override { begin(); }
  void settle() override { run_.view->on_mesh_complete(pipeline_->dense().mesher()); }
  void show(RgbdFrame frame) override {
    added_->add(frame.index);
    pipeline_->add(std::move(frame));
  }

  const RgbdParameters& parameters_;
  std::unique_ptr<AddedFrames> added_;
  std::unique_ptr<SlamPipeline> pipeline_;  // ends before the frames
};

class ReplayOfLaser : public ReplaySubject {
 public:
  ReplayOfLaser(const LaserRecording& recording, const LaserRunParameters& parameters, const RunContext& run)
      : recording_(recording), parameters_(parameters), run_(run) {
    begin();
  }
  [[nodiscard]] std::size_t count() const override { return events_->all().size(); }
  [[nodiscard]] Time stamp(std::size_t moment) const override { return events_->all()[moment].due; }
  void restart() override {
    begin();
    run_.view->on_restart();
  }
  void settle() override {}
  void show(std::size_t moment) override {
    const LaserEvent& event = events_->all()[moment];
    give(*pipeline_, recording_, event);
    if (moment + 1 == count()) pipeline_->finish();
    for (const LaserStep& step : pipeline_->take_steps()) {
      view_->show(step, *pipeline_, path_);
      if (step.T_odom_base) path_.push_back({step.stamp, *step.T_odom_base});
    }
  }

 private:
  void begin() {
    pipeline_.emplace(parameters_.laser, laser_platform(recording_));
    if (!events_) events_.emplace(recording_, *pipeline_, parameters_.laser.run);
    view_.emplace(*run_.view, recording_, events_->scan_count(), parameters_.laser.run);
    path_.clear();
  }

  const LaserRecording& recording_;
  const LaserRunParameters& parameters_;
  RunContext run_;
  std::optional<LaserPipeline> pipeline_;
  std::optional<LaserEvents> events_;
  std::optional<LaserRunView> view_;
  Trajectory path_;
};

}  // namespace

std::unique_ptr<ReplaySubject> replay_of_poses(const Recording& recording, const DenseParameters& parameters,
                                               const RunContext& run) {
  return std::make_unique<ReplayOfPoses>(recording, parameters, run);
}

std::unique_ptr<ReplaySubject> replay_of_tracking(const Recording& recording,
                                                  const RgbdParameters& parameters, const RunContext& run) {
  return std::make_unique<ReplayOfTracking>(recording, parameters, run);
}

std::unique_ptr<ReplaySubject> replay_of_laser(const LaserRecording& recording,
                                               const LaserRunParameters& parameters, const RunContext& run) {
  return std::make_unique<ReplayOfLaser>(recording, parameters, run);
}

}  // namespace hm
