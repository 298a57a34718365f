#include "hm/calibration/spline_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "hm/core/statistics.hpp"
#include "hm/depth_camera/spline_basis.hpp"
#include "hm/geometry/solvers/large_solvers.hpp"

namespace hm::detail {
namespace {

constexpr int kBlock_px = 4;                    // readings of a view are averaged over such squares
constexpr double kReferenceRatio = 5e-4;        // error of the board's plane, by distance
constexpr double kAssumedNoise_per_m = 1.5e-3;  // sigma = this z^2, when there is only a single image
constexpr double kLargestCorrection_m = 0.3;    // weak prior on every coefficient
constexpr int kRobustRounds = 3;

/// Row of the linear system: control points that influence a position.
struct Row {
  std::vector<std::pair<Eigen::Index, double>> entries;
};

class System {
 public:
  System(const DepthCorrectionModel& model, const DepthFitParams& params) : model_(model), params_(params) {
    const auto size = static_cast<Eigen::Index>(model.columns) * model.rows * model.terms;
    information_ = Eigen::MatrixXd::Zero(size, size);
    right_ = Eigen::VectorXd::Zero(size);
    add_priors();
  }
  [[nodiscard]] Row row_of(const BlockMean& mean) const;
  void add(const Row& row, double value, double weight);
  [[nodiscard]] Eigen::VectorXd solve() const { return symmetric_solution(information_, right_).x; }

 private:
  [[nodiscard]] Eigen::Index index(int term, int row, int column) const {
    return (static_cast<Eigen::Index>(term) * model_.rows + row) * model_.columns + column;
  }
  void add_priors();

  const DepthCorrectionModel& model_;
  const DepthFitParams& params_;
  Eigen::MatrixXd information_;
  Eigen::VectorXd right_;
};

Row System::row_of(const BlockMean& mean) const {
  const double s = std::clamp((2 * mean.measured_m - model_.min_depth_m - model_.max_depth_m) /
                                  (model_.max_depth_m - model_.min_depth_m),
                              -1.0, 1.0);
  const SplinePlace u = spline_place(mean.pixel.x(), model_.width, model_.columns);
  const SplinePlace v = spline_place(mean.pixel.y(), model_.height, model_.rows);
  const auto across = spline_weights(u.t), down = spline_weights(v.t);
  Row result;
  double power = 1;
  for (int k = 0; k < model_.terms; ++k, power *= s)
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < 4; ++i)
        result.entries.emplace_back(
            index(k, v.span + j, u.span + i),
            power * across[static_cast<std::size_t>(i)] * down[static_cast<std::size_t>(j)]);
  return result;
}

void System::add(const Row& row, double value, double weight) {
  for (const auto& [a, weight_a] : row.entries) {
    right_[a] += weight * weight_a * value;
    for (const auto& [b, weight_b] : row.entries)
      if (b <= a) information_(a, b) += weight * weight_a * weight_b;
  }
}

/// Priors: neighbouring control points lie nearly on a line, along rows and columns; all are within some
/// centimetres.
void System::add_priors() {
  const double smooth = 1 / (params_.smoothness_m * params_.smoothness_m);
  const auto straight = [&](Eigen::Index a, Eigen::Index b, Eigen::Index c) {
    add({{{a, 1.0}, {b, -2.0}, {c, 1.0}}}, 0, smooth);
  };
  for (int k = 0; k < model_.terms; ++k)
    for (int j = 0; j < model_.rows; ++j)
      for (int i = 0; i < model_.columns; ++i) {
        add({{{index(k, j, i), 1.0}}}, 0, 1 / (kLargestCorrection_m * kLargestCorrection_m));
        if (i + 2 < model_.columns) straight(index(k, j, i), index(k, j, i + 1), index(k, j, i + 2));
        if (j + 2 < model_.rows) straight(index(k, j, i), index(k, j + 1, i), index(k, j + 2, i));
      }
}

double dot(const Row& row, const Eigen::VectorXd& solution) {
  double sum = 0;
  for (const auto& [i, weight] : row.entries) sum += weight * solution[i];
  return sum;
}

}  // namespace

