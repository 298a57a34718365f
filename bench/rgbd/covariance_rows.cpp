// Row about the covariances that odometry states and the pose graph uses: errors against the truth of a
// simulated house, normalised by the stated standard deviations.
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <span>

#include "hm/core/parallel.hpp"
#include "hm/geometry/pose_graph_3d.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/make_odometry.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "hm/sim/sensor/renderer.hpp"
#include "hm/slam/rgbd/keyframe_graph.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr std::array kSeeds{101, 102, 103, 104, 105};  // recordings.json; constants were chosen on 1 to 5
constexpr int kStride = 3, kFrames = 120;              // 10 Hz, 12 s of the walk
constexpr int kPoseStride = 10;                        // neighbouring poses err alike
constexpr int kPlaneRadius_px = 4;

/// Root mean square of errors in standard deviations, over all degrees of freedom.
struct NormalisedError {
  double squares = 0, count = 0;
  void add(double squared_mahalanobis, int degrees) {
    squares += squared_mahalanobis;
    count += degrees;
  }
  [[nodiscard]] double value() const { return count > 0 ? std::sqrt(squares / count) : 0; }
};

template <int N>
double squared_mahalanobis(const Eigen::Matrix<double, N, 1>& error,
                           const Eigen::Matrix<double, N, N>& covariance) {
  return error.dot(covariance.ldlt().solve(error));
}

/// The errors of poses, with those of translation and rotation alone.
struct PoseErrors {
  NormalisedError all, translation, rotation;
  void add(const Vec6& error, const Mat6& covariance) {
    all.add(squared_mahalanobis<6>(error, covariance), 6);
    translation.add(squared_mahalanobis<3>(error.head<3>(), covariance.topLeftCorner<3, 3>()), 3);
    rotation.add(squared_mahalanobis<3>(error.tail<3>(), covariance.bottomRightCorner<3, 3>()), 3);
  }
  [[nodiscard]] JsonValue details() const {
    return JsonValue::object({{"all", all.value()},
                              {"translation", translation.value()},
                              {"rotation", rotation.value()},
                              {"count", all.count / 6}});
  }
};

/// Depths that were read for the first time with a new landmark, for one that was known, and fused over the
/// frames up to the next keyframe; poses in `odom`; motions between keyframes as the pose graph has them.
struct Consistency {
  NormalisedError depth_new, depth_matched, depth_fused;
  PoseErrors poses, edges;
};

/// A keyframe with the truth.
struct KnownKeyframe {
  std::shared_ptr<const Keyframe> keyframe;
  SE3 T_world_camera;
  RenderedView view;
};

/// Seen within 60 degrees of the normal, away from steps of depth: where the sensor's noise is as modelled.
bool is_plane(const RenderedView& view, int x, int y) {
  constexpr int kRadius = kPlaneRadius_px;
  if (!view.depth_m.contains(x - kRadius, y - kRadius) || !view.depth_m.contains(x + kRadius, y + kRadius))
    return false;
  float low = view.depth_m(x, y), high = low;
  for (int v = y - kRadius; v <= y + kRadius; ++v)
    for (int u = x - kRadius; u <= x + kRadius; ++u) {
      low = std::min(low, view.depth_m(u, v));
      high = std::max(high, view.depth_m(u, v));
    }
  return low > 0 && view.cos_incidence(x, y) > 0.5F && high - low < 0.02F + 0.04F * low;
}

/// True depth at a position between pixels: inverse depth is linear on a plane.
double true_depth_m(const Image<float>& depth_m, const Vec2& pixel) {
  const int x = static_cast<int>(std::floor(pixel.x())), y = static_cast<int>(std::floor(pixel.y()));
  const double a = pixel.x() - x, b = pixel.y() - y;
  const auto inverse = [&](int u, int v) { return 1 / static_cast<double>(depth_m(u, v)); };
  return 1 / ((1 - b) * ((1 - a) * inverse(x, y) + a * inverse(x + 1, y)) +
              b * ((1 - a) * inverse(x, y + 1) + a * inverse(x + 1, y + 1)));
}

void add_depth(const LandmarkObservation& seen, const RenderedView& view, NormalisedError& errors) {
  const int x = static_cast<int>(std::lround(seen.pixel.x()));
  const int y = static_cast<int>(std::lround(seen.pixel.y()));
  if (!(seen.depth_m > 0) || !is_plane(view, x, y)) return;
  const double error_m = seen.depth_m - true_depth_m(view.depth_m, seen.pixel);
  errors.add(error_m * error_m / seen.depth_variance_m2, 1);
}

