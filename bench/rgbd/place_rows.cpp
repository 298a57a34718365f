// Rows about places seen again: the house walked through with a Kinect (dissertation 3.3, Fig. 3.11,
// Table 3.1).
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <utility>

#include "hm/io/image/image_file.hpp"
#include "hm/odometry/feature/feature_detection.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "hm/slam/place_recognition/place_experiment.hpp"
#include "hm/slam/rgbd/rgbd_loop_closer.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

/// A keyframe when the camera moved or turned so far.
constexpr double kKeyframeDistance_m = 0.3, kKeyframeAngle_rad = 0.35;
/// An association further from the truth is false.
constexpr double kFalse_m = 0.3, kFalse_rad = 0.1;
constexpr std::size_t kKeyframes = 150;
/// Odometry that is handed to the loop closer turns away by this much, always the same way.
constexpr double kDrift_rad_m = 0.002;

struct HouseKeyframes {
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  std::vector<SE3> truth;
  PinholeCamera camera;
};

/// The first keyframes of the walk; their odometry drifts.
HouseKeyframes house_keyframes(std::size_t count) {
  SimulationParams params;
  params.sensor = SensorPreset::kKinect;
  const Simulation simulation(params);
  FeatureDetector detector({}, simulation.camera(), {});
  HouseKeyframes house;
  house.camera = simulation.camera();
  SE3 T_odom_camera = simulation.true_pose(0);
  for (std::size_t i = 0; i < simulation.frame_count() && house.keyframes.size() < count; ++i) {
    const SE3 pose = simulation.true_pose(i);
    const SE3 since = house.truth.empty() ? SE3() : house.truth.back().inverse() * pose;
    if (!house.truth.empty() && since.translation().norm() < kKeyframeDistance_m &&
        since.angle() < kKeyframeAngle_rad)
      continue;
    T_odom_camera = T_odom_camera * since *
                    SE3(so3_exp(Vec3(0, kDrift_rad_m * since.translation().norm(), 0)), Vec3::Zero());
    const RgbdFrame frame = simulation.frame(i);
    Keyframe keyframe;
    keyframe.frame_index = i;
    keyframe.stamp = simulation.stamp(i);
    keyframe.T_odom_camera = T_odom_camera;
    keyframe.features = detector.detect(to_gray(frame.color), frame.depth);
    house.keyframes.push_back(std::make_shared<const Keyframe>(std::move(keyframe)));
    house.truth.push_back(pose);
  }
  return house;
}

bool is_false(const SE3& T_a_b, const SE3& truth_a, const SE3& truth_b) {
  const SE3 error = T_a_b.inverse() * (truth_a.inverse() * truth_b);
  return error.translation().norm() > kFalse_m || error.angle() > kFalse_rad;
}

std::size_t false_associations(const PlaceMatrices& matrices, const HouseKeyframes& house) {
  std::size_t count = 0;
  for (const PlaceAssociation& one : matrices.associations)
    count += is_false(one.T_a_b, house.truth[one.a], house.truth[one.b]) ? 1 : 0;
  return count;
}

/// Table 3.1: every n with every k.
JsonValue sweep(const HouseKeyframes& house, const PlaceMatrices& brute_force, PlaceSearchParams search) {
  JsonValue table = JsonValue::array();
  for (const int n : {5, 10, 15, 20})
    for (const int k : {2, 4, 6, 8, 10}) {
      search.candidates = n;
      search.neighbours = k;
      const PlaceSweepRow row =
          compare_places(brute_force, heuristic_places(house.keyframes, search, {}), search);
      table.push_back(
          JsonValue::object({{"n", n},
                             {"k", k},
                             {"total", static_cast<double>(row.total)},
                             {"missed_candidates", static_cast<double>(row.missed_candidates)},
                             {"missed_associations", static_cast<double>(row.missed_associations)},
                             {"candidate_recall", row.candidate_recall()},
                             {"association_recall", row.association_recall()},
                             {"seconds", row.seconds}}));
    }
  return table;
}

