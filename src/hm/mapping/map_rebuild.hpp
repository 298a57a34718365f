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

/// Function that returns the current pose of an observation; nothing: it is not part of the map.
using PoseOfObservation = std::function<std::optional<SE3>(const Observation&)>;

/// Part of a map to rebuild.
enum class RebuildExtent {
  kMoved,  ///< volumes affected by moved frames, before or after; all if most frames moved
  kWhole,  ///< the whole map, even if nothing moved; bit-identical to one built with these poses
};

/// Approximate upper bound of the displacement of a reading at this depth between two poses; 0 only for equal
/// poses.
double shift_m(const SE3& before, const SE3& after, double depth_m);

struct MapRebuildOptions {
  RebuildExtent extent = RebuildExtent::kWhole;
  double least_shift_m = 0.005;  ///< kMoved: frames that moved less at `at_depth_m` are kept
  double at_depth_m = 3.0;
  std::size_t prefetch_frames = 4;
  int threads = 1;
};

/// Statistics of a map correction.
struct MapCorrection {
  std::size_t frames = 0;           ///< in the map before, or to be integrated
  std::size_t frames_moved = 0;     ///< integrated at a new pose, or for the first time
  std::size_t frames_replayed = 0;  ///< integrated again at the same pose, since they observe rebuilt volumes
  std::size_t frames_removed = 0;   ///< no longer part of the map
  std::size_t frames_lost = 0;      ///< could not be read
  std::size_t volumes_before = 0, volumes_after = 0;
  std::size_t volumes_rebuilt = 0;  ///< of volumes_before
  double largest_shift_m = 0;       ///< largest displacement of a frame at `at_depth_m`
  double seconds = 0;
  bool interrupted = false;   ///< stopped or out of memory; the map is unchanged
  std::string out_of_memory;  ///< the error as text; empty if there was enough memory
};

/// Rebuilds a map, or the part whose frames have moved, from its frames, while the old map stays complete;
/// put_into() then exchanges them. May run on another thread than the map's, one thread at a time.
class MapRebuild {
 public:
  /// `frames` must outlive this object.
  MapRebuild(const DenseParams& parameters, const FrameSource& frames, const MapRebuildOptions& options);
  ~MapRebuild();

  /// Reads the frames of a log (closed groups) again and integrates them at their current poses. Returns
  /// false if stopped early or out of memory (report()).
  bool replay(const ObservationLog& log, const PoseOfObservation& pose_now, const RunContext& run);
  /// True when nothing has moved far enough, so that there is nothing to exchange.
  [[nodiscard]] bool is_empty() const { return !whole_ && rebuilt_.empty(); }
  /// Adds a frame that was integrated into the map after replay() was given its log, with the changed volumes
  /// and its images; without images the frame is read again.
  void follow(const Observation& observation, std::span<const VolumeKey> changed,
              std::optional<RgbdFrame> images);
  /// Exchanges the rebuilt part with the map's, and updates the log. follow() must have been called for all
  /// frames after replay()'s log. The old part is freed with this object. kOutOfMemory: the map is
  /// incomplete.
  Result<void> put_into(DensePipeline& map, ObservationLog& log);
  /// Returns the mesh of the rebuilt part, instead of exchanging it.
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
  std::map<std::size_t, ObservationLog::Group> rebuilt_;  ///< by index of the group, with current poses
  std::set<std::size_t> moved_, done_;                    ///< places
  std::set<VolumeKey> wanted_;                            ///< unless whole_
  std::size_t frames_done_ = 0, frames_total_ = 0;
};

/// Corrects a map to the current poses, on the calling thread. If stopped, or if the new map does not fit
/// into memory beside the old one, map and log are unchanged.
MapCorrection correct_map(DensePipeline& map, ObservationLog& log, MapRebuild& rebuild,
                          const PoseOfObservation& pose_now, const RunContext& run);

}  // namespace hm
