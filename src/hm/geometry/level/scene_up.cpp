#include "hm/geometry/level/scene_up.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "hm/core/angle.hpp"
#include "hm/core/statistics.hpp"
#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr double kClusterWindow_rad = 10 * kRadiansPerDegree;
constexpr double kEvidenceWindow_rad = 6 * kRadiansPerDegree;
constexpr double kSameDirection_rad = 3 * kRadiansPerDegree;
constexpr double kLeastCluster_share = 0.02;
constexpr std::size_t kMostClusters = 10;
/// Score margin over the second-best candidate below which up is unknown; less than the preference for a
/// camera held landscape.
constexpr double kClearMargin = 0.5;
constexpr double kPortraitPenalty = 1.0, kUpsideDownPenalty = 1.8;
constexpr double kLeastLevel_share = 0.04, kLeastVertical_share = 0.04;
constexpr double kLeastSigma_rad = 0.3 * kRadiansPerDegree;   // deviation of floors and walls in buildings
constexpr double kNormalSigma_rad = 1.0 * kRadiansPerDegree;  // of normals, which depth cameras distort

double angle_between(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

/// Histogram of surface area by normal: cells of about 4 degrees on the faces of a cube.
class NormalHistogram {
 public:
  struct Cell {
    Vec3 normal = Vec3::Zero();  ///< unit, mean of its surface
    double share = 0;
  };
  explicit NormalHistogram(std::span<const SurfacePatch> patches) {
    std::vector<Vec3> sums(6 * kSide * kSide, Vec3::Zero());
    std::vector<double> areas(sums.size(), 0.0);
    double total = 0;
    for (const SurfacePatch& patch : patches) {
      const std::size_t cell = cell_of(patch.normal);
      sums[cell] += patch.area * patch.normal;
      areas[cell] += patch.area;
      total += patch.area;
    }
    for (std::size_t i = 0; i < sums.size(); ++i)
      if (areas[i] > 0) cells_.push_back({sums[i].normalized(), areas[i] / total});
  }
  [[nodiscard]] const std::vector<Cell>& cells() const { return cells_; }

 private:
  static constexpr std::size_t kSide = 24;
  static std::size_t cell_of(const Vec3& n) {
    Eigen::Index axis = 0;
    n.cwiseAbs().maxCoeff(&axis);
    const double length = std::abs(n[axis]);
    const auto step = [&](double value) {
      const double at = (std::atan2(value, length) / (M_PI / 2) + 0.5) * static_cast<double>(kSide);
      return static_cast<std::size_t>(std::clamp(at, 0.0, static_cast<double>(kSide) - 1));
    };
    const auto face = static_cast<std::size_t>(2 * axis + (n[axis] < 0 ? 1 : 0));
    return (face * kSide + step(n[(axis + 1) % 3])) * kSide + step(n[(axis + 2) % 3]);
  }
  std::vector<Cell> cells_;
};

/// Normals of much of the surface, largest area first.
std::vector<Vec3> clusters_of(const NormalHistogram& histogram) {
  struct Peak {
    Vec3 mean;
    double share;
  };
  std::vector<Peak> peaks;
  const double cosine = std::cos(kClusterWindow_rad);
  for (const auto& cell : histogram.cells()) {
    Peak peak{Vec3::Zero(), 0};
    for (const auto& other : histogram.cells())
      if (other.normal.dot(cell.normal) > cosine) {
        peak.mean += other.share * other.normal;
        peak.share += other.share;
      }
    peak.mean.normalize();
    if (peak.share > kLeastCluster_share) peaks.push_back(peak);
  }
  std::sort(peaks.begin(), peaks.end(), [](const Peak& a, const Peak& b) { return a.share > b.share; });
  std::vector<Vec3> clusters;
  for (const Peak& peak : peaks) {
    if (clusters.size() == kMostClusters) break;
    if (std::all_of(clusters.begin(), clusters.end(),
                    [&](const Vec3& c) { return angle_between(c, peak.mean) > 1.5 * kClusterWindow_rad; }))
      clusters.push_back(peak.mean);
  }
  return clusters;
}

/// See scene_up_candidates(); nothing if it diverges from the start.
std::optional<Vec3> refined(std::span<const SurfacePatch> patches, const Vec3& start) {
  Vec3 up = start;
  for (const double window_deg : {10.0, 5.0, 3.0, 3.0}) {
    const double most = std::sin(window_deg * kRadiansPerDegree);
    Mat3 sum = Mat3::Zero();
    for (const SurfacePatch& patch : patches) {
      const double along = patch.normal.dot(up);
      const double across_squared = std::max(0.0, 1 - along * along);
      const bool vertical = std::abs(along) < most;
      if (!vertical && across_squared > most * most) continue;
      const double r = (vertical ? along * along : across_squared) / (most * most);
      const double weight = patch.area * (1 - r) * (1 - r) * (vertical ? 1 : -1);
      sum += weight * patch.normal * patch.normal.transpose();
    }
    if (sum.isZero()) return std::nullopt;
    const Eigen3 axes = symmetric_eigen(sum);
    if (axes.values[1] - axes.values[0] < 1e-9 * sum.norm()) return std::nullopt;
    const Vec3 found = axes.vectors.col(0);
    up = found.dot(up) < 0 ? Vec3(-found) : found;
  }
  if (angle_between(up, start) > 1.5 * kClusterWindow_rad) return std::nullopt;
  return up;
}

/// Horizontal surfaces at one height: their total area, centre and scatter.
struct Level {
  double area = 0, height = 0;
  Vec3 centre = Vec3::Zero();
  Mat3 scatter = Mat3::Zero();  ///< of the positions about the centre, weighted by area
};

/// Heights with a large area of horizontal surface, at least 20 cm apart.
std::vector<double> heights_of(std::span<const SurfacePatch> level, const Vec3& up) {
  constexpr double kStep_m = 0.05;
  constexpr std::size_t kMost = 6;
  std::map<int, double> areas;
  double total = 0;
  for (const SurfacePatch& patch : level) {
    areas[static_cast<int>(std::floor(std::clamp(patch.centre.dot(up) / kStep_m, -1e8, 1e8)))] += patch.area;
    total += patch.area;
  }
  std::vector<std::pair<double, int>> steps;  // area of three neighbouring steps, index of the middle one
  for (const auto& [step, area] : areas) {
    const auto at = [&](int i) { return areas.contains(i) ? areas.at(i) : 0.0; };
    steps.emplace_back(at(step - 1) + area + at(step + 1), step);
  }
  std::sort(steps.rbegin(), steps.rend());
  std::vector<double> heights;
  for (const auto& [area, step] : steps) {
    const double height = (step + 0.5) * kStep_m;
    if (area < 0.1 * total || heights.size() == kMost) break;
    if (std::all_of(heights.begin(), heights.end(),
                    [&](double other) { return std::abs(other - height) > 4 * kStep_m; }))
      heights.push_back(height);
  }
  return heights;
}

void gather(std::span<const SurfacePatch> level, const Vec3& up, double within_m, Level& plane) {
  const double height = plane.height;
  plane = Level();
  for (const SurfacePatch& patch : level)
    if (std::abs(patch.centre.dot(up) - height) < within_m) {
      plane.area += patch.area;
      plane.centre += patch.area * patch.centre;
    }
  if (plane.area <= 0) return;
  plane.centre /= plane.area;
  plane.height = plane.centre.dot(up);
  for (const SurfacePatch& patch : level)
    if (std::abs(patch.centre.dot(up) - height) < within_m) {
      const Vec3 arm = patch.centre - plane.centre;
      plane.scatter += patch.area * arm * arm.transpose();
    }
}

/// Flatness error of horizontal planes: standard deviation of their heights averaged over cells of 0.3 m, so
/// that noise of single patches has no effect.
double bending_m(std::span<const SurfacePatch> level, const std::vector<Level>& planes, const Vec3& up,
                 double within_m) {
  constexpr double kCell_m = 0.3;
  const Vec3 east = up.unitOrthogonal(), north = up.cross(east);
  double squares = 0, area = 0;
  for (const Level& plane : planes) {
    std::map<std::pair<double, double>, std::pair<double, double>> cells;  // area, area x height
    for (const SurfacePatch& patch : level) {
      const double height = patch.centre.dot(up) - plane.height;
      if (std::abs(height) >= within_m) continue;
      auto& cell = cells[{std::floor(patch.centre.dot(east) / kCell_m),
                          std::floor(patch.centre.dot(north) / kCell_m)}];
      cell.first += patch.area;
      cell.second += patch.area * height;
    }
    for (const auto& [at, cell] : cells) {
      squares += cell.second * cell.second / cell.first;
      area += cell.first;
    }
  }
  return area > 0 ? std::sqrt(squares / area) : 0;
}

/// A direction and the standard deviation of its tilt.
struct Direction {
  Vec3 direction;
  double sigma_rad;
};

/// Common normal of horizontal planes at several heights, estimated from their points: for a plane a metre
/// wide this is more accurate than its patches' normals, which depth cameras distort. The standard deviation
/// is the planes' flatness error divided by their width, which averaging does not reduce. Returns `up` if no
/// plane is wide in both directions.
Direction refined_by_positions(std::span<const SurfacePatch> patches, Vec3 up) {
  constexpr double kLeastWidth_m = 0.15;  // standard deviation in the narrow direction
  constexpr std::array<double, 8> kWithin_m{0.10, 0.08, 0.06, 0.05, 0.04, 0.04, 0.03, 0.03};
  std::vector<SurfacePatch> level;
  for (const SurfacePatch& patch : patches)
    if (std::abs(patch.normal.dot(up)) > std::cos(kClusterWindow_rad)) level.push_back(patch);
  std::vector<Level> planes;
  for (const double height : heights_of(level, up)) planes.emplace_back().height = height;
  const Direction start{up, kNormalSigma_rad};
  double width_m = 0;
  for (const double within_m : kWithin_m) {
    Mat3 sum = Mat3::Zero();
    double area = 0;
    for (Level& plane : planes) {
      gather(level, up, within_m, plane);
      sum += plane.scatter;
      area += plane.area;
    }
    if (area <= 0) return start;
    const Eigen3 axes = symmetric_eigen(Mat3(sum / area));
    if (axes.values[1] < kLeastWidth_m * kLeastWidth_m) return start;
    const Vec3 found = axes.vectors.col(0);
    up = found.dot(up) < 0 ? Vec3(-found) : found;
    for (Level& plane : planes) plane.height = plane.centre.dot(up);
    width_m = std::sqrt(axes.values[1]);
  }
  if (angle_between(up, start.direction) > 0.5 * kClusterWindow_rad) return start;
  return {up, std::max(kLeastSigma_rad, bending_m(level, planes, up, kWithin_m.back()) / width_m)};
}

/// Log likelihood of a camera being held with `up_camera` up, without the preference for landscape.
double held_like(const Vec3& up_camera, double roll_rad) {
  constexpr double kMost = 4.5, kRollSigma_rad = 12 * kRadiansPerDegree;
  constexpr double kUsualPitch_rad = 12 * kRadiansPerDegree, kPitchSigma_rad = 35 * kRadiansPerDegree;
  const double pitch_down = std::asin(std::clamp(-up_camera.z(), -1.0, 1.0));
  const double level = std::cos(pitch_down);  // looking straight down there is no roll
  const double roll =
      std::remainder(std::atan2(up_camera.x(), -up_camera.y()) - roll_rad, 2 * M_PI) / kRollSigma_rad * level;
  const double pitch = (pitch_down - kUsualPitch_rad) / kPitchSigma_rad;
  return -std::min(kMost, 0.5 * roll * roll) - std::min(kMost, 0.5 * pitch * pitch);
}

/// Log ratio of a carried camera's rotation about the vertical to its pitch motion, where `axis` of the
/// camera is horizontal: people pan more than they tilt.
double turned_like(std::span<const Mat3> R_world_camera, const Vec3& up, int axis) {
  constexpr double kStill_rad = 5 * kRadiansPerDegree, kMost = 0.9, kWeight = 0.6;
  const Vec3 east = up.unitOrthogonal(), north = up.cross(east);
  double cosine = 0, sine = 0, pitch = 0, pitch_squared = 0;
  const auto count = static_cast<double>(R_world_camera.size());
  for (const Mat3& R : R_world_camera) {
    const Vec3 across = R.col(axis);
    const double yaw = std::atan2(across.dot(north), across.dot(east));
    const double nod = std::asin(std::clamp(R.col(2).dot(up), -1.0, 1.0));
    cosine += std::cos(yaw) / count, sine += std::sin(yaw) / count;
    pitch += nod / count, pitch_squared += nod * nod / count;
  }
  const double yaw_spread = std::sqrt(-2 * std::log(std::clamp(std::hypot(cosine, sine), 1e-3, 1.0)));
  const double pitch_spread = std::sqrt(std::max(0.0, pitch_squared - pitch * pitch));
  return std::clamp(kWeight * std::log((yaw_spread + kStill_rad) / (pitch_spread + kStill_rad)), -kMost,
                    kMost);
}

double held(std::span<const Mat3> R_world_camera, const Vec3& up) {
  if (R_world_camera.empty()) return 0;
  struct Grip {
    double roll_rad, penalty;
    int horizontal_axis;
  };
  double best = -1e9;
  for (const Grip& grip : {Grip{0, 0, 0}, Grip{M_PI / 2, kPortraitPenalty, 1},
                           Grip{-M_PI / 2, kPortraitPenalty, 1}, Grip{M_PI, kUpsideDownPenalty, 0}}) {
    double sum = 0;
    for (const Mat3& R : R_world_camera) sum += held_like(R.transpose() * up, grip.roll_rad);
    best = std::max(best, sum / static_cast<double>(R_world_camera.size()) - grip.penalty +
                              turned_like(R_world_camera, up, grip.horizontal_axis));
  }
  return best;
}

UpEvidence evidence_for(const NormalHistogram& histogram, const Vec3& up) {
  UpEvidence evidence;
  evidence.up = up;
  const double cosine = std::cos(kEvidenceWindow_rad), sine = std::sin(kEvidenceWindow_rad);
  double vertical = 0;
  for (const auto& cell : histogram.cells()) {
    const double along = cell.normal.dot(up);
    if (along > cosine) evidence.facing_up += cell.share;
    if (along < -cosine) evidence.facing_down += cell.share;
    if (std::abs(along) < sine) vertical += cell.share;
  }
  // The share `sine` of randomly oriented surface is vertical.
  const double level = evidence.facing_up + evidence.facing_down;
  evidence.vertical = std::max(0.0, (vertical - sine * (1 - level)) / (1 - sine));
  return evidence;
}

void judge(std::vector<UpEvidence>& candidates, std::span<const Mat3> R_world_camera) {
  static constexpr double kSmall = 0.01;
  const auto levelled = [](const UpEvidence& e) { return e.facing_up + 0.5 * e.facing_down; };
  // Horizontal surface weighs more than vertical surface, which is frequent by chance.
  const auto explained = [](const UpEvidence& e) {
    return std::max(kSmall, 2 * (e.facing_up + e.facing_down) + e.vertical);
  };
  double most_explained = kSmall, most_level = 0;
  for (const UpEvidence& e : candidates) {
    most_explained = std::max(most_explained, explained(e));
    most_level = std::max(most_level, levelled(e));
  }
  for (UpEvidence& e : candidates) {
    e.held = held(R_world_camera, e.up);
    e.score = 2 * std::log(explained(e) / most_explained) +
              0.25 * std::log((levelled(e) + kSmall) / (most_level + kSmall)) +
              0.5 * (e.facing_up - e.facing_down) / (e.facing_up + e.facing_down + 10 * kSmall) + e.held;
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const UpEvidence& a, const UpEvidence& b) { return a.score > b.score; });
}

