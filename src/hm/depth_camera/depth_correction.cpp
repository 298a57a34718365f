#include "hm/depth_camera/depth_correction.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "hm/depth_camera/depth_kernels.hpp"
#include "hm/depth_camera/narrow_correction.hpp"
#include "hm/depth_camera/spline_basis.hpp"

namespace hm {
namespace {

using detail::Kernels;
using detail::RowScale;
using detail::spline_place;
using detail::spline_weights;
using detail::SplinePlace;

RowScale row_scale(const DepthCorrectionModel& model, double unit_m) {
  const double span_m = model.max_depth_m - model.min_depth_m;
  return {static_cast<float>(2 * unit_m / span_m),
          static_cast<float>(-(model.min_depth_m + model.max_depth_m) / span_m),
          static_cast<float>(1 / unit_m),
          static_cast<int>(std::ceil(std::min(model.min_depth_m / unit_m, 65535.0))),
          static_cast<int>(std::floor(std::min(model.max_depth_m / unit_m, 65535.0)))};
}

/// First pixel of each span of a row of `size_px` pixels, and the end.
std::vector<int> spline_span_begins(int size_px, int points) {
  std::vector<int> begins;
  for (int x = 0, span = -1; x < size_px; ++x)
    for (const int here = spline_place(x, size_px, points).span; span < here; ++span) begins.push_back(x);
  begins.resize(static_cast<std::size_t>(points - 2), size_px);  // spans without a pixel, and the end
  return begins;
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

namespace detail {

/// A model in single precision, row by row: for numbers that NarrowCorrection cannot hold.
class WideCorrection {
 public:
  WideCorrection(DepthCorrectionModel model, int width, int height);
  void apply_row(int y, const std::uint16_t* from, std::uint16_t* to, double unit_m) const;

 private:
  void spline_row(int y, const std::uint16_t* from, std::uint16_t* to, const RowScale& scale) const;
  void pixel_row(int y, const std::uint16_t* from, std::uint16_t* to, const RowScale& scale) const;
  void cubics_of_row(int y, std::vector<float>& cubics) const;

  DepthCorrectionModel model_;
  int width_, height_;
  std::vector<int> span_begin_;
};

WideCorrection::WideCorrection(DepthCorrectionModel model, int width, int height)
    : model_(std::move(model)), width_(width), height_(height) {
  if (model_.mode == DepthFitMode::kSpline) span_begin_ = spline_span_begins(width, model_.columns);
}

void WideCorrection::apply_row(int y, const std::uint16_t* from, std::uint16_t* to, double unit_m) const {
  const RowScale scale = row_scale(model_, unit_m);
  if (model_.mode == DepthFitMode::kSpline)
    spline_row(y, from, to, scale);
  else
    pixel_row(y, from, to, scale);
}

/// The cubics of a row: four rows of control points become one by the row's weights, and every four
/// neighbours of that a cubic of the place between them. Written as [span][term][power].
void WideCorrection::cubics_of_row(int y, std::vector<float>& cubics) const {
  const SplinePlace place = spline_place(y, height_, model_.rows);
  const auto weight = spline_weights(static_cast<float>(place.t));
  const int columns = model_.columns, spans = columns - 3, terms = model_.terms;
  cubics.resize(static_cast<std::size_t>(terms * spans * 4));
  std::vector<float> c(static_cast<std::size_t>(columns));
  for (int k = 0; k < terms; ++k) {
    const float* point = model_.coefficients.data() + (k * model_.rows + place.span) * columns;
    for (int i = 0; i < columns; ++i)
      c[static_cast<std::size_t>(i)] = weight[0] * point[i] + weight[1] * point[i + columns] +
                                       weight[2] * point[i + 2 * columns] +
                                       weight[3] * point[i + 3 * columns];
    for (int i = 0; i < spans; ++i) {
      const float* p = c.data() + i;
      float* a = cubics.data() + (i * terms + k) * 4;
      a[0] = (p[0] + 4 * p[1] + p[2]) / 6;
      a[1] = (p[2] - p[0]) / 2;
      a[2] = (p[0] - 2 * p[1] + p[2]) / 2;
      a[3] = (p[3] - p[0] + 3 * (p[1] - p[2])) / 6;
    }
  }
}

void WideCorrection::spline_row(int y, const std::uint16_t* from, std::uint16_t* to,
                                const RowScale& scale) const {
  const Kernels& kernels = kernels_for(model_.terms);
  const int spans = model_.columns - 3;
  const float step = static_cast<float>(spans) / static_cast<float>(width_);
  std::vector<float> cubics;
  cubics_of_row(y, cubics);
  for (int span = 0; span < spans; ++span) {
    const int begin = span_begin_[static_cast<std::size_t>(span)];
    const SpanShape shape{span_begin_[static_cast<std::size_t>(span) + 1] - begin,
                          (static_cast<float>(begin) + 0.5F) * step - static_cast<float>(span), step};
    kernels.span(from + begin, to + begin, shape, cubics.data() + span * model_.terms * 4, scale);
  }
}

/// An image of another size than the model's takes the pixel at the same place.
void WideCorrection::pixel_row(int y, const std::uint16_t* from, std::uint16_t* to,
                               const RowScale& scale) const {
  const int from_y = static_cast<int>((2 * static_cast<std::int64_t>(y) + 1) * model_.height / (2 * height_));
  const auto plane = static_cast<std::size_t>(model_.width) * static_cast<std::size_t>(model_.height);
  const auto count = static_cast<std::size_t>(model_.terms), width = static_cast<std::size_t>(width_);
  const auto offset = static_cast<std::size_t>(from_y) * static_cast<std::size_t>(model_.width);
  std::vector<const float*> planes;
  for (std::size_t k = 0; k < count; ++k) planes.push_back(model_.coefficients.data() + k * plane + offset);
  planes.push_back(model_.lowest_s.data() + offset);
  planes.push_back(model_.highest_s.data() + offset);
  std::vector<float> resampled;
  if (width_ != model_.width) {
    resampled.resize(planes.size() * width);
    for (std::size_t k = 0; k < planes.size(); ++k) {
      for (int x = 0; x < width_; ++x)
        resampled[k * width + static_cast<std::size_t>(x)] =
            planes[k][(2 * static_cast<std::int64_t>(x) + 1) * model_.width / (2 * width_)];
      planes[k] = resampled.data() + k * width;
    }
  }
  RowTerms row{};
  std::copy_n(planes.begin(), count, row.term);
  row.low = planes[count], row.high = planes[count + 1];
  std::copy_n(from, width, to);
  kernels_for(model_.terms).row(to, width_, row, scale);
}

}  // namespace detail

DepthCorrection::DepthCorrection(DepthCorrectionModel model, int width, int height)
    : width_(width), height_(height) {
  const auto checked = check_model(model);
  HM_CHECK(checked.has_value(), "{}", checked.error().message);
  HM_CHECK(width > 0 && height > 0, "{} x {}", width, height);
  if (auto narrow = detail::NarrowCorrection::make(model, width, height))
    narrow_ = std::make_unique<const detail::NarrowCorrection>(std::move(*narrow));
  wide_ = std::make_unique<const detail::WideCorrection>(std::move(model), width, height);
}

DepthCorrection::DepthCorrection(DepthCorrection&&) noexcept = default;
DepthCorrection& DepthCorrection::operator=(DepthCorrection&&) noexcept = default;
DepthCorrection::~DepthCorrection() = default;

DepthCorrection::Rows::Rows(const DepthCorrection& correction, double unit_m)
    : correction_(correction), unit_m_(unit_m) {
  if (!correction.narrow_) return;
  if (const auto scale = correction.narrow_->scale_for(unit_m))
    narrow_ = std::make_unique<const detail::NarrowScale>(*scale);
}

DepthCorrection::Rows::~Rows() = default;

void DepthCorrection::Rows::apply(int y, const std::uint16_t* from, std::uint16_t* to) const {
  if (narrow_)
    detail::correct_row_simd(correction_.narrow_->row(y), *narrow_, from, to);
  else
    correction_.wide_->apply_row(y, from, to, unit_m_);
}

void DepthCorrection::apply(DepthImage& depth) const {
  HM_CHECK(depth.width() == width_ && depth.height() == height_, "{} x {}", depth.width(), depth.height());
  const Rows rows(*this, depth.unit_m);
  std::vector<std::uint16_t> from(static_cast<std::size_t>(width_ + kRowSlack_px)), to(from.size());
  for (int y = 0; y < height_; ++y) {
    const auto row = depth.units.row(y);
    std::ranges::copy(row, from.begin());
    rows.apply(y, from.data(), to.data());
    std::copy_n(to.begin(), row.size(), row.begin());
  }
}

}  // namespace hm
