// Rows about long runs of SLAM: judging loops at the end of a day, and the final adjustment of many
// keyframes.

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "hm/core/process_memory.hpp"
#include "hm/core/rng.hpp"
#include "hm/core/statistics.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/slam/rgbd/bundle_adjustment.hpp"
#include "hm/slam/rgbd/keyframe_graph.hpp"
#include "hm/slam/rgbd/loop_selector.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr double kKeyframe_m = 0.3;
constexpr std::size_t kLap = 200;     // keyframes of a lap through corridors, 60 m
constexpr std::size_t kRoomLap = 30;  // ... around a room, 9 m

/// The camera of a keyframe on a walk round and round a ring: x right, y down, z ahead.
SE3 camera_on_ring(std::size_t keyframe, std::size_t lap = kLap) {
  const double radius_m = kKeyframe_m * static_cast<double>(lap) / (2 * std::numbers::pi);
  const double angle = kKeyframe_m * static_cast<double>(keyframe) / radius_m;
  Mat3 looking_along_x;
  looking_along_x << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {so3_exp(Vec3(0, 0, angle + std::numbers::pi / 2)) * looking_along_x,
          Vec3(radius_m * std::cos(angle), radius_m * std::sin(angle), 0)};
}

/// Odometry whose motions err by a millimetre and a milliradian.
std::shared_ptr<Keyframe> next_keyframe(std::size_t index, SE3& T_odom_camera, Rng& rng) {
  if (index > 0) {
    const Vec6 error = 1e-3 * Vec6::NullaryExpr([&rng] { return rng.normal(); });
    T_odom_camera =
        T_odom_camera * (camera_on_ring(index - 1).inverse() * camera_on_ring(index)) * SE3::exp(error);
  }
  auto keyframe = std::make_shared<Keyframe>();
  keyframe->stamp = Time::from_seconds(0.3 * static_cast<double>(index + 1));
  keyframe->T_odom_camera = T_odom_camera;
  keyframe->motion_covariance = 1e-6 * Mat6::Identity();
  return keyframe;
}

/// A loop to the keyframe of an earlier lap that stood where the newest one stands.
LoopProposal loop_to(const KeyframeGraph& graph, std::size_t from, Rng& rng) {
  LoopProposal loop;
  loop.from = from;
  loop.to = graph.size() - 1;
  loop.match.outcome = PlaceOutcome::kSamePlace;
  loop.match.inliers = 100;
  const Vec6 error = 2e-3 * Vec6::NullaryExpr([&rng] { return rng.normal(); });
  loop.match.T_a_b = (camera_on_ring(from).inverse() * camera_on_ring(loop.to)) * SE3::exp(error);
  loop.match.covariance = 4e-6 * Mat6::Identity();
  return loop;
}

/// A graph that grows to a day's keyframes, the last milliseconds that judging took on the way.
struct Day {
  std::vector<double> keyframes, median_ms, worst_ms;
  double worst_of_all_ms = 0, memory_mb = 0;
};

Day judge_for_a_day(std::size_t keyframes) {
  Rng rng(1);
  const RgbdLoopParams params;
  KeyframeGraph graph(params);
  LoopSelector selector(params);
  SE3 T_odom_camera = camera_on_ring(0);
  std::vector<SE3> truth;
  std::vector<double> ms;
  Day day;
  const double before_mb = static_cast<double>(resident_bytes()) / 1e6;
  for (std::size_t i = 0; i < keyframes; ++i) {
    graph.add(next_keyframe(i, T_odom_camera, rng));
    truth.push_back(camera_on_ring(i));
    std::vector<LoopProposal> proposals;
    if (i >= kLap && i % 5 == 0)
      for (std::size_t lap = 1; lap <= std::min<std::size_t>(3, i / kLap); ++lap)
        proposals.push_back(
            loop_to(graph, i - kLap * (1 + rng.below(static_cast<std::uint32_t>(i / kLap))), rng));
    const bool is_judged = !proposals.empty();
    const double before_s = thread_cpu_s();
    const LoopDecision decision = selector.update(graph, std::move(proposals));
    if (is_judged) {
      ms.push_back(1e3 * (thread_cpu_s() - before_s));
      day.worst_of_all_ms = std::max(day.worst_of_all_ms, ms.back());
    }
    for (const LoopProposal& loop : decision.accepted)
      if (loop.information_gain_ratio > params.kMinInformationGainRatio)
        graph.add_loop(
            {loop.from, loop.to, loop.match.T_a_b, loop.match.covariance.inverse(), PoseEdgeKind::kLoop});
    // What solving the graph would do, which is not measured here.
    if (i % 500 == 499) graph.set_poses(truth);
    if (!ms.empty() && (i + 1 == keyframes / 10 || i + 1 == keyframes)) {
      const std::size_t newest = std::min<std::size_t>(400, ms.size());
      std::vector<double> last(ms.end() - static_cast<std::ptrdiff_t>(newest), ms.end());
      day.keyframes.push_back(static_cast<double>(i + 1));
      day.worst_ms.push_back(*std::max_element(last.begin(), last.end()));
      day.median_ms.push_back(middle_value(std::span(last)));
    }
  }
  day.memory_mb = static_cast<double>(resident_bytes()) / 1e6 - before_mb;
  return day;
}

