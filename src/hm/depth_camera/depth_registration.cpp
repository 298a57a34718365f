#include "hm/depth_camera/depth_registration.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/round_up.hpp"
#include "hm/depth_camera/registration_kernels.hpp"

namespace hm {
namespace {

constexpr int kMargin_px = detail::kBlock_px;  // before and after rows of readings
constexpr double kDeepest = 65534;             // units that fit, with one for rounding

int padded(int width) { return round_up(width, detail::kRowBlock_px); }

}  // namespace

bool DepthRegistration::fits(const PinholeCamera& color_camera) {
  return detail::has_cells_for(color_camera.width, color_camera.height);
}

DepthRegistration::DepthRegistration(const PinholeCamera& depth_camera, const PinholeCamera& color_camera,
                                     const SE3& T_color_depth)
    : width_(depth_camera.width), height_(depth_camera.height), color_camera_(color_camera) {
  HM_CHECK(depth_camera.distortion.is_zero() && color_camera.distortion.is_zero(), "rectify first");
  const auto matrix = [](const PinholeCamera& camera, int left, int top) {
    Mat3 m;
    m << camera.fx, 0, camera.cx + left, 0, camera.fy, camera.cy + top, 0, 0, 1;
    return m;
  };
  const Mat3 pixels_from_color = matrix(color_camera, 0, 0);
  cells_ = detail::registration_cells(
      {pixels_from_color * T_color_depth.rotation() * matrix(depth_camera, 0, 0).inverse(),
       pixels_from_color * T_color_depth.translation(), padded(width_), height_, color_camera.width,
       color_camera.height});
  const Mat3 cells_from_color = matrix(color_camera, cells_.left, cells_.top);
  const Mat3 turned = cells_from_color * T_color_depth.rotation();
  origin_m_ = cells_from_color * T_color_depth.translation();
  of_column_.resize(3 * static_cast<std::size_t>(padded(width_)));
  for (int x = 0; x < padded(width_); ++x) {
    const Vec3 direction = turned.col(0) * ((x - depth_camera.cx) / depth_camera.fx);
    for (int i = 0; i < 3; ++i)
      of_column_[static_cast<std::size_t>(detail::column_at(x, i))] = static_cast<float>(direction[i]);
  }
  for (int y = 0; y < height_; ++y) {
    const Vec3 direction = turned.col(1) * ((y - depth_camera.cy) / depth_camera.fy) + turned.col(2);
    for (std::size_t i = 0; i < 3; ++i)
      of_row_[i].push_back(static_cast<float>(direction[static_cast<Eigen::Index>(i)]));
  }
  settled_.resize(static_cast<std::size_t>(height_));
  for (int y = height_ - 1, first = cells_.rows; y >= 0; --y) {
    first = std::min(first, cells_.reached[static_cast<std::size_t>(y)].first);
    settled_[static_cast<std::size_t>(y)] = first;
  }
}

DepthRegistration::Canvas::Canvas(const DepthRegistration& registration) : registration_(registration) {
  const detail::RegistrationCells& cells = registration.cells_;
  // With room for whatever is counted from a row.
  closest_.resize(static_cast<std::size_t>(cells.rows) * static_cast<std::size_t>(cells.stride) +
                  detail::RegistrationCells::kMostWithinReach + kMargin_px);
  for (PlacedNumbers* row : {&row_, &next_row_})
    for (auto* numbers : {&row->cells, &row->closeness})
      numbers->resize(static_cast<std::size_t>(padded(registration.width_)) + 2 * kMargin_px);
}

void DepthRegistration::Canvas::begin(double unit_m) {
  const detail::RegistrationCells& cells = registration_.cells_;
  for (std::size_t i = 0; i < 3; ++i)
    origin_[i] = static_cast<float>(registration_.origin_m_[static_cast<Eigen::Index>(i)] / unit_m);
  const double origin_z = registration_.origin_m_.z() / unit_m, nearest = std::ceil(cells.nearest_m / unit_m);
  const double deepest = std::min((kDeepest - origin_z) / cells.most_z, kDeepest);
  const bool is_bounded = nearest >= 1 && nearest <= deepest;
  lowest_ = is_bounded ? static_cast<int>(nearest) : 1;
  highest_ = is_bounded ? static_cast<int>(deepest) : 0;
  holds_back_ = !is_bounded;
  placed_from_row_ = cleared_ = filled_ = added_ = 0;
  const PinholeCamera& camera = registration_.color_camera_;
  if (registered_.width() != camera.width || registered_.height() != camera.height)
    registered_ = Image<std::uint16_t>(camera.width, camera.height);
  std::ranges::fill(row_.cells, std::uint16_t{0});
  std::ranges::fill(row_.closeness, detail::kNone);
}

detail::ProjectedRow DepthRegistration::Canvas::projected(int y) const {
  const auto at = static_cast<std::size_t>(y);
  detail::ProjectedRow row;
  row.width = padded(registration_.width_);
  row.columns = registration_.of_column_.data();
  for (std::size_t i = 0; i < 3; ++i) {
    row.row[i] = registration_.of_row_[i][at];
    row.origin[i] = origin_[i];
  }
  row.first_row = static_cast<float>(registration_.cells_.reached[at].first);
  row.stride = static_cast<float>(registration_.cells_.stride);
  row.lowest = static_cast<std::uint16_t>(lowest_), row.highest = static_cast<std::uint16_t>(highest_);
  return row;
}

void DepthRegistration::Canvas::clear_until(int row) {
  if (row <= cleared_) return;
  const int stride = registration_.cells_.stride;
  std::fill(closest_.begin() + static_cast<std::ptrdiff_t>(cleared_) * stride,
            closest_.begin() + static_cast<std::ptrdiff_t>(row) * stride, detail::kNone);
  cleared_ = row;
}

/// Projects row y, and gives the readings of the row before to their cells.
void DepthRegistration::Canvas::take_step(int y, const std::uint16_t* depth) {
  const auto of = [](PlacedNumbers& row) {
    return detail::PlacedRow{row.cells.data() + kMargin_px, row.closeness.data() + kMargin_px};
  };
  const detail::RegistrationStep step{
      projected(y), depth, of(next_row_), of(row_),
      closest_.data() + static_cast<std::ptrdiff_t>(placed_from_row_) * registration_.cells_.stride};
  const bool some_beyond = detail::register_step_simd(step);
  std::fill(next_row_.closeness.begin() + kMargin_px + registration_.width_, next_row_.closeness.end(),
            detail::kNone);
  std::swap(row_, next_row_);
  placed_from_row_ = registration_.cells_.reached[static_cast<std::size_t>(y)].first;
  if (some_beyond) take_each(y, depth);
}

/// The readings of row y that may go anywhere, one by one.
void DepthRegistration::Canvas::take_each(int y, const std::uint16_t* depth) {
  clear_until(registration_.cells_.rows);
  const detail::ProjectedRow row = projected(y);
  const auto stride = static_cast<std::size_t>(registration_.cells_.stride);
  for (int x = 0; x < registration_.width_; ++x) {
    if (depth[x] == 0 || (depth[x] >= lowest_ && depth[x] <= highest_)) continue;
    const detail::PlacedReading at = detail::place_plain(row, x, depth[x]);
    const std::size_t cell_y =
        std::min<std::size_t>(at.row, static_cast<std::size_t>(registration_.cells_.rows) - 1);
    std::uint16_t& closest = closest_[cell_y * stride + std::min<std::size_t>(at.column, stride - 1)];
    closest = std::max(closest, at.closeness);
    holds_back_ = true;
  }
}

void DepthRegistration::Canvas::add_row(int y, const std::uint16_t* depth) {
  HM_CHECK(y == added_ && y < registration_.height_, "row {} after {} rows", y, added_);
  ++added_;
  const auto at = static_cast<std::size_t>(y);
  const detail::RegistrationCells& cells = registration_.cells_;
  if (lowest_ > highest_) return take_each(y, depth);
  clear_until(cells.reached[at].last + 1);
  take_step(y, depth);
  if (!holds_back_) fill_until(registration_.settled_[at] - cells.top - 1);
}

/// Fills rows of the image before this one; nothing more goes to its cells, nor to those around it.
void DepthRegistration::Canvas::fill_until(int row) {
  const int width = registered_.width(), height = registered_.height(), stride = registration_.cells_.stride;
  for (; filled_ < std::min(row, height); ++filled_) {
    const int cell_y = registration_.cells_.top + filled_;
    clear_until(cell_y + 2);
    std::uint16_t* const cells =
        closest_.data() + static_cast<std::ptrdiff_t>(cell_y) * stride + registration_.cells_.left;
    // The border took what the camera does not see.
    cells[-1] = cells[width] = detail::kNone;
    if (filled_ == 0) std::fill_n(cells - stride, width, detail::kNone);
    if (filled_ == height - 1) std::fill_n(cells + stride, width, detail::kNone);
    detail::fill_row_simd({cells - stride, cells, cells + stride, width}, registered_.row(filled_).data());
  }
}

void DepthRegistration::Canvas::finish(Image<std::uint16_t>& registered) {
  HM_CHECK(added_ == registration_.height_, "{} rows of {}", added_, registration_.height_);
  added_ = -1;
  const auto nothing =
      std::vector<std::uint16_t>(static_cast<std::size_t>(registration_.width_ + kRowSlack_px));
  if (lowest_ <= highest_) take_step(registration_.height_ - 1, nothing.data());  // the last row to its cells
  if (holds_back_) filled_ = 0;
  fill_until(registered_.height());
  std::swap(registered, registered_);
}

Image<std::uint16_t> DepthRegistration::apply(const Image<std::uint16_t>& depth, double unit_m) const {
  HM_CHECK(depth.width() == width_ && depth.height() == height_, "{} x {}", depth.width(), depth.height());
  Canvas canvas(*this);
  canvas.begin(unit_m);
  std::vector<std::uint16_t> row(static_cast<std::size_t>(width_ + kRowSlack_px));
  for (int y = 0; y < height_; ++y) {
    std::ranges::copy(depth.row(y), row.begin());
    canvas.add_row(y, row.data());
  }
  Image<std::uint16_t> registered;
  canvas.finish(registered);
  return registered;
}

}  // namespace hm
