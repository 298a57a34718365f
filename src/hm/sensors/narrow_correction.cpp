#include "hm/sensors/narrow_correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/sensors/spline_basis.hpp"

namespace hm::detail {
namespace {

constexpr double kOne = 32768;
constexpr double kLargestRange_m = 0.32;  // 2^-15 of it is 0.01 mm; ten roundings stay below 0.1 mm
constexpr double kFullS = 32600;          // s = 1, with room for the rounding of a reading's place

std::int16_t narrowed(double ratio) {
  return static_cast<std::int16_t>(std::clamp(std::round(ratio * kOne), -32767.0, 32767.0));
}

/// c_k that belongs to s as whole numbers: kFullS of them are 1.
double of_whole_s(double coefficient_m, int term) { return coefficient_m * std::pow(kOne / kFullS, term); }

/// Factors of t^3 .. t^0 of a span of a spline, between four control points.
std::array<double, 4> cubic_between(const std::array<double, 4>& c) {
  return {(c[3] - c[0] + 3 * (c[1] - c[2])) / 6, (c[0] - 2 * c[1] + c[2]) / 2, (c[2] - c[0]) / 2,
          (c[0] + 4 * c[1] + c[2]) / 6};
}

/// The control points of a term along a row of the image.
double point_in_row(const DepthCorrectionModel& model, const SplinePlace& place, int term, int column) {
  const auto weights = spline_weights(place.t);
  double sum = 0;
  for (int j = 0; j < 4; ++j)
    sum += weights[static_cast<std::size_t>(j)] *
           static_cast<double>(model.coefficients[static_cast<std::size_t>(
               (term * model.rows + place.span + j) * model.columns + column)]);
  return of_whole_s(sum, term);
}

}  // namespace

std::vector<int> spline_span_begins(int size_px, int points) {
  std::vector<int> begins;
  for (int x = 0, span = -1; x < size_px; ++x)
    for (const int here = spline_place(x, size_px, points).span; span < here; ++span) begins.push_back(x);
  begins.resize(static_cast<std::size_t>(points - 2), size_px);  // spans without a pixel, and the end
  return begins;
}

std::optional<NarrowCorrection> NarrowCorrection::make(const DepthCorrectionModel& model, int width,
                                                       int height) {
  NarrowCorrection narrow;
  narrow.width_ = width, narrow.height_ = height, narrow.terms_ = model.terms;
  narrow.min_depth_m_ = model.min_depth_m, narrow.max_depth_m_ = model.max_depth_m;
  const bool fits =
      model.mode == DepthFitMode::kSpline ? narrow.make_spline(model) : narrow.make_pixels(model);
  if (!fits) return std::nullopt;
  return narrow;
}

bool NarrowCorrection::make_spline(const DepthCorrectionModel& model) {
  const int spans = model.columns - 3;
  std::vector<double> cubics;
  double largest_m = 1e-4;
  for (int y = 0; y < height_; ++y) {
    const SplinePlace place = spline_place(y, height_, model.rows);
    for (int span = 0; span < spans; ++span) {
      double sum_m = 0;
      for (int k = 0; k < terms_; ++k) {
        std::array<double, 4> points{};
        for (int i = 0; i < 4; ++i)
          points[static_cast<std::size_t>(i)] = point_in_row(model, place, k, span + i);
        for (const double factor : cubic_between(points)) {
          cubics.push_back(factor);
          sum_m += std::abs(factor);  // no sum on the way is larger: s and t are not above 1
        }
      }
      largest_m = std::max(largest_m, sum_m);
    }
  }
  range_m_ = 1.001 * largest_m;
  if (range_m_ > kLargestRange_m) return false;
  for (const double factor : cubics) coefficients_.push_back(narrowed(factor / range_m_));
  span_begin_ = spline_span_begins(width_, model.columns);
  for (int x = 0; x < width_; ++x) place_.push_back(narrowed(spline_place(x, width_, model.columns).t));
  place_.resize(static_cast<std::size_t>(width_ + DepthCorrection::kRowSlack_px), 0);
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
    for (int k = 0; k < terms_; ++k)
      for (int x = 0; x < width_; ++x) {
        const auto c = static_cast<double>(model.coefficients[static_cast<std::size_t>(k) * plane + from(x)]);
        coefficients_.push_back(narrowed(of_whole_s(c, k) / range_m_));
      }
    for (int x = 0; x < width_; ++x) {
      lowest_s_.push_back(narrowed(static_cast<double>(model.lowest_s[from(x)]) * kFullS / kOne));
      highest_s_.push_back(narrowed(static_cast<double>(model.highest_s[from(x)]) * kFullS / kOne));
    }
  }
  for (auto* table : {&coefficients_, &lowest_s_, &highest_s_})
    table->resize(table->size() + DepthCorrection::kRowSlack_px, 0);  // of the last row
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
  const auto width = static_cast<std::size_t>(width_), terms = static_cast<std::size_t>(terms_);
  const auto at = static_cast<std::size_t>(y);
  NarrowRow row;
  row.width = width_, row.terms = terms_;
  if (span_begin_.empty()) {
    row.coefficients = coefficients_.data() + at * terms * width;
    row.lowest_s = lowest_s_.data() + at * width;
    row.highest_s = highest_s_.data() + at * width;
    return row;
  }
  row.spans = static_cast<int>(span_begin_.size()) - 1;
  row.span_begin = span_begin_.data();
  row.place = place_.data();
  row.coefficients = coefficients_.data() + at * static_cast<std::size_t>(row.spans) * terms * 4;
  return row;
}

}  // namespace hm::detail