constexpr double kPointsPerMetre = 90, kNear_m = 0.7, kFar_m = 4.5;

/// Landmarks on the walls of the ring as odometry makes them, one a lap and point, each with a few sights
/// from other laps, as many however many laps there are; keyframes a centimetre off their places, slowly
/// changing.
Bundle make_bundle(std::size_t keyframes, std::size_t lap, std::uint64_t seed) {
  Rng rng(seed);
  Bundle bundle{{640, 480, 525, 525, 319.5, 239.5, {}}, {}, {}, {0}, {}};
  std::vector<SE3> truth;
  Vec6 drift = Vec6::Zero();
  for (std::size_t k = 0; k < keyframes; ++k) {
    truth.push_back(camera_on_ring(k, lap));
    bundle.T_map_camera.push_back(truth[k] * SE3::exp(drift));
    drift = 0.98 * drift + 0.002 * Vec6::NullaryExpr([&rng] { return rng.normal(); });
    if (k == 0) continue;
    bundle.edges.push_back(
        {k - 1, k, truth[k - 1].inverse() * truth[k], 1e4 * Mat6::Identity(), PoseEdgeKind::kOdometry});
  }
  const auto sight = [&](std::size_t k, const Vec3& p_map) -> std::optional<BundleObservation> {
    const Vec3 p = truth[k].inverse() * p_map;
    if (p.z() < kNear_m || p.z() > kFar_m || !bundle.camera.contains(bundle.camera.project(p)))
      return std::nullopt;
    const double sigma_m = 0.0014 * p.z() * p.z();
    return BundleObservation{static_cast<std::uint32_t>(k),
                             bundle.camera.project(p) + 0.5 * Vec2(rng.normal(), rng.normal()),
                             0.25 * Eigen::Matrix2d::Identity(), p.z() + sigma_m * rng.normal(), sigma_m};
  };
  const std::size_t reach = static_cast<std::size_t>(kFar_m / kKeyframe_m) + 1;
  const double ring_m = kKeyframe_m * static_cast<double>(lap);
  const auto points = static_cast<std::size_t>(kPointsPerMetre * ring_m);
  const std::size_t laps = keyframes / lap;
  for (std::size_t point = 0; point < points; ++point) {
    const double at_m = rng.uniform(0, ring_m);
    const auto nearest = static_cast<std::size_t>(at_m / kKeyframe_m);
    const Vec3 p_map =
        camera_on_ring(nearest, lap) * Vec3(rng.uniform() < 0.5 ? -1 : 1, rng.uniform(-1.2, 1.2), 0);
    for (std::size_t passing = nearest + lap; passing < keyframes + reach; passing += lap) {
      BundleLandmark landmark;
      for (std::size_t k = passing - reach; k <= std::min(passing, keyframes - 1); ++k)
        if (const auto seen = sight(k, p_map)) landmark.observations.push_back(*seen);
      if (landmark.observations.size() < 2) continue;
      const BundleObservation& first = landmark.observations.front();
      landmark.p_map =
          bundle.T_map_camera[first.keyframe] * bundle.camera.unproject(first.pixel, first.depth_m);
      for (int link = 0; link < 6; ++link) {
        // Any lap but the one on which the landmark was made.
        std::size_t other = rng.below(static_cast<std::uint32_t>(laps - 1));
        if (other >= passing / lap) ++other;
        const std::size_t k = nearest + other * lap - rng.below(static_cast<std::uint32_t>(reach));
        const bool is_there =
            std::ranges::any_of(landmark.observations, [k](const auto& o) { return o.keyframe == k; });
        if (k >= keyframes || is_there) continue;
        if (const auto seen = sight(k, p_map)) landmark.observations.push_back(*seen);
      }
      std::ranges::sort(landmark.observations, {}, &BundleObservation::keyframe);
      bundle.landmarks.push_back(std::move(landmark));
    }
  }
  return bundle;
}

