#include "hm/io/depth_registration.hpp"

#include <algorithm>
#include <limits>

#include "hm/io/registration_kernels.hpp"

namespace hm {
namespace {

/// Cells to the left of a row's first pixel: a border, and a whole line of the cache.
constexpr int kLeft = 32;

/// Whole vectors of what FillRow and Step read.
int padded(int width) { return (width + 31) / 32 * 32; }

}  // namespace

DepthRegistration::DepthRegistration(const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                                     const SE3& T_color_depth)
    : width_(depth_camera.width),
      height_(depth_camera.height),
      // The border to the right of a row may be the one to the left of the next.
      stride_(padded(color_camera.width) + kLeft),
      rows_(color_camera.height + 2),
      color_camera_(color_camera) {
  HM_CHECK(depth_camera.distortion.is_zero() && color_camera.distortion.is_zero(), "rectify first");
  HM_CHECK(static_cast<std::int64_t>(rows_) * stride_ < 1 << 23, "{} rows of {}", rows_, stride_);
  Mat3 cells_from_color;
  cells_from_color << color_camera.fx, 0, color_camera.cx + kLeft,  //
      0, color_camera.fy, color_camera.cy + 1,                      //
      0, 0, 1;
  const Mat3 turned = cells_from_color * T_color_depth.rotation();
  origin_m_ = cells_from_color * T_color_depth.translation();
  for (int x = 0; x < padded(width_); ++x) {
    const Vec3 direction = turned.col(0) * ((x - depth_camera.cx) / depth_camera.fx);
    for (std::size_t i = 0; i < 3; ++i)
      of_column_[i].push_back(static_cast<float>(direction[static_cast<Eigen::Index>(i)]));
    if (x >= width_) of_column_[2].back() = std::numeric_limits<float>::quiet_NaN();
  }
  for (int y = 0; y < height_; ++y) {
    const Vec3 direction = turned.col(1) * ((y - depth_camera.cy) / depth_camera.fy) + turned.col(2);
    for (std::size_t i = 0; i < 3; ++i)
      of_row_[i].push_back(static_cast<float>(direction[static_cast<Eigen::Index>(i)]));
  }
}

DepthRegistration::Canvas::Canvas(const DepthRegistration& registration) : registration_(registration) {
  const auto width = static_cast<std::size_t>(padded(registration.width_));
  const auto cells =
      static_cast<std::size_t>(registration.rows_) * static_cast<std::size_t>(registration.stride_);
  // The border to the right of the last row; and holes go to the first cells, each to its own.
  nearest_.resize(std::max(cells + kRowSlack_px, width));
  for (auto* row : {&row_, &nearness_, &next_nearness_}) row->resize(width);
  for (auto* row : {&cells_, &next_cells_}) row->resize(width);
}

void DepthRegistration::Canvas::begin(double unit_m) {
  for (std::size_t i = 0; i < 3; ++i)
    origin_[i] = static_cast<float>(registration_.origin_m_[static_cast<Eigen::Index>(i)] / unit_m);
  std::ranges::fill(nearest_, detail::kNone);
  std::ranges::fill(cells_, 0U);
  std::ranges::fill(nearness_, detail::kNone);
}

/// Projects row y, and gives the readings of the row before to their cells.
void DepthRegistration::Canvas::take_step(int y) {
  detail::RegistrationStep step;
  detail::ProjectedRow& row = step.projection;
  row.width = padded(registration_.width_);
  for (std::size_t i = 0; i < 3; ++i) {
    row.of_column[i] = registration_.of_column_[i].data();
    row.of_row[i] = registration_.of_row_[i][static_cast<std::size_t>(y)];
    row.origin[i] = origin_[i];
  }
  row.last_x = static_cast<std::uint32_t>(registration_.color_camera_.width + kLeft);
  row.last_y = static_cast<std::uint32_t>(registration_.color_camera_.height + 1);
  row.stride = static_cast<std::uint32_t>(registration_.stride_);
  step.depth = row_.data();
  step.placed = {next_cells_.data(), next_nearness_.data()};
  step.splatted = {cells_.data(), nearness_.data()};
  step.nearest = nearest_.data();
  detail::register_step_simd(step);
  cells_.swap(next_cells_);
  nearness_.swap(next_nearness_);
}

void DepthRegistration::Canvas::add_row(int y, const std::uint16_t* depth) {
  std::copy_n(depth, registration_.width_, row_.begin());
  take_step(y);
}

void DepthRegistration::Canvas::finish(Image<std::uint16_t>& registered) {
  const PinholeCamera& camera = registration_.color_camera_;
  HM_CHECK(registered.width() == camera.width && registered.height() == camera.height, "{} x {}",
           registered.width(), registered.height());
  std::ranges::fill(row_, std::uint16_t{0});
  take_step(0);  // the last row to its cells
  // The border took what the camera does not see.
  const auto stride = static_cast<std::size_t>(registration_.stride_);
  const auto rows = static_cast<std::size_t>(registration_.rows_);
  const auto right = static_cast<std::size_t>(kLeft + camera.width);
  std::fill_n(nearest_.begin(), stride, detail::kNone);
  std::fill_n(nearest_.begin() + static_cast<std::ptrdiff_t>((rows - 1) * stride), stride, detail::kNone);
  for (std::size_t row = 0; row < rows; ++row)
    nearest_[row * stride + kLeft - 1] = nearest_[row * stride + right] = detail::kNone;
  for (int y = 0; y < camera.height; ++y)
    detail::fill_row_simd(nearest_.data() + (static_cast<std::size_t>(y) + 1) * stride + kLeft,
                          registration_.stride_, camera.width, registered.row(y).data());
}

Image<std::uint16_t> DepthRegistration::apply(const Image<std::uint16_t>& depth, double unit_m) const {
  HM_CHECK(depth.width() == width_ && depth.height() == height_, "{} x {}", depth.width(), depth.height());
  Canvas canvas(*this);
  canvas.begin(unit_m);
  for (int y = 0; y < height_; ++y) canvas.add_row(y, depth.row(y).data());
  Image<std::uint16_t> registered(color_camera_.width, color_camera_.height);
  canvas.finish(registered);
  return registered;
}

}  // namespace hm
