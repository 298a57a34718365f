#include "hm/depth_camera/disparity.hpp"

#include <algorithm>
#include <cmath>

namespace hm {

double DisparityModel::depth_m(double disparity) const {
  const double inverse = offset_per_m + slope_per_m * disparity;
  return inverse > 0 ? 1 / inverse : 0;
}

Result<void> check_disparity(const DisparityModel& model) {
  const bool is_right = std::isfinite(model.offset_per_m) && std::isfinite(model.slope_per_m) &&
                        model.offset_per_m > 0 && model.slope_per_m < 0;
  if (is_right) return {};
  return fail(ErrorCode::kInvalidValue, "",
              "1 / ({} + {} d) is no depth of a disparity d: the first must be above 0, the second below",
              model.offset_per_m, model.slope_per_m);
}

DisparityTable::DisparityTable(const DisparityModel& model, double unit_m) : units_(kNone + 1u, 0) {
  HM_CHECK(unit_m > 0, "{}", unit_m);
  for (std::size_t d = 1; d < kNone; ++d) {
    const double units = std::round(model.depth_m(static_cast<double>(d)) / unit_m);
    if (units >= 1 && units <= 65535) units_[d] = static_cast<std::uint16_t>(units);
  }
}

void DisparityTable::apply(Image<std::uint16_t>& raw) const {
  for (std::uint16_t& pixel : raw.pixels()) pixel = units_[std::min(pixel, kNone)];
}

}  // namespace hm
