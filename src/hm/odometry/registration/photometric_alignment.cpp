#include "hm/odometry/registration/photometric_alignment.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace hm {
namespace {

using PhotometricVec6 = Eigen::Matrix<float, 6, 1>;
using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;
constexpr int kGridLevel = 2;      // where a pixel is a cell of the depth grid
constexpr int kMinWidth_px = 120;  // of the finest level used; smaller images have lost their texture
constexpr float kMinGradient = 4.0f;
constexpr int kCoarseIterations = 8;
constexpr double kMinOverlapRatio = 0.25;
constexpr double kTurnStep_px = 3, kMaxTurn_rad = 0.2;  // of the search for turns, finest level
constexpr double kMinSearchOverlapRatio = 0.4;
constexpr std::size_t kTurnsKept = 6;
constexpr double kLeastCorrelated = 60;  // pixels
constexpr double kClearlyBetter = 0.85;  // relative to the result from the guesses

/// Depth of a pixel of a level: of the central cell under it, or the first neighbouring cell with a depth.
float depth_of(const Image<float>& cells, int x, int y, int shift) {
  if (shift <= 0) return cells.contains(x >> -shift, y >> -shift) ? cells(x >> -shift, y >> -shift) : 0;
  const int side = 1 << shift;
  const int x0 = x * side + side / 2 - 1, y0 = y * side + side / 2 - 1;
  for (int dy = 0; dy < 2; ++dy)
    for (int dx = 0; dx < 2; ++dx)
      if (cells.contains(x0 + dx, y0 + dy) && cells(x0 + dx, y0 + dy) > 0) return cells(x0 + dx, y0 + dy);
  return 0;
}

PhotometricReference::Pixel make_pixel(const PinholeCamera& camera, const Vec2& pixel, float z,
                                       const Eigen::Vector3f& intensity_and_gradient) {
  const Eigen::Vector3f p = camera.unproject(pixel, static_cast<double>(z)).cast<float>();
  const float ax = intensity_and_gradient.y() * static_cast<float>(camera.fx) / z;
  const float ay = intensity_and_gradient.z() * static_cast<float>(camera.fy) / z;
  const Eigen::Vector3f by_point(ax, ay, -(ax * p.x() + ay * p.y()) / z);
  PhotometricReference::Pixel out{p, intensity_and_gradient.x(), {}};
  out.jacobian.head<3>() = by_point;  // of exp(step) p = p + translation + rotation x p
  out.jacobian.tail<3>() = p.cross(by_point);
  return out;
}

PhotometricReference::Level make_level(const Image<std::uint8_t>& image, const DepthGrid& grid, int level,
                                       std::size_t max_pixels) {
  PhotometricReference::Level out;
  out.level = level;
  out.camera = grid.camera.scaled(std::pow(0.5, level - kGridLevel));
  for (int y = 1; y + 1 < image.height(); ++y)
    for (int x = 1; x + 1 < image.width(); ++x) {
      const float gx = 0.5f * static_cast<float>(image(x + 1, y) - image(x - 1, y));
      const float gy = 0.5f * static_cast<float>(image(x, y + 1) - image(x, y - 1));
      if (gx * gx + gy * gy < kMinGradient * kMinGradient) continue;
      const float z = depth_of(grid.depth_m, x, y, level - kGridLevel);
      if (z > 0)
        out.pixels.push_back(
            make_pixel(out.camera, Vec2(x, y), z, {static_cast<float>(image(x, y)), gx, gy}));
    }
  if (out.pixels.size() > max_pixels) {  // evenly, in order
    for (std::size_t i = 0; i < max_pixels; ++i)
      out.pixels[i] = out.pixels[i * out.pixels.size() / max_pixels];
    out.pixels.resize(max_pixels);
  }
  return out;
}

/// Intensity differences for a motion; NaN where the pixel is not visible.
struct Differences {
  std::vector<float> values;
  double mean_abs = 255, overlap_ratio = 0;
};

Differences differences_at(const PhotometricReference::Level& level, const Image<std::uint8_t>& image,
                           const SE3& T_cur_ref) {
  Differences out;
  out.values.assign(level.pixels.size(), std::nanf(""));
  const Eigen::Matrix3f rotation = T_cur_ref.rotation().cast<float>();
  const Eigen::Vector3f translation = T_cur_ref.translation().cast<float>();
  const float fx = static_cast<float>(level.camera.fx), fy = static_cast<float>(level.camera.fy);
  const float cx = static_cast<float>(level.camera.cx), cy = static_cast<float>(level.camera.cy);
  const float right = static_cast<float>(image.width() - 1), bottom = static_cast<float>(image.height() - 1);
  double sum = 0;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < level.pixels.size(); ++i) {
    const Eigen::Vector3f p = rotation * level.pixels[i].p_camera + translation;
    if (p.z() < 0.05f) continue;
    const float u = fx * p.x() / p.z() + cx, v = fy * p.y() / p.z() + cy;
    if (!(u >= 0 && v >= 0 && u < right && v < bottom)) continue;
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    const float a = u - static_cast<float>(x), b = v - static_cast<float>(y);
    const std::uint8_t* top = &image(x, y);
    const std::uint8_t* low = top + image.width();
    const float value = (1 - b) * ((1 - a) * static_cast<float>(top[0]) + a * static_cast<float>(top[1])) +
                        b * ((1 - a) * static_cast<float>(low[0]) + a * static_cast<float>(low[1]));
    out.values[i] = value - level.pixels[i].intensity;
    sum += static_cast<double>(std::min(std::abs(out.values[i]), 60.0f));
    ++seen;
  }
  if (seen > 0) out.mean_abs = sum / static_cast<double>(seen);
  if (!level.pixels.empty())
    out.overlap_ratio = static_cast<double>(seen) / static_cast<double>(level.pixels.size());
  return out;
}

