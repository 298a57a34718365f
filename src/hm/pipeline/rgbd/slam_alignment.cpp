#include "hm/pipeline/rgbd/slam_alignment.hpp"

#include <map>
#include <vector>

#include "hm/core/stopwatch.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/tsdf/alignment/trajectory_aligner.hpp"
#include "hm/tsdf/integration/integrator.hpp"

namespace hm {
namespace {

constexpr std::size_t kTidyFrames = 30;  ///< what is too old is looked for this often

TsdfParams without_color(TsdfParams params) {
  params.color = false;
  return params;
}

}  // namespace

struct SlamAlignment::Impl {
  Impl(const MappingParams& all, const PinholeCamera& camera)
      : tsdf(without_color(all.tsdf)),
        memory_frames(static_cast<std::size_t>(all.slam.align_memory_frames)),
        grid(Integrator::make_grid(tsdf)),
        integrator(tsdf, all.depth_noise, camera, loop),
        aligner(all.alignment, tsdf, all.depth_noise, camera) {}

  TsdfParams tsdf;
  std::size_t memory_frames;
  ParallelLoop loop{1};
  VolumeGrid grid;
  Integrator integrator;
  TrajectoryAligner aligner;
  std::map<VolumeKey, std::size_t> changed_at;  ///< frame that changed a volume last
  std::size_t frames = 0;
  int submap = 0;
  SlamAlignmentSummary counts;
  std::vector<double> times_ms;

  void begin_submap(int number);
  /// The poses that a frame had: odometry's, and with the corrections of the frames before.
  struct Poses {
    std::size_t index;
    const SE3 &odometry, &before;
  };
  void note(const Poses& poses, const AlignmentResult& found);
  void remember(const RgbdFrame& frame, const SE3& T_odom_camera);
};

SlamAlignment::SlamAlignment(const MappingParams& parameters, const PinholeCamera& camera)
    : impl_(std::make_unique<Impl>(parameters, camera)) {}
SlamAlignment::~SlamAlignment() = default;

/// Where it is relative to the one before is not known.
void SlamAlignment::Impl::begin_submap(int number) {
  submap = number;
  grid = Integrator::make_grid(tsdf);
  changed_at.clear();
  aligner.set_T_map_odom({});
}

void SlamAlignment::Impl::note(const Poses& poses, const AlignmentResult& found) {
  ++(found.status == AlignmentStatus::kAccepted ? counts.accepted : counts.not_accepted);
  if (found.status != AlignmentStatus::kAccepted)
    counts.first_reason.try_emplace(found.status, fmt::format("frame {}: {}", poses.index, found.reason));
  const Vec3& at = found.T_world_camera.translation();
  counts.frames.push_back({poses.index, found.status, (at - poses.before.translation()).norm(),
                           (at - poses.odometry.translation()).norm(), found.before.rms_m,
                           found.after.rms_m});
}

void SlamAlignment::Impl::remember(const RgbdFrame& frame, const SE3& T_odom_camera) {
  const ScanStats scan = integrator.integrate(grid, {frame, T_odom_camera});
  ++frames;
  for (const ChangedVolume& volume : scan.changed)
    if (volume.released)
      changed_at.erase(volume.key);
    else
      changed_at[volume.key] = frames;
  if (memory_frames == 0 || frames % kTidyFrames != 0) return;
  std::erase_if(changed_at, [&](const auto& entry) {
    if (entry.second + memory_frames >= frames) return false;
    grid.release(entry.first);
    return true;
  });
}

void SlamAlignment::align(const RgbdFrame& frame, TrackedFrame& tracked) {
  if (!tracked.T_odom_camera) return;
  const Stopwatch watch;
  Impl& impl = *impl_;
  if (tracked.submap != impl.submap) impl.begin_submap(tracked.submap);
  const bool first = impl.grid.volume_count() == 0;
  const SE3 odometry = *tracked.T_odom_camera * tracked.T_camera_depth;
  const SE3 before = impl.aligner.T_map_odom() * odometry;
  const AlignmentResult found = impl.aligner.align(impl.grid, frame.depth, odometry, tracked.covariance);
  if (!first) impl.note({frame.index, odometry, before}, found);
  tracked.T_odom_camera = found.T_world_camera * tracked.T_camera_depth.inverse();
  if (tracked.new_keyframe) {
    auto keyframe = std::make_shared<Keyframe>(*tracked.new_keyframe);
    keyframe->T_odom_camera = impl.aligner.T_map_odom() * keyframe->T_odom_camera;
    tracked.new_keyframe = std::move(keyframe);
  }
  impl.remember(frame, found.T_world_camera);
  impl.times_ms.push_back(watch.milliseconds());
}

SlamAlignmentSummary SlamAlignment::summary() const {
  SlamAlignmentSummary summary = impl_->counts;
  summary.milliseconds = summarise(impl_->times_ms);
  return summary;
}

}  // namespace hm
