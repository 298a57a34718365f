#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hm/core/run_context.hpp"
#include "hm/io/rgbd/recording.hpp"
#include "hm/sim/recording/simulation.hpp"

namespace hm {

/// Frames of an experiment: of a recording, or of a simulation whose truth is known.
struct ExperimentFrames {
  std::string words;                             ///< of the page: "simulated tango_tablet in the room"
  std::shared_ptr<const FrameSource> source;     ///< frames by their index, with poses
  std::size_t count = 0;                         ///< frames from 0
  std::shared_ptr<const Simulation> simulation;  ///< null: a recording
  std::shared_ptr<const Recording> recording;    ///< null: a simulation
};

/// At most `most` frames of a simulated walk, from its beginning.
ExperimentFrames simulated_frames(SimulationParams params, int most, int threads);

/// At most `most` frames of a recording (a folder below ExperimentOptions::data, "rgbd/tum_fr1_xyz"). Errors:
/// those of open_recording().
Result<ExperimentFrames> recorded_frames(const std::filesystem::path& recording, int most);

/// Calls `use` with each frame in order, and reports progress; a frame that cannot be read is left out.
/// Errors: those of `use`; kCancelled.
Result<void> for_each_frame(const ExperimentFrames& frames, const RunContext& run,
                            const std::function<Result<void>(const RgbdFrame& frame)>& use);

/// Depth in colours, near dark and far light; no reading is white.
Image<Rgb8> draw_depth(const DepthImage& depth, double far_m);

/// The surface that a simulated camera was to map.
struct TrueSurface {
  TriangleMesh mesh;          ///< the whole world
  std::vector<Vec3> visible;  ///< points of what the frames can show
};
TrueSurface true_surface(const Simulation& simulation, const ParallelLoop& loop);

}  // namespace hm
