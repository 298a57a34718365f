#include "hm/depth_camera/depth_registration.hpp"

#include <algorithm>

#include "hm/depth_camera/aligned_vector.hpp"
#include "hm/depth_camera/depth_rows.hpp"
#include "hm/sensors/round_up.hpp"

namespace hm {
namespace {

/// Converts an image of closeness to depth and fills holes of one pixel.
void fill_holes(Image<std::uint16_t>& image) {
  const int columns = round_up(image.width(), detail::kRowBlock);
  using Row = AlignedVector<std::uint16_t>;
  Row filled(static_cast<std::size_t>(columns));
  // Unchanged rows, with one pixel of 0 before and padding to a whole block after them.
  Row above(filled.size() + 2), here(above), below(above);
  const auto copy_row = [&](int y, Row& to) {
    if (y < image.height())
      std::ranges::copy(image.row(y), to.begin() + 1);
    else
      std::ranges::fill(to, std::uint16_t{0});
  };
  copy_row(0, below);
  for (int y = 0; y < image.height(); ++y) {
    above.swap(here);
    here.swap(below);
    copy_row(y + 1, below);
    detail::fill_row({above.data() + 1, here.data() + 1, below.data() + 1}, columns, filled.data());
    std::copy_n(filled.data(), image.width(), image.row(y).data());
  }
}

}  // namespace

DepthRegistration::DepthRegistration(const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                                     const SE3& T_color_depth)
    : width_(depth_camera.width),
      height_(depth_camera.height),
      color_width_(color_camera.width),
      color_height_(color_camera.height) {
  HM_CHECK(depth_camera.distortion.is_zero() && color_camera.distortion.is_zero(), "rectify first");
  Mat3 pixels_from_color;
  pixels_from_color << color_camera.fx, 0, color_camera.cx, 0, color_camera.fy, color_camera.cy, 0, 0, 1;
  const Mat3 directions = pixels_from_color * T_color_depth.rotation();
  origin_m_ = pixels_from_color * T_color_depth.translation();
  for (std::size_t i = 0; i < 3; ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    for (int x = 0; x < round_up(width_, detail::kRowBlock); ++x)
      of_column_[i].push_back(
          static_cast<float>(directions(axis, 0) * (x - depth_camera.cx) / depth_camera.fx));
    for (int y = 0; y < height_; ++y)
      of_row_[i].push_back(static_cast<float>(directions(axis, 1) * (y - depth_camera.cy) / depth_camera.fy +
                                              directions(axis, 2)));
  }
}

void DepthRegistration::apply(const Image<std::uint16_t>& depth, double unit_m,
                              Image<std::uint16_t>& registered) const {
  HM_CHECK(depth.width() == width_ && depth.height() == height_, "{} x {}", depth.width(), depth.height());
  HM_CHECK(&depth != &registered, "two images are needed");
  if (registered.width() == color_width_ && registered.height() == color_height_)
    std::ranges::fill(registered.pixels(), std::uint16_t{0});
  else
    registered = Image<std::uint16_t>(color_width_, color_height_);
  detail::ProjectedRow row;
  row.columns = static_cast<int>(of_column_[0].size());
  row.width = color_width_, row.height = color_height_;
  for (std::size_t i = 0; i < 3; ++i) {
    row.column[i] = of_column_[i].data();
    row.origin[i] = static_cast<float>(origin_m_[static_cast<Eigen::Index>(i)] / unit_m);
  }
  AlignedVector<std::int32_t> pixels(of_column_[0].size());
  AlignedVector<std::uint16_t> readings(pixels.size()), closeness(pixels.size());
  std::uint16_t* const closest = registered.data();
  for (int y = 0; y < height_; ++y) {
    for (std::size_t i = 0; i < 3; ++i) row.row[i] = of_row_[i][static_cast<std::size_t>(y)];
    std::ranges::copy(depth.row(y), readings.begin());
    detail::project_row(row, readings.data(), pixels.data(), closeness.data());
    for (std::size_t x = 0; x < static_cast<std::size_t>(width_); ++x)
      closest[pixels[x]] = std::max(closest[pixels[x]], closeness[x]);
  }
  fill_holes(registered);
}

Image<std::uint16_t> DepthRegistration::apply(const Image<std::uint16_t>& depth, double unit_m) const {
  Image<std::uint16_t> registered;
  apply(depth, unit_m, registered);
  return registered;
}

}  // namespace hm