/// Step of the reference's points (and of the brightness) that minimises the differences.
std::optional<Vec6> solve_step(const PhotometricReference::Level& level, const Differences& differences) {
  Mat7 normal = Mat7::Zero();
  Vec7 rhs = Vec7::Zero();
  const float huber = std::max(3.0f, 1.5f * static_cast<float>(differences.mean_abs));
  Eigen::Matrix<float, 7, 7> block = Eigen::Matrix<float, 7, 7>::Zero();
  Eigen::Matrix<float, 7, 1> block_rhs = Eigen::Matrix<float, 7, 1>::Zero();
  for (std::size_t i = 0; i < level.pixels.size(); ++i) {
    const float r = differences.values[i];
    if (r == r) {
      const float weight = std::abs(r) <= huber ? 1.0f : huber / std::abs(r);
      Eigen::Matrix<float, 7, 1> j;
      j << level.pixels[i].jacobian, 1.0f;
      const Eigen::Matrix<float, 7, 1> wj = weight * j;
      for (int column = 0; column < 7; ++column) block.col(column).noalias() += wj * j[column];
      block_rhs.noalias() += wj * r;
    }
    if (i % 256 == 255 || i + 1 == level.pixels.size()) {
      normal += block.cast<double>();
      rhs += block_rhs.cast<double>();
      block.setZero();
      block_rhs.setZero();
    }
  }
  for (int i = 0; i < 6; ++i) normal(i, i) += 1e-4 * normal(i, i) + 1.0;
  const Eigen::LDLT<Mat7> solver(normal);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const Vec7 step = solver.solve(rhs);
  if (!step.allFinite() || step.head<6>().norm() > 1.0) return std::nullopt;
  return step.head<6>();
}

SE3 align_level(const PhotometricReference::Level& level, const Image<std::uint8_t>& image, SE3 T_ref_cur) {
  SE3 best = T_ref_cur;
  double best_residual = 1e9;
  for (int iteration = 0; iteration <= kCoarseIterations; ++iteration) {
    const Differences differences = differences_at(level, image, T_ref_cur.inverse());
    if (differences.overlap_ratio < kMinOverlapRatio || differences.mean_abs > best_residual * 1.02) break;
    if (differences.mean_abs < best_residual) {
      best_residual = differences.mean_abs;
      best = T_ref_cur;
    }
    const auto step = iteration < kCoarseIterations ? solve_step(level, differences) : std::nullopt;
    if (!step) break;
    T_ref_cur = SE3::exp(*step) * T_ref_cur;
    // A tenth of a pixel of the level, for distant points.
    if (step->tail<3>().norm() * level.camera.fx < 0.1 && step->head<3>().norm() * level.camera.fx < 0.1) {
      best = T_ref_cur;
      break;
    }
  }
  return best;
}

SE3 best_start(const PhotometricReference::Level& level, const Image<std::uint8_t>& image,
               const std::vector<SE3>& starts_T_ref_cur) {
  SE3 best = starts_T_ref_cur.back();
  double least = 1e9;
  for (const SE3& start : starts_T_ref_cur) {
    const Differences differences = differences_at(level, image, start.inverse());
    if (differences.overlap_ratio < kMinOverlapRatio || differences.mean_abs >= least) continue;
    least = differences.mean_abs;
    best = start;
  }
  return best;
}

}  // namespace

