#include "hm/depth_camera/depth_correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/depth_camera/depth_rows.hpp"
#include "hm/depth_camera/spline_basis.hpp"
#include "hm/sensors/round_up.hpp"

namespace hm {
namespace {

using detail::spline_place;
using detail::spline_weights;
using detail::SplinePlace;

/// Pixel of the model at the position of an image pixel.
int model_pixel(int pixel, int size, int model_size) {
  return static_cast<int>((2 * static_cast<std::int64_t>(pixel) + 1) * model_size / (2 * size));
}

}  // namespace

double DepthCorrectionModel::correction_m(const Vec2& pixel, double depth_m) const {
  double s = (2 * depth_m - min_depth_m - max_depth_m) / (max_depth_m - min_depth_m);
  const auto plane = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const auto at = [&](int term, int column, int row) {
    return static_cast<double>(coefficients[static_cast<std::size_t>(term) * plane +
                                            static_cast<std::size_t>(row * columns + column)]);
  };
  std::array<double, kMaxTerms> c{};
  if (mode == DepthFitMode::kSpline) {
    s = std::clamp(s, -1.0, 1.0);
    const SplinePlace u = spline_place(pixel.x(), width, columns), v = spline_place(pixel.y(), height, rows);
    const auto wu = spline_weights(u.t), wv = spline_weights(v.t);
    for (int k = 0; k < terms; ++k)
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i)
          c[static_cast<std::size_t>(k)] += wu[static_cast<std::size_t>(i)] *
                                            wv[static_cast<std::size_t>(j)] * at(k, u.span + i, v.span + j);
  } else {
    const int x = std::clamp(static_cast<int>(std::floor(pixel.x() + 0.5)), 0, width - 1);
    const int y = std::clamp(static_cast<int>(std::floor(pixel.y() + 0.5)), 0, height - 1);
    const auto i = static_cast<std::size_t>(y * columns + x);
    s = std::clamp(s, static_cast<double>(lowest_s[i]), static_cast<double>(highest_s[i]));
    for (int k = 0; k < terms; ++k) c[static_cast<std::size_t>(k)] = at(k, x, y);
  }
  double sum = 0;
  for (int k = terms - 1; k >= 0; --k) sum = sum * s + c[static_cast<std::size_t>(k)];
  return sum;
}

Result<void> check_model(const DepthCorrectionModel& model) {
  const auto wrong = [](const char* what) {
    return fail(ErrorCode::kCorrupted, "", "{} of the depth correction cannot be right", what);
  };
  if (model.width < 1 || model.height < 1 || model.width > 8192 || model.height > 8192)
    return wrong("the image size");
  if (model.terms < 1 || model.terms > DepthCorrectionModel::kMaxTerms) return wrong("the number of terms");
  if (!(model.min_depth_m > 0 && model.max_depth_m > model.min_depth_m && model.max_depth_m < 1000))
    return wrong("the trained range");
  const bool smooth = model.mode == DepthFitMode::kSpline;
  if (smooth ? model.columns < 4 || model.rows < 4 || model.columns > 512 || model.rows > 512
             : model.columns != model.width || model.rows != model.height)
    return wrong("the grid");
  const auto plane = static_cast<std::size_t>(model.columns) * static_cast<std::size_t>(model.rows);
  if (model.coefficients.size() != plane * static_cast<std::size_t>(model.terms))
    return wrong("the number of coefficients");
  const std::size_t limits = smooth ? 0 : plane;
  if (model.lowest_s.size() != limits || model.highest_s.size() != limits)
    return wrong("the number of ranges");
  for (const float c : model.coefficients)
    if (!(std::abs(c) < 100)) return wrong("a coefficient");
  for (std::size_t i = 0; i < limits; ++i)
    if (!(model.lowest_s[i] >= -1 && model.highest_s[i] <= 1 && model.lowest_s[i] <= model.highest_s[i]))
      return wrong("the range of a pixel");
  return {};
}

