#pragma once
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>

#include "hm/core/run_context.hpp"
#include "hm/io/rgbd/frame_source.hpp"
#include "hm/mapping/dense_pipeline.hpp"
#include "hm/mapping/observation_log.hpp"

namespace hm {

/// Present pose of an observation; nothing: it does not belong into the map.
using PoseOfObservation = std::function<std::optional<SE3>(const Observation&)>;

/// Part of a map that is made again.
enum class RebuildExtent {
  kMoved,  ///< the volumes that frames which moved have changed, or change now; all if most frames moved
  kWhole,  ///< all of it, even if nothing moved: the map of these poses to the bit, whatever was before
};

/// Distance that a reading at this depth moves with its camera, at most about; 0 only for the same pose.
double shift_m(const SE3& before, const SE3& after, double depth_m);

struct MapRebuildOptions {
  RebuildExtent extent = RebuildExtent::kWhole;
  double least_shift_m = 0.005;  ///< kMoved: frames that moved less, at `at_depth_m`, stay as they are
  double at_depth_m = 3.0;
  std::size_t prefetch_frames = 4;
  int threads = 1;
};

/// Effect of a correction of a map.
struct MapCorrection {
  std::size_t frames = 0;           ///< in the map before, or to come into it
  std::size_t frames_moved = 0;     ///< integrated again at another place, or for the first time
  std::size_t frames_replayed = 0;  ///< integrated again at their place, as they had seen what was rebuilt
  std::size_t frames_removed = 0;   ///< do not belong into the map (any more)
  std::size_t frames_lost = 0;      ///< could not be read again
  std::size_t volumes_before = 0, volumes_after = 0;
  std::size_t volumes_rebuilt = 0;  ///< of those before
  double largest_shift_m = 0;       ///< of a frame, measured at `at_depth_m`
  double seconds = 0;
  bool interrupted = false;   ///< stopped, or out of memory: the map is as it was before
  std::string out_of_memory;  ///< in words; empty: there was enough
};

/// Makes a map, or the part of it whose frames have moved, again from its frames beside the old one, which
/// stays whole meanwhile; put_into() then exchanges them. May run on another thread than the map's; one
/// thread at a time.
class MapRebuild {
 public:
  /// `frames` must outlive it.
  MapRebuild(const DenseParams& parameters, const FrameSource& frames, const MapRebuildOptions& options);
  ~MapRebuild();

  /// Reads the frames of a log (closed groups) again and integrates them where they are now. False: asked to
  /// stop before the end, or out of memory (report()).
  bool replay(const ObservationLog& log, const PoseOfObservation& pose_now, const RunContext& run);
  /// Nothing has moved far enough: there is nothing to put.
  [[nodiscard]] bool is_empty() const { return !whole_ && rebuilt_.empty(); }
  /// Takes in a frame that came into the map after replay() was given its log, with what it has changed
  /// and its images; without them it is read again.
  void follow(const Observation& observation, std::span<const VolumeKey> changed,
              std::optional<RgbdFrame> images);
  /// Puts what was rebuilt in the place of the map's; the log follows. All frames that came after replay()'s
  /// log must have been followed. What was there is freed with this object. kOutOfMemory: the map is not
  /// whole.
  Result<void> put_into(DensePipeline& map, ObservationLog& log);
  /// The mesh of what was rebuilt, instead of putting it into a map.
  TriangleMesh take_mesh() { return aside_.take_finished_mesh(); }
  [[nodiscard]] const MapCorrection& report() const { return report_; }

 private:
  using Groups = std::span<const std::shared_ptr<const ObservationLog::Group>>;
  void plan(Groups groups, const PoseOfObservation& pose_now);
  bool integrate(std::span<const std::size_t> places, const RunContext& run);
  void exchange(DensePipeline& map, ObservationLog& log);
  void integrate_frame(std::size_t place, Observation& observation, Result<RgbdFrame>& frame);
  [[nodiscard]] std::vector<std::size_t> next_places(Groups groups) const;

  const FrameSource& frames_;
  MapRebuildOptions options_;
  DensePipeline aside_;
  MapCorrection report_;
  bool whole_ = false;
  std::map<std::size_t, ObservationLog::Group> rebuilt_;  ///< by place, with the poses of now
  std::set<std::size_t> moved_, done_;                    ///< places
  std::set<VolumeKey> wanted_;                            ///< unless whole_
  std::size_t frames_done_ = 0, frames_total_ = 0;
};

/// Brings a map to the poses of now, on the calling thread. Told to stop, or when the new map does not fit
/// into memory beside the old one, it leaves map and log as they are.
MapCorrection correct_map(DensePipeline& map, ObservationLog& log, MapRebuild& rebuild,
                          const PoseOfObservation& pose_now, const RunContext& run);

}  // namespace hm