PhotometricReference::PhotometricReference(const ImagePyramid& pyramid, const DepthGrid& grid,
                                           const PinholeCamera& camera, std::size_t max_pixels) {
  HM_CHECK(camera.width / DepthGrid::kCell_px == grid.camera.width, "{} {}", camera.width, grid.camera.width);
  int finest = kGridLevel;
  while (finest > 0 && pyramid.level(finest).width() < kMinWidth_px) --finest;
  for (int level = pyramid.levels() - 1; level >= finest; --level)
    levels_.push_back(make_level(pyramid.level(level), grid, level, max_pixels));
}

std::size_t PhotometricReference::memory_bytes() const {
  std::size_t bytes = levels_.capacity() * sizeof(Level);
  for (const Level& level : levels_) bytes += level.pixels.capacity() * sizeof(Pixel);
  return bytes;
}

PhotometricResult align_photometrically(const PhotometricReference& reference, const ImagePyramid& current,
                                        const std::vector<SE3>& guesses_T_ref_cur) {
  HM_CHECK(!guesses_T_ref_cur.empty(), "no guess");
  PhotometricResult result{guesses_T_ref_cur.front()};
  if (reference.levels().empty()) return result;
  // A coarse level may be wrong for fine texture: every level starts from the best of all results so far.
  std::vector<SE3> starts = guesses_T_ref_cur;
  for (const auto& level : reference.levels()) {
    const auto& image = current.level(level.level);
    result.T_ref_cur = align_level(level, image, best_start(level, image, starts));
    starts.push_back(result.T_ref_cur);
  }
  const auto& finest = reference.levels().back();
  const Differences left = differences_at(finest, current.level(finest.level), result.T_ref_cur.inverse());
  result.residual = left.mean_abs;
  result.overlap_ratio = left.overlap_ratio;
  return result;
}

std::optional<double> picture_correlation(const PhotometricReference& reference, const ImagePyramid& current,
                                          const SE3& T_ref_cur) {
  if (reference.levels().size() < 2) return std::nullopt;
  const auto& level = *(reference.levels().end() - 2);
  const Differences differences = differences_at(level, current.level(level.level), T_ref_cur.inverse());
  double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;
  for (std::size_t i = 0; i < level.pixels.size(); ++i) {
    if (std::isnan(differences.values[i])) continue;
    const double there = level.pixels[i].intensity, here = there + differences.values[i];
    n += 1, a += there, b += here, aa += there * there, bb += here * here, ab += there * here;
  }
  if (n < kLeastCorrelated || differences.overlap_ratio < kMinOverlapRatio) return std::nullopt;
  const double variances = (aa - a * a / n) * (bb - b * b / n);
  return variances > 0 ? (ab - a * b / n) / std::sqrt(variances) : 0;
}

PhotometricResult search_turns(const PhotometricReference& reference, const ImagePyramid& current,
                               const PhotometricResult& result, const std::vector<SE3>& guesses_T_ref_cur) {
  if (reference.levels().empty()) return result;
  const auto& level = reference.levels().back();
  const auto& image = current.level(level.level);
  const double step_rad = kTurnStep_px / level.camera.fx;
  const int steps = static_cast<int>(kMaxTurn_rad / step_rad);
  std::vector<std::pair<double, SE3>> starts;
  for (const SE3& guess : guesses_T_ref_cur)
    for (int yaw = -steps; yaw <= steps; ++yaw)
      for (int pitch = -steps / 2; pitch <= steps / 2; ++pitch) {
        const SE3 turned = guess * SE3(so3_exp(Vec3(pitch * step_rad, yaw * step_rad, 0)), Vec3::Zero());
        const Differences differences = differences_at(level, image, turned.inverse());
        if (differences.overlap_ratio >= kMinSearchOverlapRatio)
          starts.emplace_back(differences.mean_abs, turned);
      }
  const std::size_t kept = std::min(kTurnsKept, starts.size());
  std::partial_sort(starts.begin(), starts.begin() + static_cast<std::ptrdiff_t>(kept), starts.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  PhotometricResult best = result;
  for (std::size_t i = 0; i < kept; ++i) {
    const SE3 T_ref_cur = align_level(level, image, starts[i].second);
    const Differences left = differences_at(level, image, T_ref_cur.inverse());
    if (left.overlap_ratio >= kMinSearchOverlapRatio &&
        left.mean_abs < std::min(best.residual, kClearlyBetter * result.residual))
      best = {T_ref_cur, left.mean_abs, left.overlap_ratio};
  }
  return best;
}

}  // namespace hm
