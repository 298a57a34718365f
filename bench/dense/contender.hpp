#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "dense/scene_frames.hpp"
#include "hm/core/parallel.hpp"
#include "hm/tsdf/integration/integrator.hpp"

namespace hm::bench {

/// Somebody who integrates frames: ours with some parameters, or a peer. It has a map of its own.
class Contender {
 public:
  virtual ~Contender() = default;
  /// Brings frames into the form that it works on; never timed.
  virtual void prepare(std::span<const RgbdFrame> frames) = 0;
  /// Integrates the frame with this place among those prepared; timed.
  virtual void integrate(std::size_t place) = 0;
};

/// Ours. What the last scans did is kept for the document.
class OurContender : public Contender {
 public:
  OurContender(const TsdfParams& params, const PinholeCamera& camera, int threads);
  void prepare(std::span<const RgbdFrame> frames) override { frames_ = frames; }
  void integrate(std::size_t place) override;

  [[nodiscard]] const VolumeGrid& grid() const { return grid_; }
  [[nodiscard]] const std::vector<ScanStats>& scans() const { return scans_; }
  [[nodiscard]] const ParallelLoop& loop() const { return loop_; }

 private:
  ParallelLoop loop_;
  VolumeGrid grid_;
  Integrator integrator_;
  std::span<const RgbdFrame> frames_;
  std::vector<ScanStats> scans_;
};

/// The parameters that both sides of a comparison use: a fixed band, readings up to 4 m.
TsdfParams common_params(double voxel_size_m, double band_m);

struct Entry {
  std::string name;
  std::function<std::unique_ptr<Contender>()> make;
};

/// The milliseconds of each frame of one contender, its fastest round; and the contender of the first
/// round with its finished map.
struct RaceResult {
  std::vector<double> frame_ms;
  std::unique_ptr<Contender> contender;
  [[nodiscard]] double mean_ms() const;
};

/// Runs all contenders over the same frames in memory, in turn: a chunk of frames is loaded, then
/// everybody integrates it, round after round, each round into a map of its own; then the next chunk.
Result<std::vector<RaceResult>> race(FrameSource& source, std::span<const Entry> entries, int rounds);

}  // namespace hm::bench
