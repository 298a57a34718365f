#include "hm/sensors/depth_correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/sensors/depth_kernels.hpp"

namespace hm {
namespace {

using detail::kBlock;
using detail::Kernels;
using detail::RowScale;
using detail::RowTerms;
using detail::SpanShape;

/// The four cubic B-spline weights at t in [0, 1] of a span.
template <class T>
std::array<T, 4> spline_weights(T t) {
  const T u = 1 - t;
  return {u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * u * u * u - 6 * u * u + 4) / 6,
          t * t * t / 6};
}

struct SplinePlace {
  int span = 0;
  double t = 0;
};

/// Where a coordinate of the image lies among the spans of `points` control points.
SplinePlace spline_place(double x_px, int size_px, int points) {
  const int spans = points - 3;
  const double place = std::clamp((x_px + 0.5) / size_px, 0.0, 1.0) * spans;
  const int span = std::clamp(static_cast<int>(place), 0, spans - 1);
  return {span, place - span};
}

RowScale row_scale(const DepthCorrectionModel& model, double unit_m) {
  const double span_m = model.max_depth_m - model.min_depth_m;
  return {static_cast<float>(2 * unit_m / span_m),
          static_cast<float>(-(model.min_depth_m + model.max_depth_m) / span_m),
          static_cast<float>(1 / unit_m),
          static_cast<int>(std::ceil(std::min(model.min_depth_m / unit_m, 65535.0))),
          static_cast<int>(std::floor(std::min(model.max_depth_m / unit_m, 65535.0)))};
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

DepthCorrection::DepthCorrection(DepthCorrectionModel model, int width, int height)
    : model_(std::move(model)), width_(width), height_(height) {
  const auto checked = check_model(model_);
  HM_CHECK(checked.has_value(), "{}", checked.error().message);
  HM_CHECK(width > 0 && height > 0, "{} x {}", width, height);
  if (model_.mode != DepthFitMode::kSpline) return;
  for (int y = 0; y < height; ++y) {
    const SplinePlace place = spline_place(y, height, model_.rows);
    const auto weights = spline_weights(static_cast<float>(place.t));
    knots_of_row_.push_back({place.span, {weights[0], weights[1], weights[2], weights[3]}});
  }
  for (int x = 0, span = -1; x < width; ++x)
    for (const int here = spline_place(x, width, model_.columns).span; span < here; ++span)
      span_begin_.push_back(x);
  span_begin_.resize(static_cast<std::size_t>(model_.columns - 2),
                     width);  // spans without a pixel, and the end
}

/// The cubics of a row: four rows of control points become one by the row's weights, and every four
/// neighbours of that a cubic of the place between them. Written as [span][term][power].
void DepthCorrection::cubics_of_row(int y, std::span<float> blended, std::span<float> cubics) const {
  const Knot& knot = knots_of_row_[static_cast<std::size_t>(y)];
  const int columns = model_.columns, spans = columns - 3, terms = model_.terms;
  for (int k = 0; k < terms; ++k) {
    const float* point = model_.coefficients.data() + k * columns * model_.rows + knot.span * columns;
    float* out = blended.data() + k * columns;
    for (int i = 0; i < columns; ++i)
      out[i] = knot.weight[0] * point[i] + knot.weight[1] * point[i + columns] +
               knot.weight[2] * point[i + 2 * columns] + knot.weight[3] * point[i + 3 * columns];
  }
  for (int k = 0; k < terms; ++k)
    for (int i = 0; i < spans; ++i) {
      const float* c = blended.data() + k * columns + i;
      float* a = cubics.data() + (i * terms + k) * 4;
      a[0] = (c[0] + 4 * c[1] + c[2]) / 6;
      a[1] = (c[2] - c[0]) / 2;
      a[2] = (c[0] - 2 * c[1] + c[2]) / 2;
      a[3] = (c[3] - c[0] + 3 * (c[1] - c[2])) / 6;
    }
}

/// A row of the model itself.
detail::RowTerms DepthCorrection::row_in_place(int y) const {
  const auto offset = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
  const auto plane = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  RowTerms row{};
  for (std::size_t k = 0; k < static_cast<std::size_t>(model_.terms); ++k)
    row.term[k] = model_.coefficients.data() + k * plane + offset;
  row.low = model_.lowest_s.data() + offset;
  row.high = model_.highest_s.data() + offset;
  return row;
}

/// A row of an image of another size than the model's.
void DepthCorrection::row_of_pixels(int y, std::vector<float>& terms) const {
  const int from_y = static_cast<int>((2 * static_cast<std::int64_t>(y) + 1) * model_.height / (2 * height_));
  const auto copy = [&](const std::vector<float>& plane, std::size_t offset, std::size_t to) {
    for (int x = 0; x < width_; ++x) {
      const auto from_x = (2 * static_cast<std::int64_t>(x) + 1) * model_.width / (2 * width_);
      terms[to * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)] =
          plane[offset + static_cast<std::size_t>(from_y * model_.width + from_x)];
    }
  };
  const auto plane = static_cast<std::size_t>(model_.width) * static_cast<std::size_t>(model_.height);
  const auto count = static_cast<std::size_t>(model_.terms);
  for (std::size_t k = 0; k < count; ++k) copy(model_.coefficients, k * plane, k);
  copy(model_.lowest_s, 0, count);
  copy(model_.highest_s, 0, count + 1);
}

void DepthCorrection::apply(DepthImage& depth) const {
  HM_CHECK(depth.width() == width_ && depth.height() == height_, "{} x {}", depth.width(), depth.height());
  if (model_.mode == DepthFitMode::kSpline)
    apply_spline(depth);
  else
    apply_pixels(depth);
}

void DepthCorrection::apply_spline(DepthImage& depth) const {
  const RowScale scale = row_scale(model_, depth.unit_m);
  const Kernels& kernels = detail::kernels_for(model_.terms);
  const int spans = model_.columns - 3;
  const float step = static_cast<float>(spans) / static_cast<float>(width_);
  const auto terms = static_cast<std::size_t>(model_.terms);
  std::vector<float> blended(terms * static_cast<std::size_t>(model_.columns));
  std::vector<float> cubics(terms * static_cast<std::size_t>(spans) * 4);
  // Whole blocks reach over the end of a span into the next one, which then writes the right values.
  std::vector<std::uint16_t> from(static_cast<std::size_t>(width_ + kBlock)), to(from.size());
  for (int y = 0; y < height_; ++y) {
    const auto row = depth.units.row(y);
    std::copy(row.begin(), row.end(), from.begin());
    cubics_of_row(y, blended, cubics);
    for (int span = 0; span < spans; ++span) {
      const int begin = span_begin_[static_cast<std::size_t>(span)];
      const SpanShape shape{span_begin_[static_cast<std::size_t>(span) + 1] - begin,
                            (static_cast<float>(begin) + 0.5F) * step - static_cast<float>(span), step};
      kernels.span(from.data() + begin, to.data() + begin, shape,
                   cubics.data() + static_cast<std::size_t>(span) * terms * 4, scale);
    }
    std::copy_n(to.begin(), row.size(), row.begin());
  }
}

void DepthCorrection::apply_pixels(DepthImage& depth) const {
  const RowScale scale = row_scale(model_, depth.unit_m);
  const Kernels& kernels = detail::kernels_for(model_.terms);
  const bool in_place = width_ == model_.width && height_ == model_.height;
  const auto count = static_cast<std::size_t>(model_.terms), stride = static_cast<std::size_t>(width_);
  std::vector<float> terms((count + 2) * stride);
  RowTerms row{};
  for (std::size_t k = 0; k < count; ++k) row.term[k] = terms.data() + k * stride;
  row.low = terms.data() + count * stride;
  row.high = terms.data() + (count + 1) * stride;
  for (int y = 0; y < height_; ++y) {
    if (in_place)
      row = row_in_place(y);
    else
      row_of_pixels(y, terms);
    kernels.row(depth.units.row(y).data(), width_, row, scale);
  }
}

}  // namespace hm