std::vector<BlockMean> block_means(const DepthView& view, int block_px) {
  struct Sum {
    double x = 0, y = 0, measured = 0, error = 0, variance = 0;
    int count = 0;
  };
  std::map<std::pair<int, int>, Sum> sums;
  for (const DepthSample& sample : view.samples) {
    Sum& sum = sums[{sample.y / block_px, sample.x / block_px}];
    const auto measured = static_cast<double>(sample.measured_m), truth = static_cast<double>(sample.true_m);
    const double sigma =
        sample.sigma_m > 0 ? static_cast<double>(sample.sigma_m) : kAssumedNoise_per_m * truth * truth;
    sum.x += sample.x, sum.y += sample.y;
    sum.measured += measured;
    sum.error += truth - measured;
    sum.variance += sigma * sigma;
    ++sum.count;
  }
  std::vector<BlockMean> means;
  for (const auto& [place, sum] : sums) {
    const double n = sum.count, z = sum.measured / n;
    const double reference = kReferenceRatio * z;
    means.push_back({Vec2(sum.x / n, sum.y / n), z, sum.error / n,
                     std::sqrt(sum.variance / (n * n) + reference * reference)});
  }
  return means;
}

TrainedRange trained_range(std::span<const DepthView> views) {
  std::vector<double> depths;
  for (const DepthView& view : views)
    for (std::size_t i = 0; i < view.samples.size(); i += 7)
      depths.push_back(static_cast<double>(view.samples[i].measured_m));
  return {quantile(depths, 0.001), quantile(depths, 0.999)};
}

DepthFit fit_spline(std::span<const DepthView> views, DepthCorrectionModel model,
                    const DepthFitParams& params) {
  model.columns = params.columns, model.rows = params.rows;
  model.terms = params.degree + 1;
  DepthFit fit;
  std::vector<BlockMean> means;
  for (const DepthView& view : views) {
    fit.samples += view.samples.size();
    const auto of_view = block_means(view, kBlock_px);
    means.insert(means.end(), of_view.begin(), of_view.end());
  }
  const System priors(model, params);
  std::vector<Row> rows;
  for (const BlockMean& mean : means) rows.push_back(priors.row_of(mean));
  std::vector<double> trust(means.size(), 1.0);
  Eigen::VectorXd solution;
  for (int round = 0; round < kRobustRounds; ++round) {
    System system = priors;
    for (std::size_t i = 0; i < means.size(); ++i)
      system.add(rows[i], means[i].error_m, trust[i] / (means[i].sigma_m * means[i].sigma_m));
    solution = system.solve();
    // Huber weights: outliers (a hand in front of the board, an edge) count less in the next round.
    std::vector<double> off(means.size());
    for (std::size_t i = 0; i < means.size(); ++i)
      off[i] = std::abs(means[i].error_m - dot(rows[i], solution)) / means[i].sigma_m;
    const double limit = 3 * std::max(1.0, quantile(off, 0.5) / 0.6745);
    for (std::size_t i = 0; i < means.size(); ++i) trust[i] = off[i] > limit ? limit / off[i] : 1.0;
  }
  model.coefficients.assign(static_cast<std::size_t>(solution.size()), 0.0F);
  for (Eigen::Index i = 0; i < solution.size(); ++i)
    model.coefficients[static_cast<std::size_t>(i)] = static_cast<float>(solution[i]);
  std::vector<char> touched(static_cast<std::size_t>((model.columns - 3) * (model.rows - 3)), 0);
  for (const BlockMean& mean : means) {
    const int x = spline_place(mean.pixel.x(), model.width, model.columns).span;
    const int y = spline_place(mean.pixel.y(), model.height, model.rows).span;
    touched[static_cast<std::size_t>(y * (model.columns - 3) + x)] = 1;
  }
  fit.fitted_pixel_ratio =
      static_cast<double>(std::ranges::count(touched, 1)) / static_cast<double>(touched.size());
  fit.model = std::move(model);
  return fit;
}

}  // namespace hm::detail
