#include "hm/pipeline/experiments/common/experiment_frames.hpp"

#include <algorithm>

#include "hm/report/render/color_map.hpp"

namespace hm {
namespace {

/// A simulation as a source of frames.
class SimulatedFrames : public FrameSource {
 public:
  SimulatedFrames(std::shared_ptr<const Simulation> simulation, int threads)
      : simulation_(std::move(simulation)), loop_(threads) {}
  [[nodiscard]] PinholeCamera camera() const override { return simulation_->camera(); }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    return simulation_->frame(index, loop_);
  }

 private:
  std::shared_ptr<const Simulation> simulation_;
  ParallelLoop loop_;
};

}  // namespace

ExperimentFrames simulated_frames(SimulationParams params, int most, int threads) {
  ExperimentFrames frames;
  params.frame_limit = most;
  frames.simulation = std::make_shared<const Simulation>(params);
  frames.words = fmt::format("simulated {} in the {}", kSensorPresetNames[static_cast<int>(params.sensor)],
                             kWorldKindNames[static_cast<int>(params.world)]);
  frames.source = std::make_shared<SimulatedFrames>(frames.simulation, threads);
  frames.count = frames.simulation->frame_count();
  return frames;
}

Result<ExperimentFrames> recorded_frames(const std::filesystem::path& path, int most) {
  auto opened = open_recording(path);
  if (!opened) return forward_error(opened);
  ExperimentFrames frames;
  frames.recording = std::move(*opened);
  frames.words = fmt::format("recording {}", path.filename().string());
  frames.source = frames.recording;
  frames.count = std::min(static_cast<std::size_t>(most), frames.recording->info().frame_count);
  return frames;
}

Result<void> for_each_frame(const ExperimentFrames& frames, const RunContext& run,
                            const std::function<Result<void>(const RgbdFrame& frame)>& use) {
  for (std::size_t i = 0; i < frames.count; ++i) {
    if (run.progress) run.progress({frames.words, i, frames.count, {}});
    if (run.stop.stop_requested()) return fail(ErrorCode::kCancelled, {}, "stopped in an experiment");
    const auto frame = frames.source->read(i);
    if (!frame) continue;
    if (auto used = use(*frame); !used) return used;
  }
  return {};
}

Image<Rgb8> draw_depth(const DepthImage& depth, double far_m) {
  Image<Rgb8> image(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      image(x, y) = depth.units(x, y) == 0 ? Rgb8{255, 255, 255}
                                           : to_rgb8(sequential_color(depth.depth_m(x, y) / far_m));
  return image;
}

TrueSurface true_surface(const Simulation& simulation, const ParallelLoop& loop) {
  TrueSurface surface{merged_mesh(simulation.world()), {}};
  for (const Eigen::Vector3f& p : simulation.visible_truth(loop).positions)
    surface.visible.push_back(p.cast<double>());
  return surface;
}

}  // namespace hm
