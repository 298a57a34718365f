#include "hm/pipeline/experiments/rgbd/place_rate_experiment.hpp"

#include "hm/odometry/feature/feature_detection.hpp"
#include "hm/pipeline/experiments/common/experiment_frames.hpp"
#include "hm/report/mesh_figures.hpp"
#include "hm/slam/place_recognition/place_experiment.hpp"

namespace hm {
namespace {

using KeyframePointers = std::vector<std::shared_ptr<const Keyframe>>;

/// Keyframes with their true poses.
struct WalkedPlaces {
  KeyframePointers keyframes;
  std::vector<SE3> truth;
};

/// The first keyframes of a walk: one whenever the camera has moved or turned so far.
Result<WalkedPlaces> walk_places(const ExperimentOptions& options, std::size_t most) {
  constexpr double kKeyframeDistance_m = 0.3, kKeyframeAngle_rad = 0.35;
  SimulationParams scene = options.parameters.simulation;
  scene.world = WorldKind::kHouse;
  scene.sensor = SensorPreset::kKinect;
  const Simulation simulation(scene);
  FeatureDetector detector(options.parameters.features, simulation.camera(), {});
  const ParallelLoop loop(options.run.threads);
  WalkedPlaces walk;
  for (std::size_t i = 0; i < simulation.frame_count() && walk.keyframes.size() < most; ++i) {
    const SE3 pose = simulation.true_pose(i);
    if (!walk.truth.empty()) {
      const SE3 since = walk.truth.back().inverse() * pose;
      if (since.translation().norm() < kKeyframeDistance_m && since.angle() < kKeyframeAngle_rad) continue;
    }
    if (options.run.progress) options.run.progress({"keyframes", walk.keyframes.size(), most, {}});
    if (options.run.stop.stop_requested()) return fail(ErrorCode::kCancelled, {}, "stopped among keyframes");
    const RgbdFrame frame = simulation.frame(i, loop);
    Keyframe keyframe;
    keyframe.frame_index = i;
    keyframe.stamp = frame.stamp;
    keyframe.T_odom_camera = pose;
    keyframe.features = detector.detect(to_gray(frame.color), frame.depth);
    walk.keyframes.push_back(std::make_shared<const Keyframe>(std::move(keyframe)));
    walk.truth.push_back(pose);
  }
  return walk;
}

/// Associations whose motion is off the truth by more than 30 cm or 0.1 rad.
std::size_t false_places(const PlaceMatrices& matrices, const std::vector<SE3>& truth) {
  constexpr double kFalse_m = 0.3, kFalse_rad = 0.1;
  std::size_t count = 0;
  for (const PlaceAssociation& one : matrices.associations) {
    const SE3 error = one.T_a_b.inverse() * (truth[one.a].inverse() * truth[one.b]);
    count += error.translation().norm() > kFalse_m || error.angle() > kFalse_rad ? 1U : 0U;
  }
  return count;
}

void add_place_rows(const PlaceSweepRow& row, std::vector<ExperimentRow>& rows) {
  const auto name = fmt::format("n = {}, k = {}: ", row.candidates, row.neighbours);
  rows.push_back({name + "candidates found", {}, 100 * row.candidate_recall(), "%"});
  rows.push_back({name + "associations found", {}, 100 * row.association_recall(), "%"});
  rows.push_back({name + "time", {}, row.seconds, "s"});
}

std::vector<Figure> matrix_figures(const PlaceMatrices& matrices, int pixels) {
  PlacePictures pictures = draw_places(matrices, pixels);
  constexpr auto kHalf = HtmlReport::Place::kHalf;
  std::vector<Figure> figures;
  figures.push_back({"match", "Match: votes of a keyframe's features.", std::move(pictures.match), kHalf});
  figures.push_back(
      {"candidate", "Candidate: pairs that are compared.", std::move(pictures.candidate), kHalf});
  figures.push_back({"correspondence", "Correspondence: inliers of the compared pairs.",
                     std::move(pictures.correspondence), kHalf});
  figures.push_back(
      {"association", "Association: pairs of one place.", std::move(pictures.association), kHalf});
  return figures;
}

}  // namespace

Result<ExperimentFindings> run_place_experiment(const ExperimentOptions& options) {
  const auto walk = walk_places(options, options.tiny ? 14 : 150);
  if (!walk) return forward_error(walk);
  PlaceSearchParams search;
  search.min_keyframes_apart = 2;
  const PlaceMatrices brute_force = brute_force_places(walk->keyframes, search, {});
  ExperimentFindings findings;
  findings.rows = {
      {"keyframes", {}, static_cast<double>(walk->keyframes.size()), ""},
      {"brute force: associations", {}, static_cast<double>(brute_force.associations.size()), ""},
      {"brute force: of them false", {}, static_cast<double>(false_places(brute_force, walk->truth)), ""},
      {"brute force: time", {}, brute_force.seconds, "s"}};
  std::vector<Figure> figures;
  const std::vector<int> ns = options.tiny ? std::vector{10} : std::vector{5, 10, 15, 20};
  const std::vector<int> ks = options.tiny ? std::vector{4} : std::vector{2, 4, 6, 8, 10};
  for (const int n : ns)
    for (const int k : ks) {
      search.candidates = n, search.neighbours = k;
      const PlaceMatrices heuristic = heuristic_places(walk->keyframes, search, {});
      add_place_rows(compare_places(brute_force, heuristic, search), findings.rows);
      if (n == 10 && k == 4) figures = matrix_figures(heuristic, options.tiny ? 4 : 3);
    }
  findings.add_figures = [figures](HtmlReport& report) {
    report.begin_section("Matrices", "Of the heuristic search with n = 10, k = 4; white: more.");
    for (const Figure& figure : figures) add_figure(report, figure);
  };
  return findings;
}

}  // namespace hm
