#include "hm/depth_camera/narrow_correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/core/round_up.hpp"
#include "hm/depth_camera/spline_basis.hpp"

namespace hm::detail {
namespace {

constexpr double kOne = 32768;
// 2^-15 of it is 0.006 mm. A term is rounded by at most 1 of that (its number and a product, each half), all
// weights together by 0.5, places and sums by 3: with four terms less than 0.05 mm.
constexpr double kLargestRange_m = 0.2;
constexpr double kBetweenRows_m = 4e-5;  // what is lost between two rows of coefficients
constexpr int kMostRowsApart = 16;
constexpr double kFullS = 32600;  // s = 1, with room for the rounding of a reading's place

std::int16_t narrowed(double ratio) {
  return static_cast<std::int16_t>(std::clamp(std::round(ratio * kOne), -32767.0, 32767.0));
}

/// c_k that belongs to s as whole numbers: kFullS of them are 1.
double of_whole_s(double coefficient_m, int term) { return coefficient_m * std::pow(kOne / kFullS, term); }

/// The terms along the rows of control points, at a column of the image: [row][term].
std::vector<double> points_in_column(const DepthCorrectionModel& model, const SplinePlace& place) {
  const auto weights = spline_weights(place.t);
  std::vector<double> sums;
  for (int row = 0; row < model.rows; ++row)
    for (int term = 0; term < model.terms; ++term) {
      const float* points =
          model.coefficients.data() + (term * model.rows + row) * model.columns + place.span;
      double sum = 0;
      for (std::size_t i = 0; i < 4; ++i) sum += weights[i] * static_cast<double>(points[i]);
      sums.push_back(of_whole_s(sum, term));
    }
  return sums;
}

/// The second derivatives along a column, of all terms together, are nowhere larger: those of a cubic spline
/// are the second differences of its control points, and lie between them. For a step from point to point.
double most_bent(const std::vector<double>& points, std::size_t terms) {
  double most = 0;
  for (std::size_t row = 2 * terms; row < points.size(); row += terms) {
    double sum = 0;
    for (std::size_t i = row; i < row + terms; ++i)
      sum += std::abs(points[i] - 2 * points[i - terms] + points[i - 2 * terms]);
    most = std::max(most, sum);
  }
  return most;
}

/// So that a curve and its chords are no more than kBetweenRows_m apart.
int most_rows_apart(double bent_m, double points_per_row) {
  int apart = kMostRowsApart;
  while (apart > 1 && bent_m * std::pow(points_per_row * apart, 2) / 8 > kBetweenRows_m) apart /= 2;
  return apart;
}

}  // namespace

std::optional<NarrowCorrection> NarrowCorrection::make(const DepthCorrectionModel& model, int width,
                                                       int height) {
  NarrowCorrection narrow;
  narrow.width_ = width, narrow.height_ = height, narrow.terms_ = model.terms;
  narrow.stride_ = round_up(width, 32);
  narrow.min_depth_m_ = model.min_depth_m, narrow.max_depth_m_ = model.max_depth_m;
  const bool fits =
      model.mode == DepthFitMode::kSpline ? narrow.make_spline(model) : narrow.make_pixels(model);
  if (!fits) return std::nullopt;
  return narrow;
}

bool NarrowCorrection::make_spline(const DepthCorrectionModel& model) {
  const auto stride = static_cast<std::size_t>(stride_), terms = static_cast<std::size_t>(terms_);
  std::vector<std::vector<double>> columns;
  double bent_m = 0;
  for (int x = 0; x < width_; ++x) {
    columns.push_back(points_in_column(model, spline_place(x, width_, model.columns)));
    bent_m = std::max(bent_m, most_bent(columns.back(), terms));
  }
  const int apart = rows_apart_ = most_rows_apart(bent_m, static_cast<double>(model.rows - 3) / height_);
  std::vector<double> values;
  double largest_m = 1e-4;
  for (int y = 0; y < height_ - 1 + apart; y += apart) {
    const SplinePlace place = spline_place(std::min(y, height_ - 1), height_, model.rows);
    const auto weights = spline_weights(place.t);
    const std::size_t first = values.size();
    values.resize(first + terms * stride);
    for (std::size_t x = 0; x < columns.size(); ++x) {
      double sum_m = 0, step_m = 0;
      for (std::size_t k = 0; k < terms; ++k) {
        const std::size_t at = first + k * stride + x;
        const double* points = columns[x].data() + static_cast<std::size_t>(place.span) * terms + k;
        for (std::size_t i = 0; i < 4; ++i) values[at] += weights[i] * points[i * terms];
        sum_m += std::abs(values[at]);  // no sum on the way is larger: weights are shares, s is not above 1
        if (first > 0) step_m = std::max(step_m, std::abs(values[at] - values[at - terms * stride]));
      }
      largest_m = std::max({largest_m, sum_m, step_m});
    }
  }
  range_m_ = 1.001 * largest_m;
  if (range_m_ > kLargestRange_m) return false;
  for (const double value : values) coefficients_.push_back(narrowed(value / range_m_));
  coefficients_.resize(coefficients_.size() + terms * stride);  // after the last row, without weight
  for (int y = 0; y < height_; ++y) {
    const int before = y / apart * apart, after = std::min(before + apart, height_ - 1);
    weights_.push_back(before == after ? std::int16_t{0}
                                       : narrowed(static_cast<double>(y - before) / (after - before)));
  }
  return true;
}

bool NarrowCorrection::make_pixels(const DepthCorrectionModel& model) {
  const auto plane = static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height);
  double largest_m = 1e-4;
  for (std::size_t i = 0; i < plane; ++i) {
    double sum_m = 0;
    for (int k = 0; k < terms_; ++k)
      sum_m += std::abs(
          of_whole_s(static_cast<double>(model.coefficients[static_cast<std::size_t>(k) * plane + i]), k));
    largest_m = std::max(largest_m, sum_m);
  }
  range_m_ = 1.001 * largest_m;
  if (range_m_ > kLargestRange_m) return false;
  const auto source = [](int to, int from_size, int to_size) {
    return static_cast<int>((2 * static_cast<std::int64_t>(to) + 1) * from_size / (2 * to_size));
  };
  for (int y = 0; y < height_; ++y) {
    const int from_y = source(y, model.height, height_);
    const auto from = [&](int x) {
      return static_cast<std::size_t>(from_y * model.width + source(x, model.width, width_));
    };
    const auto add = [&](AlignedVector<std::int16_t>& to, auto&& number) {
      for (int x = 0; x < width_; ++x) to.push_back(narrowed(number(from(x))));
      to.resize(to.size() + static_cast<std::size_t>(stride_ - width_), 0);
    };
    for (std::size_t k = 0; k < static_cast<std::size_t>(terms_); ++k)
      add(coefficients_, [&](std::size_t i) {
        const auto c = static_cast<double>(model.coefficients[k * plane + i]);
        return of_whole_s(c, static_cast<int>(k)) / range_m_;
      });
    add(lowest_s_, [&](std::size_t i) { return static_cast<double>(model.lowest_s[i]) * kFullS / kOne; });
    add(highest_s_, [&](std::size_t i) { return static_cast<double>(model.highest_s[i]) * kFullS / kOne; });
  }
  return true;
}