/// The matrices of Fig. 3.11 as files, when HM_PLACE_PICTURES names a folder.
Result<void> write_figures(const PlaceMatrices& matrices) {
  const char* folder = std::getenv("HM_PLACE_PICTURES");
  if (folder == nullptr) return {};
  const PlacePictures pictures = draw_places(matrices, 4);
  const std::pair<const char*, const Image<Rgb8>*> files[] = {
      {"match.png", &pictures.match},
      {"candidate.png", &pictures.candidate},
      {"correspondence.png", &pictures.correspondence},
      {"association.png", &pictures.association}};
  for (const auto& [name, picture] : files)
    if (auto written = write_png(std::filesystem::path(folder) / name, *picture); !written) return written;
  return {};
}

struct ClosedHouse {
  RgbdLoopStatistics loops;
  std::size_t false_edges = 0;
  double odometry_m = 0, solved_m = 0, adjusted_m = 0;  ///< RMS of keyframes
};

double error_m(const std::vector<CorrectedKeyframe>& keyframes, const std::vector<SE3>& truth,
               bool corrected) {
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const SE3& pose = corrected ? keyframes[i].T_map_camera : keyframes[i].T_odom_camera;
    sum += (pose.translation() - truth[i].translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

ClosedHouse close_house(const HouseKeyframes& house) {
  RgbdLoopCloser closer(house.camera);
  for (const auto& keyframe : house.keyframes) closer.add(keyframe);
  ClosedHouse result;
  result.solved_m = error_m(closer.corrected().keyframes(), house.truth, true);
  closer.finish();
  result.odometry_m = error_m(closer.corrected().keyframes(), house.truth, false);
  result.adjusted_m = error_m(closer.corrected().keyframes(), house.truth, true);
  result.loops = closer.statistics();
  for (const PoseEdge3D& edge : closer.graph().edges)
    if (edge.kind == PoseEdgeKind::kLoop &&
        is_false(edge.T_from_to, house.truth[edge.from], house.truth[edge.to]))
      ++result.false_edges;
  return result;
}

}  // namespace

Result<BenchResult> bench_places(const BenchOptions&) {
  const HouseKeyframes house = house_keyframes(kKeyframes);
  PlaceSearchParams search;
  search.candidates = 10;
  search.neighbours = 4;
  search.min_keyframes_apart = 2;
  const PlaceMatrices brute_force = brute_force_places(house.keyframes, search, {});
  const PlaceMatrices heuristic = heuristic_places(house.keyframes, search, {});
  if (auto written = write_figures(heuristic); !written) return forward_error(written);
  const PlaceSweepRow row = compare_places(brute_force, heuristic, search);
  const ClosedHouse closed = close_house(house);
  BenchResult result;
  result.rows.push_back({"places", 100 * row.candidate_recall(), std::nullopt});
  result.rows.push_back({"places_associations", 100 * row.association_recall(), std::nullopt});
  result.rows.push_back({"places_false", static_cast<double>(closed.false_edges), std::nullopt});
  result.rows.push_back({"places_speed", heuristic.seconds, brute_force.seconds});
  result.details = JsonValue::object(
      {{"keyframes", static_cast<double>(house.keyframes.size())},
       {"associations", static_cast<double>(row.total)},
       {"false_associations_before_judging", static_cast<double>(false_associations(heuristic, house))},
       {"loops_accepted", static_cast<double>(closed.loops.accepted)},
       {"loops_too_far", static_cast<double>(closed.loops.too_far)},
       {"loops_ambiguous", static_cast<double>(closed.loops.ambiguous)},
       {"odometry_rms_m", closed.odometry_m},
       {"solved_rms_m", closed.solved_m},
       {"adjusted_rms_m", closed.adjusted_m},
       {"table_3_1", sweep(house, brute_force, search)}});
  return result;
}

}  // namespace hm::bench