/// True for horizontal surfaces at two heights, e.g. a floor and a table.
bool has_two_levels(std::span<const SurfacePatch> patches, const Vec3& up) {
  constexpr double kApart_m = 0.12, kShare = 0.03;
  std::vector<std::pair<double, double>> heights;  // height and area
  double total = 0;
  for (const SurfacePatch& patch : patches) {
    total += patch.area;
    if (std::abs(patch.normal.dot(up)) > std::cos(kEvidenceWindow_rad))
      heights.emplace_back(patch.centre.dot(up), patch.area);
  }
  std::sort(heights.begin(), heights.end());
  const auto height_at = [&](auto begin, auto end) -> std::optional<double> {
    double sum = 0;
    for (auto at = begin; at != end; ++at)
      if ((sum += at->second) > kShare * total) return at->first;
    return std::nullopt;
  };
  const auto low = height_at(heights.begin(), heights.end()),
             high = height_at(heights.rbegin(), heights.rend());
  return low && high && *high - *low > kApart_m;
}

/// True if walls face in different directions, so that they alone determine up.
bool has_walls_at_an_angle(const NormalHistogram& histogram, const Vec3& up) {
  constexpr double kShare = 0.05;
  double total = 0;
  Mat3 sum = Mat3::Zero();
  for (const auto& cell : histogram.cells())
    if (std::abs(cell.normal.dot(up)) < std::sin(kEvidenceWindow_rad)) {
      sum += cell.share * cell.normal * cell.normal.transpose();
      total += cell.share;
    }
  // The second eigenvalue is the area of walls across the most frequent direction.
  return total > 2 * kShare && symmetric_eigenvalues(sum)[1] > kShare;
}

