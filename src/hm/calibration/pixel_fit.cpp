#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "hm/calibration/spline_fit.hpp"

namespace hm::detail {
namespace {

constexpr int kFewestSamples = 3;
constexpr double kIdentityPrior = 1e-6;  // regularises pixels observed at one depth only towards the identity

/// Sums over samples for the normal equations of a pixel.
struct Moments {
  std::array<double, 5> d{};   ///< of d^k
  std::array<double, 3> zd{};  ///< of z d^k
  double ratio = 0;            ///< of z / d
  void operator+=(const Moments& o) {
    for (std::size_t k = 0; k < 5; ++k) d[k] += o.d[k];
    for (std::size_t k = 0; k < 3; ++k) zd[k] += o.zd[k];
    ratio += o.ratio;
  }
};

/// True depth of a reading d: c0 + c1 d + c2 d^2.
using Polynomial = std::array<double, 3>;

Polynomial solve(DepthFitMode mode, const Moments& m) {
  const double prior = kIdentityPrior * m.d[0];
  switch (mode) {
    case DepthFitMode::kLinearZero:
      return {0, (m.zd[1] + prior) / (m.d[2] + prior), 0};
    case DepthFitMode::kQuadraticZero: {  // z / d = c1 + c2 d
      Eigen::Matrix2d a;
      a << m.d[0] + prior, m.d[1], m.d[1], m.d[2] + prior;
      const Vec2 c = a.ldlt().solve(Vec2(m.ratio + prior, m.zd[0]));
      return {0, c[0], c[1]};
    }
    case DepthFitMode::kLinear: {
      Eigen::Matrix2d a;
      a << m.d[0] + prior, m.d[1], m.d[1], m.d[2] + prior;
      const Vec2 c = a.ldlt().solve(Vec2(m.zd[0], m.zd[1] + prior));
      return {c[0], c[1], 0};
    }
    default: {
      Mat3 a;
      a << m.d[0], m.d[1], m.d[2], m.d[1], m.d[2], m.d[3], m.d[2], m.d[3], m.d[4];
      a += prior * Mat3::Identity();
      const Vec3 c = a.ldlt().solve(Vec3(m.zd[0], m.zd[1] + prior, m.zd[2]));
      return {c[0], c[1], c[2]};
    }
  }
}

struct PixelSums {
  Image<Moments> moments;
  Image<float> nearest_m, farthest_m;
};

PixelSums sum_up(std::span<const DepthView> views, int width, int height) {
  PixelSums sums{Image<Moments>(width, height), Image<float>(width, height, 1e9F),
                 Image<float>(width, height, 0.0F)};
  for (const DepthView& view : views)
    for (const DepthSample& sample : view.samples) {
      const auto d = static_cast<double>(sample.measured_m), z = static_cast<double>(sample.true_m);
      Moments& m = sums.moments(sample.x, sample.y);
      double power = 1;
      for (std::size_t k = 0; k < 5; ++k, power *= d) {
        m.d[k] += power;
        if (k < 3) m.zd[k] += z * power;
      }
      m.ratio += z / d;
      float& nearest = sums.nearest_m(sample.x, sample.y);
      float& farthest = sums.farthest_m(sample.x, sample.y);
      nearest = std::min(nearest, sample.measured_m);
      farthest = std::max(farthest, sample.measured_m);
    }
  return sums;
}

/// Combines the pixels of each pixel's window with `combine`, along x, then along y (separable).
template <class T, class Combine>
Image<T> over_window(const Image<T>& from, int half, Combine combine) {
  Image<T> across = from;
  for (int y = 0; y < from.height(); ++y)
    for (int x = 0; x < from.width(); ++x)
      for (int i = std::max(0, x - half); i <= std::min(from.width() - 1, x + half); ++i)
        if (i != x) combine(across(x, y), from(i, y));
  Image<T> both = across;
  for (int y = 0; y < from.height(); ++y)
    for (int x = 0; x < from.width(); ++x)
      for (int j = std::max(0, y - half); j <= std::min(from.height() - 1, y + half); ++j)
        if (j != y) combine(both(x, y), across(x, j));
  return both;
}

}  // namespace

DepthFit fit_each_pixel(std::span<const DepthView> views, DepthCorrectionModel model,
                        const DepthFitParams& params) {
  model.columns = model.width, model.rows = model.height;
  model.terms = 3;
  const int half = params.window_px / 2;
  const PixelSums sums = sum_up(views, model.width, model.height);
  DepthFit fit;
  for (const DepthView& view : views) fit.samples += view.samples.size();
  const auto moments = over_window(sums.moments, half, [](Moments& a, const Moments& b) { a += b; });
  const auto nearest = over_window(sums.nearest_m, half, [](float& a, float b) { a = std::min(a, b); });
  const auto farthest = over_window(sums.farthest_m, half, [](float& a, float b) { a = std::max(a, b); });
  const auto plane = static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height);
  model.coefficients.assign(3 * plane, 0.0F);
  model.lowest_s.assign(plane, 0.0F);
  model.highest_s.assign(plane, 0.0F);
  const double middle = (model.min_depth_m + model.max_depth_m) / 2,
               h = (model.max_depth_m - model.min_depth_m) / 2;
  std::size_t fitted = 0;
  for (std::size_t i = 0; i < plane; ++i) {
    const Moments& m = moments.data()[i];
    if (m.d[0] < kFewestSamples) continue;  // no correction
    ++fitted;
    const Polynomial c = solve(model.mode, m);
    const std::array<double, 3> in_s{c[0] + (c[1] - 1) * middle + c[2] * middle * middle,
                                     (c[1] - 1 + 2 * c[2] * middle) * h, c[2] * h * h};
    for (std::size_t k = 0; k < 3; ++k)
      model.coefficients[k * plane + i] = static_cast<float>(std::clamp(in_s[k], -99.0, 99.0));
    const auto s_of = [&](float depth_m) {
      return static_cast<float>(std::clamp((static_cast<double>(depth_m) - middle) / h, -1.0, 1.0));
    };
    model.lowest_s[i] = s_of(nearest.data()[i]);
    model.highest_s[i] = s_of(farthest.data()[i]);
  }
  fit.fitted_pixel_ratio = static_cast<double>(fitted) / static_cast<double>(plane);
  fit.model = std::move(model);
  return fit;
}

}  // namespace hm::detail