void add_keyframe(const KnownKeyframe* last, const KnownKeyframe& now, Consistency& found) {
  const auto was_known = [last](std::uint64_t landmark) {
    return last && std::ranges::any_of(last->keyframe->observations,
                                       [landmark](const auto& seen) { return seen.landmark == landmark; });
  };
  for (const LandmarkObservation& seen : now.keyframe->observations)
    add_depth(seen, now.view, was_known(seen.landmark) ? found.depth_matched : found.depth_new);
  if (!last) return;
  if (now.keyframe->before)
    for (const LandmarkObservation& seen : now.keyframe->before->observations)
      add_depth(seen, last->view, found.depth_fused);
  if (last->keyframe->submap != now.keyframe->submap) return;
  const PoseEdge3D edge{0, 1, last->keyframe->T_odom_camera.inverse() * now.keyframe->T_odom_camera};
  found.edges.add(pose_edge_error(edge, last->T_world_camera, now.T_world_camera),
                  odometry_covariance(edge.T_from_to, now.keyframe->motion_covariance, {}));
}

Consistency follow(int seed, int frames, int threads) {
  SimulationParams scene;
  scene.sensor = SensorPreset::kKinect;
  scene.flaws = "depth_grain";
  scene.seed = seed;
  scene.frame_stride = kStride;
  scene.frame_limit = frames;
  const Simulation simulation(scene);
  const Renderer renderer(simulation.world());
  const auto odometry = make_visual_odometry({}, simulation.camera(), simulation.true_pose(0));
  Consistency found;
  std::optional<KnownKeyframe> last;
  for (std::size_t i = 0; i < simulation.frame_count(); ++i) {
    RgbdFrame frame = simulation.frame(i);
    frame.index = i;
    const SE3 truth = simulation.true_pose(i);
    const TrackedFrame tracked = odometry->track(frame);
    if (!tracked.T_odom_camera) continue;
    if (i % kPoseStride == kPoseStride - 1)
      found.poses.add((truth * tracked.T_odom_camera->inverse()).log(), tracked.covariance);
    if (!tracked.new_keyframe) continue;
    KnownKeyframe now{tracked.new_keyframe, truth,
                      renderer.render(simulation.camera(), truth, ParallelLoop(threads))};
    add_keyframe(last ? &*last : nullptr, now, found);
    last = std::move(now);
  }
  return found;
}

void add(NormalisedError& sum, const NormalisedError& other) {
  sum.squares += other.squares;
  sum.count += other.count;
}

void add(PoseErrors& sum, const PoseErrors& other) {
  add(sum.all, other.all);
  add(sum.translation, other.translation);
  add(sum.rotation, other.rotation);
}

/// The one whose ratio to 1 is largest.
double farthest_from_one(std::span<const double> values) {
  return *std::ranges::max_element(values, {}, [](double value) { return std::abs(std::log(value)); });
}

}  // namespace

Result<BenchResult> bench_covariance_used(const BenchOptions& options) {
  Consistency all;
  JsonValue seeds = JsonValue::array();
  for (const int seed : kSeeds) {
    const Consistency one =
        follow(seed, options.frame_limit > 0 ? options.frame_limit : kFrames, options.threads);
    add(all.depth_new, one.depth_new);
    add(all.depth_matched, one.depth_matched);
    add(all.depth_fused, one.depth_fused);
    add(all.poses, one.poses);
    add(all.edges, one.edges);
    seeds.push_back(
        JsonValue::object({{"seed", seed}, {"poses", one.poses.details()}, {"edges", one.edges.details()}}));
  }
  const std::array depths{all.depth_new.value(), all.depth_matched.value(), all.depth_fused.value()};
  const std::array parts{farthest_from_one(depths), all.poses.all.value(), all.edges.all.value()};
  if (std::ranges::any_of(parts, [](double part) { return !(part > 0); }))
    return fail(ErrorCode::kInternal, "covariance_used", "too few frames to judge every part");
  BenchResult result;
  result.rows = {{"covariance_used", farthest_from_one(parts), {}},
                 {"covariance_used_depth", parts[0], {}},
                 {"covariance_used_poses", parts[1], {}},
                 {"covariance_used_edges", parts[2], {}}};
  result.details = JsonValue::object({{"depth_new", depths[0]},
                                      {"depth_matched", depths[1]},
                                      {"depth_fused", depths[2]},
                                      {"depths", all.depth_new.count + all.depth_matched.count},
                                      {"poses", all.poses.details()},
                                      {"edges", all.edges.details()},
                                      {"seeds", seeds}});
  return result;
}

}  // namespace hm::bench