bool is_supported(const UpEvidence& evidence, std::span<const SurfacePatch> patches,
                  const NormalHistogram& histogram) {
  if (evidence.facing_up + evidence.facing_down > kLeastLevel_share)
    return evidence.vertical > kLeastVertical_share || has_two_levels(patches, evidence.up);
  return evidence.vertical > 2 * kLeastVertical_share && has_walls_at_an_angle(histogram, evidence.up);
}

void add_candidate(std::vector<UpEvidence>& candidates, std::span<const SurfacePatch> patches,
                   const NormalHistogram& histogram, const Vec3& start) {
  const auto rough = refined(patches, start);
  if (!rough) return;
  const auto [up, sigma_rad] = refined_by_positions(patches, *rough);
  for (const UpEvidence& e : candidates)
    if (angle_between(e.up, up) < kSameDirection_rad) return;
  candidates.push_back(evidence_for(histogram, up));
  candidates.back().sigma_rad = sigma_rad;
}

std::vector<Vec3> starts_of(const std::vector<Vec3>& clusters) {
  std::vector<Vec3> starts = clusters;
  for (std::size_t i = 0; i < clusters.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (const Vec3 across = clusters[i].cross(clusters[j]); across.norm() > 0.7)
        starts.push_back(across.normalized());
  const std::size_t count = starts.size();
  for (std::size_t i = 0; i < count; ++i) starts.push_back(-starts[i]);
  return starts;
}

Vec3 mean_upward(std::span<const Mat3> R_world_camera) {
  Vec3 sum = Vec3::Zero();
  for (const Mat3& R : R_world_camera) sum -= R.col(1);
  return sum.norm() > 1e-3 * static_cast<double>(R_world_camera.size() + 1) ? Vec3(sum.normalized())
                                                                            : Vec3::UnitZ();
}

}  // namespace

