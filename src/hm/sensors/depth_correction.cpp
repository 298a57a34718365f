#include "hm/sensors/depth_correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#if defined(__x86_64__)
#define HM_FOR_AVX2 __attribute__((target("avx2")))
#endif

namespace hm {
namespace {

constexpr int kPadding = 16;  ///< floats behind a row, so that whole vectors can be written

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

/// Numbers of one image that are the same for all of its readings.
struct RowScale {
  float s_factor, s_offset;  ///< units to s
  float units_per_m;
};

/// Coefficients along a row as cubics of t, written past `end` up to whole vectors.
inline void fill_span(float* out, int count, float t, float step, const float* a) {
  for (int i = 0; i < count; ++i) {
    const float x = t + static_cast<float>(i) * step;
    out[i] = ((a[3] * x + a[2]) * x + a[1]) * x + a[0];
  }
}

using detail::RowTerms;

template <int kTerms>
[[gnu::always_inline]] inline void correct_row(std::uint16_t* units, int width, const RowTerms& row,
                                               const RowScale& scale) {
  for (int x = 0; x < width; ++x) {
    const auto reading = static_cast<float>(units[x]);
    float s = reading * scale.s_factor + scale.s_offset;
    s = s < row.low[x] ? row.low[x] : s;
    s = s > row.high[x] ? row.high[x] : s;
    float delta = row.term[kTerms - 1][x];
    for (int k = kTerms - 2; k >= 0; --k) delta = delta * s + row.term[k][x];
    float corrected = reading + delta * scale.units_per_m + 0.5F;
    corrected = corrected < 1.0F ? 1.0F : corrected;
    corrected = corrected > 65535.0F ? 65535.0F : corrected;
    const int whole = static_cast<int>(corrected);
    units[x] = static_cast<std::uint16_t>(units[x] == 0 ? 0 : whole);
  }
}

using RowKernel = void (*)(std::uint16_t*, int, const RowTerms&, const RowScale&);

template <int kTerms>
void correct_row_plain(std::uint16_t* units, int width, const RowTerms& row, const RowScale& scale) {
  correct_row<kTerms>(units, width, row, scale);
}

#ifdef HM_FOR_AVX2
/// The same arithmetic eight readings at a time: without fused operations, so that the bits are the same.
template <int kTerms>
HM_FOR_AVX2 void correct_row_avx2(std::uint16_t* units, int width, const RowTerms& row,
                                  const RowScale& scale) {
  correct_row<kTerms>(units, width, row, scale);
}
#endif

RowKernel kernel_for(int terms) {
#ifdef HM_FOR_AVX2
  constexpr std::array<RowKernel, 4> kFast{correct_row_avx2<1>, correct_row_avx2<2>, correct_row_avx2<3>,
                                           correct_row_avx2<4>};
  if (__builtin_cpu_supports("avx2")) return kFast[static_cast<std::size_t>(terms - 1)];
#endif
  constexpr std::array<RowKernel, 4> kPlain{correct_row_plain<1>, correct_row_plain<2>, correct_row_plain<3>,
                                            correct_row_plain<4>};
  return kPlain[static_cast<std::size_t>(terms - 1)];
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
  span_begin_.push_back(width);
}

/// The coefficients of all pixels of a row: four rows of control points become one by the row's weights, and
/// each span of columns a cubic.
void DepthCorrection::row_of_spline(int y, std::vector<float>& terms) const {
  const Knot& knot = knots_of_row_[static_cast<std::size_t>(y)];
  const int columns = model_.columns, spans = columns - 3;
  const float step = static_cast<float>(spans) / static_cast<float>(width_);
  for (int k = 0; k < model_.terms; ++k) {
    const float* plane = model_.coefficients.data() + k * columns * model_.rows + knot.span * columns;
    float* out = terms.data() + k * (width_ + kPadding);
    for (int span = 0; span < spans; ++span) {
      float c[4];
      for (int i = 0; i < 4; ++i) {
        const float* point = plane + span + i;
        c[i] = knot.weight[0] * point[0] + knot.weight[1] * point[columns] +
               knot.weight[2] * point[2 * columns] + knot.weight[3] * point[3 * columns];
      }
      const float a[4] = {(c[0] + 4 * c[1] + c[2]) / 6, (c[2] - c[0]) / 2, (c[0] - 2 * c[1] + c[2]) / 2,
                          (c[3] - c[0] + 3 * (c[1] - c[2])) / 6};
      const int begin = span_begin_[static_cast<std::size_t>(span)];
      const int count = span_begin_[static_cast<std::size_t>(span) + 1] - begin;
      const float t = (static_cast<float>(begin) + 0.5F) * step - static_cast<float>(span);
      fill_span(out + begin, (count + 7) / 8 * 8, t, step, a);
    }
  }
}

/// A row of the model itself.
RowTerms DepthCorrection::row_in_place(int y) const {
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
      terms[to * static_cast<std::size_t>(width_ + kPadding) + static_cast<std::size_t>(x)] =
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
  const double span_m = model_.max_depth_m - model_.min_depth_m;
  const RowScale scale{static_cast<float>(2 * depth.unit_m / span_m),
                       static_cast<float>(-(model_.min_depth_m + model_.max_depth_m) / span_m),
                       static_cast<float>(1 / depth.unit_m)};
  const bool smooth = model_.mode == DepthFitMode::kSpline;
  const RowKernel kernel = kernel_for(model_.terms);
  const std::size_t stride = static_cast<std::size_t>(width_ + kPadding);
  const auto count = static_cast<std::size_t>(model_.terms);
  std::vector<float> terms((count + 2) * stride);
  std::fill(terms.begin() + static_cast<std::ptrdiff_t>(count * stride), terms.end(), 1.0F);
  std::fill_n(terms.begin() + static_cast<std::ptrdiff_t>(count * stride), stride, -1.0F);
  RowTerms row{};
  for (std::size_t k = 0; k < count; ++k) row.term[k] = terms.data() + k * stride;
  row.low = terms.data() + count * stride;
  row.high = terms.data() + (count + 1) * stride;
  const bool in_place = !smooth && width_ == model_.width && height_ == model_.height;
  for (int y = 0; y < height_; ++y) {
    if (smooth) {
      row_of_spline(y, terms);
    } else if (in_place) {
      row = row_in_place(y);
    } else {
      row_of_pixels(y, terms);
    }
    kernel(depth.units.row(y).data(), width_, row, scale);
  }
}

}  // namespace hm