DepthCorrection::DepthCorrection(const DepthCorrectionModel& model, int width, int height)
    : width_(width),
      height_(height),
      columns_(round_up(width, detail::kRowBlock)),
      terms_(model.terms),
      min_depth_m_(model.min_depth_m),
      max_depth_m_(model.max_depth_m),
      is_spline_(model.mode == DepthFitMode::kSpline) {
  const auto checked = check_model(model);
  HM_CHECK(checked.has_value(), "{}", checked.error().message);
  HM_CHECK(width > 0 && height > 0, "{} x {}", width, height);
  if (is_spline_)
    resample_spline(model);
  else
    resample_pixels(model);
}

/// Splines are separable: interpolates columns; rows are interpolated for each row of an image.
void DepthCorrection::resample_spline(const DepthCorrectionModel& model) {
  table_rows_ = model.rows;
  for (int row = 0; row < model.rows; ++row)
    for (int k = 0; k < terms_; ++k) {
      const float* const points = model.coefficients.data() + (k * model.rows + row) * model.columns;
      for (int x = 0; x < columns_; ++x) {
        const auto [span, t] = spline_place(x, width_, model.columns);
        const auto weights = spline_weights(t);
        double sum = 0;
        for (std::size_t i = 0; i < weights.size(); ++i)
          sum += weights[i] * static_cast<double>(points[static_cast<std::size_t>(span) + i]);
        tables_.push_back(static_cast<float>(sum));
      }
    }
  lowest_s_.assign(static_cast<std::size_t>(columns_), -1.0F);
  highest_s_.assign(static_cast<std::size_t>(columns_), 1.0F);
}

/// Resamples the model to the image size by nearest pixel.
void DepthCorrection::resample_pixels(const DepthCorrectionModel& model) {
  table_rows_ = height_;
  const auto append_row = [&](AlignedVector<float>& to, const float* plane, int y) {
    const float* const row = plane + model_pixel(y, height_, model.height) * model.width;
    for (int x = 0; x < columns_; ++x)
      to.push_back(row[model_pixel(std::min(x, width_ - 1), width_, model.width)]);
  };
  for (int y = 0; y < height_; ++y) {
    for (int k = 0; k < terms_; ++k)
      append_row(tables_, model.coefficients.data() + k * model.width * model.height, y);
    append_row(lowest_s_, model.lowest_s.data(), y);
    append_row(highest_s_, model.highest_s.data(), y);
  }
}

void DepthCorrection::apply(DepthImage& depth) const {
  HM_CHECK(depth.width() == width_ && depth.height() == height_, "{} x {}", depth.width(), depth.height());
  const double span_m = max_depth_m_ - min_depth_m_;
  detail::CorrectionRow row;
  row.columns = columns_, row.terms = terms_;
  row.s_factor = static_cast<float>(2 * depth.unit_m / span_m);
  row.s_offset = static_cast<float>(-(min_depth_m_ + max_depth_m_) / span_m);
  row.units_per_m = static_cast<float>(1 / depth.unit_m);
  row.weights = {1, 0, 0, 0};
  AlignedVector<std::uint16_t> readings(static_cast<std::size_t>(columns_)), corrected(readings.size());
  for (int y = 0; y < height_; ++y) {
    int first = y;
    if (is_spline_) {
      const SplinePlace place = spline_place(y, height_, table_rows_);
      first = place.span;
      row.weights = spline_weights(static_cast<float>(place.t));
    }
    for (int i = 0; i < 4; ++i)
      row.tables[static_cast<std::size_t>(i)] =
          tables_.data() + static_cast<std::ptrdiff_t>(is_spline_ ? first + i : first) * terms_ * columns_;
    const std::ptrdiff_t limits = is_spline_ ? 0 : static_cast<std::ptrdiff_t>(y) * columns_;
    row.lowest_s = lowest_s_.data() + limits, row.highest_s = highest_s_.data() + limits;
    std::ranges::copy(depth.units.row(y), readings.begin());
    detail::correct_row(row, readings.data(), corrected.data());
    std::copy_n(corrected.data(), width_, depth.units.row(y).data());
  }
}

}  // namespace hm
