#include "hm/io/depth_registration.hpp"

#include <algorithm>

#include "hm/io/registration_kernels.hpp"

namespace hm {

DepthRegistration::DepthRegistration(const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                                     const SE3& T_color_depth)
    : width_(depth_camera.width), height_(depth_camera.height), color_camera_(color_camera) {
  HM_CHECK(depth_camera.distortion.is_zero() && color_camera.distortion.is_zero(), "rectify first");
  // The first pixel's cell is 1, after the border.
  Mat3 cells_from_color;
  cells_from_color << color_camera.fx, 0, color_camera.cx + 1,  //
      0, color_camera.fy, color_camera.cy + 1,                  //
      0, 0, 1;
  const Mat3 turned = cells_from_color * T_color_depth.rotation();
  origin_m_ = cells_from_color * T_color_depth.translation();
  const auto add = [](std::array<std::vector<float>, 3>& list, const Vec3& direction) {
    for (std::size_t i = 0; i < 3; ++i)
      list[i].push_back(static_cast<float>(direction[static_cast<Eigen::Index>(i)]));
  };
  for (int x = 0; x < width_; ++x) add(of_column_, turned.col(0) * ((x - depth_camera.cx) / depth_camera.fx));
  for (int y = 0; y < height_; ++y)
    add(of_row_, turned.col(1) * ((y - depth_camera.cy) / depth_camera.fy) + turned.col(2));
  for (auto& list : of_column_) list.resize(static_cast<std::size_t>(width_ + kRowSlack_px), 0.0F);
}

DepthRegistration::Canvas::Canvas(const DepthRegistration& registration, double unit_m)
    : registration_(registration), stride_(registration.color_camera_.width + 2) {
  for (std::size_t i = 0; i < 3; ++i)
    origin_[i] = static_cast<float>(registration.origin_m_[static_cast<Eigen::Index>(i)] / unit_m);
  const auto rows = static_cast<std::size_t>(registration.color_camera_.height + 2);
  HM_CHECK(rows * static_cast<std::size_t>(stride_) < 1u << 23u, "{} rows of {}", rows, stride_);
  nearest_.assign(rows * static_cast<std::size_t>(stride_) + kRowSlack_px, 65535);
  cells_.resize(static_cast<std::size_t>(registration.width_ + kRowSlack_px));
  nearness_.resize(cells_.size());
}

void DepthRegistration::Canvas::add_row(int y, const std::uint16_t* depth) {
  detail::ProjectedRow row;
  row.width = registration_.width_;
  for (std::size_t i = 0; i < 3; ++i) {
    row.of_column[i] = registration_.of_column_[i].data();
    row.of_row[i] = registration_.of_row_[i][static_cast<std::size_t>(y)];
    row.origin[i] = origin_[i];
  }
  row.last_x = static_cast<float>(registration_.color_camera_.width + 1);
  row.last_y = static_cast<float>(registration_.color_camera_.height + 1);
  row.stride = stride_;
  detail::project_row_simd(row, depth, cells_.data(), nearness_.data());
  std::uint16_t* const nearest = nearest_.data();
  const std::int32_t* const cells = cells_.data();
  const std::uint16_t* const nearness = nearness_.data();
  for (int x = 0; x < row.width; ++x) {
    std::uint16_t& cell = nearest[cells[x]];
    cell = std::min(cell, nearness[x]);
  }
}

void DepthRegistration::Canvas::finish(Image<std::uint16_t>& registered) {
  const PinholeCamera& camera = registration_.color_camera_;
  HM_CHECK(registered.width() == camera.width && registered.height() == camera.height, "{} x {}",
           registered.width(), registered.height());
  const auto stride = static_cast<std::size_t>(stride_), rows = static_cast<std::size_t>(camera.height) + 2;
  // The border took what the camera does not see.
  std::fill_n(nearest_.begin(), stride, std::uint16_t{65535});
  std::fill_n(nearest_.end() - kRowSlack_px - stride_, stride, std::uint16_t{65535});
  for (std::size_t row = 0; row < rows; ++row)
    nearest_[row * stride] = nearest_[row * stride + stride - 1] = 65535;
  for (int y = 0; y < camera.height; ++y)
    detail::fill_row_simd(nearest_.data() + (static_cast<std::size_t>(y) + 1) * stride + 1, stride_,
                          camera.width, registered.row(y).data());
}

Image<std::uint16_t> DepthRegistration::apply(const Image<std::uint16_t>& depth, double unit_m) const {
  HM_CHECK(depth.width() == width_ && depth.height() == height_, "{} x {}", depth.width(), depth.height());
  Canvas canvas(*this, unit_m);
  std::vector<std::uint16_t> row(static_cast<std::size_t>(width_ + kRowSlack_px));
  for (int y = 0; y < height_; ++y) {
    std::ranges::copy(depth.row(y), row.begin());
    canvas.add_row(y, row.data());
  }
  Image<std::uint16_t> registered(color_camera_.width, color_camera_.height);
  canvas.finish(registered);
  return registered;
}

}  // namespace hm
