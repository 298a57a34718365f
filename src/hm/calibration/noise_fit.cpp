// hm: compiled alone, as it takes as long as a unit of many files
#include "hm/calibration/noise_fit.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "hm/geometry/solvers/small_solvers.hpp"

namespace hm {
namespace {

constexpr int kFewestReadings = 5;   // of a pixel, for its temporal standard deviation
constexpr double kEdgeRatio = 0.03;  // neighbours that differ by more lie across a depth edge
constexpr int kBlock_px = 8;         // plane: blocks in which a smooth bias is constant

/// True when a pixel and its neighbours lie on one surface.
bool on_surface(const DepthAverage& average, int x, int y) {
  const double z = average.mean_m(x, y);
  for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
    const double other = average.mean_m(x + dx, y + dy);
    if (other == 0 || std::abs(other - z) > kEdgeRatio * z) return false;
  }
  return true;
}

/// Sum of squared residuals of 1/z over a plane (1/z is linear in the pixel), as variance of z.
struct BlockFit {
  double depth_m = 0, variance_m2 = 0;
  int readings = 0;
};

std::optional<BlockFit> fit_block(const DepthImage& depth, int x0, int y0) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Vec3 right = Vec3::Zero();
  double sum = 0;
  int count = 0;
  for (int y = y0; y < y0 + kBlock_px; ++y)
    for (int x = x0; x < x0 + kBlock_px; ++x) {
      const double z = depth.depth_m(x, y);
      if (z <= 0) return std::nullopt;  // an edge, or out of range: deviations would be cut
      const Vec3 row(1, x - x0, y - y0);
      normal += row * row.transpose();
      right += row / z;
      sum += z;
      ++count;
    }
  const Vec3 plane = solve_symmetric_3(normal, right);
  const double mean = sum / count;
  double squares = 0;
  for (int y = 0; y < kBlock_px; ++y)
    for (int x = 0; x < kBlock_px; ++x) {
      const double fitted = 1 / plane.dot(Vec3(1, x, y));
      const double residual = depth.depth_m(x0 + x, y0 + y) - fitted;
      if (!(std::abs(residual) < 0.05 * mean)) return std::nullopt;  // a step
      squares += residual * residual;
    }
  return BlockFit{mean, squares / (count - 3), count};
}

}  // namespace

NoiseHistogram::NoiseHistogram(const NoiseFitParams& params) : params_(params) {
  bins_.resize(static_cast<std::size_t>(std::ceil(params.max_depth_m / params.kBin_m)) + 1);
}

void NoiseHistogram::add(double depth_m, double variance_m2, double weight) {
  if (!(depth_m >= params_.min_depth_m && depth_m <= params_.max_depth_m) || !(variance_m2 >= 0)) return;
  Bin& bin = bins_[static_cast<std::size_t>(depth_m / params_.kBin_m)];
  bin.depth_sum += weight * depth_m;
  bin.variance_sum += weight * variance_m2;
  bin.weight += weight;
}

void NoiseHistogram::add_static(const DepthAverage& average) {
  for (int y = 1; y + 1 < average.height(); ++y)
    for (int x = 1; x + 1 < average.width(); ++x) {
      const int readings = average.count(x, y);
      if (readings < kFewestReadings || !on_surface(average, x, y)) continue;
      const double sigma = average.sigma_m(x, y);
      add(average.mean_m(x, y), sigma * sigma, readings - 1);
    }
}

void NoiseHistogram::add_plane(const DepthImage& depth) {
  for (int y = 0; y + kBlock_px <= depth.height(); y += kBlock_px)
    for (int x = 0; x + kBlock_px <= depth.width(); x += kBlock_px)
      if (const auto block = fit_block(depth, x, y))
        add(block->depth_m, block->variance_m2, block->readings - 3);
}

std::vector<NoiseSample> NoiseHistogram::samples() const {
  std::vector<NoiseSample> samples;
  for (const Bin& bin : bins_)
    if (bin.weight >= params_.min_readings && bin.variance_sum > 0)
      samples.push_back({bin.depth_sum / bin.weight, std::sqrt(bin.variance_sum / bin.weight), bin.weight});
  return samples;
}

Result<NoiseFit> fit_noise(std::span<const NoiseSample> samples) {
  if (samples.size() < 3)
    return fail(ErrorCode::kInvalidValue, "",
                "deviations at {} distances are too few: three are needed, over the whole range wanted",
                samples.size());
  // Minimises relative errors over all subsets of {z^2, z, 1} and takes the best allowed solution.
  std::optional<NoiseFit> best;
  for (unsigned terms = 1; terms < 8; ++terms) {
    std::vector<int> used;
    for (int k = 0; k < 3; ++k)
      if ((terms >> static_cast<unsigned>(k) & 1u) != 0) used.push_back(k);
    const auto columns = static_cast<Eigen::Index>(used.size());
    Eigen::MatrixXd rows(static_cast<Eigen::Index>(samples.size()), columns);
    for (std::size_t i = 0; i < samples.size(); ++i)
      for (Eigen::Index c = 0; c < columns; ++c)
        rows(static_cast<Eigen::Index>(i), c) =
            std::pow(samples[i].depth_m, used[static_cast<std::size_t>(c)]) / samples[i].sigma_m;
    const Eigen::VectorXd solution = rows.colPivHouseholderQr().solve(Eigen::VectorXd::Ones(rows.rows()));
    std::array<double, 3> c{};
    for (std::size_t k = 0; k < used.size(); ++k)
      c[static_cast<std::size_t>(used[k])] = solution[static_cast<Eigen::Index>(k)];
    if (!(c[0] >= 0 && c[0] <= 1 && std::abs(c[1]) <= 1 && c[2] >= 0 && c[2] <= 1)) continue;
    const double rms = std::sqrt((rows * solution - Eigen::VectorXd::Ones(rows.rows())).squaredNorm() /
                                 static_cast<double>(samples.size()));
    if (!best || rms < best->rms_relative) best = NoiseFit{{c[2], c[1], c[0]}, rms};
  }
  if (!best)
    return fail(ErrorCode::kInvalidValue, "", "the deviations do not grow like those of a depth sensor");
  return *best;
}

}  // namespace hm