std::vector<SurfacePatch> patches_of(const TriangleMesh& mesh, std::size_t most) {
  std::vector<SurfacePatch> patches;
  const std::size_t step = std::max<std::size_t>(1, mesh.triangles.size() / std::max<std::size_t>(most, 1));
  for (std::size_t i = 0; i < mesh.triangles.size(); i += step) {
    const auto& t = mesh.triangles[i];
    if (std::max({t[0], t[1], t[2]}) >= mesh.vertices.size()) continue;
    const Vec3 a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
               c = mesh.vertices[t[2]].cast<double>();
    const Vec3 cross = (b - a).cross(c - a);
    const double doubled = cross.norm();
    if (doubled > 0 && doubled < 1e9) patches.push_back({(a + b + c) / 3, cross / doubled, 0.5 * doubled});
  }
  return patches;
}

std::vector<Mat3> rotations_of(const Trajectory& T_world_camera) {
  std::vector<Mat3> rotations;
  for (const StampedPose& pose : T_world_camera) rotations.push_back(pose.T_world_base.rotation());
  return thinned(std::move(rotations), 500);
}

std::vector<UpEvidence> scene_up_candidates(std::span<const SurfacePatch> patches,
                                            std::span<const Mat3> R_world_camera) {
  const NormalHistogram histogram(patches);
  std::vector<UpEvidence> candidates;
  for (const Vec3& start : starts_of(clusters_of(histogram)))
    add_candidate(candidates, patches, histogram, start);
  judge(candidates, R_world_camera);
  return candidates;
}