std::optional<NarrowScale> NarrowCorrection::scale_for(double unit_m) const {
  const double half = (max_depth_m_ - min_depth_m_) / 2 / unit_m;
  const double middle = (max_depth_m_ + min_depth_m_) / 2 / unit_m;
  const double range = range_m_ / unit_m;
  if (!(half >= 1 && half <= kFullS && range < 4096 && max_depth_m_ / unit_m < 65535)) return std::nullopt;
  NarrowScale scale{};
  scale.raise = 1;
  while (half * scale.raise * 2 <= kFullS) scale.raise = static_cast<std::uint16_t>(2 * scale.raise);
  scale.lowest = static_cast<std::uint16_t>(std::ceil(min_depth_m_ / unit_m));
  scale.highest = static_cast<std::uint16_t>(std::floor(max_depth_m_ / unit_m));
  scale.middle = static_cast<std::uint16_t>(std::llround(middle * scale.raise) & 0xffff);
  scale.stretch = narrowed(kFullS / (half * scale.raise) - 1);
  int bits = 0;
  while (bits < 14 && range * (2 << bits) < kOne / 2) ++bits;
  scale.to_units = narrowed(range * (1 << bits) / kOne);
  scale.lower = static_cast<std::int16_t>(1 << (15 - bits));
  if (bits < 1 || scale.lowest > scale.highest) return std::nullopt;
  return scale;
}

NarrowRow NarrowCorrection::row(int y) const {
  const auto terms = static_cast<std::size_t>(terms_), stride = static_cast<std::size_t>(stride_);
  const auto at = static_cast<std::size_t>(y);
  NarrowRow row;
  row.width = width_, row.terms = terms_, row.stride = stride_;
  row.is_spline = !weights_.empty();
  if (row.is_spline) {
    row.coefficients = coefficients_.data() + static_cast<std::size_t>(y / rows_apart_) * terms * stride;
    row.weight = weights_[at];
  } else {
    row.coefficients = coefficients_.data() + at * terms * stride;
    row.lowest_s = lowest_s_.data() + at * stride;
    row.highest_s = highest_s_.data() + at * stride;
  }
  return row;
}

}  // namespace hm::detail