/// One adjustment, and how far its keyframes are from the truth.
struct Adjustment {
  double seconds = 0, error_mm = 0;
  BundleResult result;
};

Adjustment adjust(std::size_t keyframes, std::size_t lap) {
  Bundle bundle = make_bundle(keyframes, lap, 1);
  Adjustment adjustment;
  const double before_s = thread_cpu_s();
  adjustment.result = adjust_bundle(bundle);
  adjustment.seconds = thread_cpu_s() - before_s;
  double squares = 0;
  for (std::size_t k = 0; k < keyframes; ++k)
    squares += (bundle.T_map_camera[k].translation() - camera_on_ring(k, lap).translation()).squaredNorm();
  adjustment.error_mm = 1e3 * std::sqrt(squares / static_cast<double>(keyframes));
  return adjustment;
}

/// Adjustments of more and more keyframes that go round and round a ring of so many.
struct GrowingBundle {
  double ms_a_keyframe = 0;  ///< of the largest
  double growth_ratio = 0;   ///< cost of an observation in the largest, relative to the smallest
  JsonValue runs = JsonValue::array();
};

GrowingBundle adjust_more_and_more(std::size_t least, std::size_t most, std::size_t lap) {
  GrowingBundle growing;
  double first_s = 0;
  for (std::size_t keyframes = least; keyframes <= most; keyframes *= 2) {
    const Adjustment one = adjust(keyframes, lap);
    const double observation_s = one.seconds / static_cast<double>(one.result.observations);
    if (keyframes == least) first_s = observation_s;
    growing.growth_ratio = observation_s / first_s;
    growing.ms_a_keyframe = 1e3 * one.seconds / static_cast<double>(keyframes);
    growing.runs.push_back(JsonValue::object({{"keyframes", keyframes},
                                              {"observations", one.result.observations},
                                              {"iterations", one.result.iterations},
                                              {"conjugate_gradients", one.result.conjugate_gradients},
                                              {"seconds", one.seconds},
                                              {"error_mm", one.error_mm},
                                              {"error_after_px", one.result.error_after_px},
                                              {"converged", one.result.converged},
                                              {"cost", one.result.final_cost}}));
  }
  return growing;
}

}  // namespace

Result<BenchResult> bench_loop_soak(const BenchOptions& options) {
  // Eight hours with a keyframe every 0.3 s.
  const Day day =
      judge_for_a_day(options.frame_limit > 0 ? static_cast<std::size_t>(options.frame_limit) : 96000);
  BenchResult result;
  result.rows = {{"loop_judging", day.worst_of_all_ms, {}}};
  result.details = JsonValue::object({{"keyframes", day.keyframes.back()},
                                      {"median_ms", day.median_ms.back()},
                                      {"median_ms_after_a_tenth", day.median_ms.front()},
                                      {"worst_ms", day.worst_ms.back()},
                                      {"worst_ms_after_a_tenth", day.worst_ms.front()},
                                      {"graph_mb", day.memory_mb}});
  return result;
}

Result<BenchResult> bench_bundle_soak(const BenchOptions& options) {
  const std::size_t most = options.frame_limit > 0 ? static_cast<std::size_t>(options.frame_limit) : 4000;
  GrowingBundle corridors = adjust_more_and_more(most / 4, most, kLap);
  GrowingBundle room = adjust_more_and_more(most / 16, most / 2, kRoomLap);
  BenchResult result;
  result.rows = {{"bundle_time", corridors.ms_a_keyframe, {}},
                 {"bundle_growth", std::max(corridors.growth_ratio, room.growth_ratio), {}}};
  result.details = JsonValue::object({});
  result.details["corridors"] = std::move(corridors.runs);
  result.details["room"] = std::move(room.runs);
  return result;
}

}  // namespace hm::bench