UpDirection find_scene_up(std::span<const SurfacePatch> patches, std::span<const Mat3> R_world_camera) {
  UpDirection answer{mean_upward(R_world_camera), UpSource::kUnknown, M_PI / 4};
  const std::vector<UpEvidence> candidates = scene_up_candidates(patches, R_world_camera);
  if (candidates.empty()) return answer;
  const UpEvidence& best = candidates.front();
  const bool clear = candidates.size() < 2 || best.score - candidates[1].score > kClearMargin;
  const bool held_well = best.held > -2;
  if (clear && held_well && is_supported(best, patches, NormalHistogram(patches)))
    return {best.up, UpSource::kFloorAndWalls, best.sigma_rad};
  return answer;
}

UpDirection refine_gravity(const UpDirection& gravity, std::span<const SurfacePatch> patches) {
  std::vector<UpEvidence> near;
  for (const UpEvidence& e : scene_up_candidates(patches, {}))
    if (angle_between(e.up, gravity.up) < 3 * gravity.sigma_rad) near.push_back(e);
  for (UpEvidence& e : near)
    e.score -= 0.5 * std::pow(angle_between(e.up, gravity.up) / gravity.sigma_rad, 2);
  std::sort(near.begin(), near.end(),
            [](const UpEvidence& a, const UpEvidence& b) { return a.score > b.score; });
  const bool clear = near.size() == 1 || (near.size() > 1 && near[0].score - near[1].score > kClearMargin);
  if (!clear) return gravity;
  const UpEvidence& best = near.front();
  if (best.facing_up + best.facing_down < kLeastLevel_share &&
      !has_walls_at_an_angle(NormalHistogram(patches), best.up))
    return gravity;
  const double of_gravity = std::pow(gravity.sigma_rad, -2), of_surfaces = std::pow(best.sigma_rad, -2);
  return {(of_gravity * gravity.up + of_surfaces * best.up).normalized(), UpSource::kGravityAndLevels,
          1 / std::sqrt(of_gravity + of_surfaces)};
}

}  // namespace hm
