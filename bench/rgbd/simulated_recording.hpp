#pragma once
#include "hm/io/rgbd/recording.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm::bench {

/// A simulation as a recording: frames are rendered when they are read, so that nothing goes to disk.
class SimulatedRecording final : public Recording {
 public:
  explicit SimulatedRecording(const SimulationParams& params) : simulation_(params) {
    info_.camera = simulation_.camera();
    info_.frame_count = simulation_.frame_count();
    info_.posed_count = info_.frame_count;
    for (std::size_t i = 0; i < info_.frame_count; ++i) {
      info_.stamps.push_back(simulation_.stamp(i));
      info_.frame_poses.emplace_back(simulation_.true_pose(i));
    }
  }
  [[nodiscard]] const RecordingInfo& info() const override { return info_; }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    RgbdFrame frame = simulation_.frame(index);
    frame.index = index;
    return frame;
  }
  [[nodiscard]] const Simulation& simulation() const { return simulation_; }

 private:
  Simulation simulation_;
  RecordingInfo info_;
};

}  // namespace hm::bench
