#include "hm/pipeline/live/scan_advice.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "hm/core/angle.hpp"

namespace hm {
namespace {

constexpr int kSamplesAcross = 40;  // of an image that are looked at
/// A hand that turns or moves faster blurs images of an ordinary exposure: 60 degrees a second are 18 pixels
/// in 33 ms at a focal length of 525.
constexpr double kFastTurn_rad_s = 60 * kRadiansPerDegree, kFastMove_m_s = 1.0;
/// Depth cameras of these kinds measure from about 0.5 m on.
constexpr double kNear_m = 0.55;
constexpr double kDark = 25;           // mean brightness of 255
constexpr double kLittleDepth = 0.25;  // share of pixels with a reading
constexpr double kSmoothing_s = 0.25;

}  // namespace

FrameLook look_at(const DepthImage& depth, const Image<Rgb8>& color) {
  FrameLook look;
  std::vector<std::uint16_t> readings;
  std::size_t pixels = 0;
  const int depth_step = std::max(1, depth.width() / kSamplesAcross);
  for (int y = depth_step / 2; y < depth.height(); y += depth_step)
    for (int x = depth_step / 2; x < depth.width(); x += depth_step) {
      ++pixels;
      if (const std::uint16_t units = depth.units(x, y); units > 0) readings.push_back(units);
    }
  if (pixels > 0) look.depth_share = static_cast<double>(readings.size()) / static_cast<double>(pixels);
  if (!readings.empty()) {
    const auto middle = readings.begin() + static_cast<std::ptrdiff_t>(readings.size() / 2);
    std::nth_element(readings.begin(), middle, readings.end());
    look.median_depth_m = *middle * depth.unit_m;
  }
  double sum = 0;
  pixels = 0;
  const int color_step = std::max(1, color.width() / kSamplesAcross);
  for (int y = color_step / 2; y < color.height(); y += color_step)
    for (int x = color_step / 2; x < color.width(); x += color_step) {
      const Rgb8 pixel = color(x, y);
      sum += 0.299 * pixel.r + 0.587 * pixel.g + 0.114 * pixel.b;
      ++pixels;
    }
  if (pixels > 0) look.mean_brightness = sum / static_cast<double>(pixels);
  return look;
}

void ScanAdviser::judge_motion(const ScanMoment& moment, std::vector<ScanAdvice>& all) {
  if (!moment.T_map_camera) {
    last_.reset();
    return;
  }
  const double step_s = last_ ? (moment.stamp - last_->stamp).seconds() : 0;
  if (step_s > 0 && step_s < 1) {
    const SE3 motion = last_->T_world_base.inverse() * *moment.T_map_camera;
    const Vec6 twist = motion.log();
    const double share = std::min(1.0, step_s / kSmoothing_s);
    speed_m_s_ += share * (motion.translation().norm() / step_s - speed_m_s_);
    turn_rad_s_ += share * (twist.tail<3>().norm() / step_s - turn_rad_s_);
  } else {
    speed_m_s_ = turn_rad_s_ = 0;
  }
  last_ = StampedPose{moment.stamp, *moment.T_map_camera};
  if (turn_rad_s_ > kFastTurn_rad_s)
    all.push_back({AdviceLevel::kWarning, "turning too fast",
                   fmt::format("{:.0f} deg/s; keep below {:.0f}", turn_rad_s_ / kRadiansPerDegree,
                               kFastTurn_rad_s / kRadiansPerDegree)});
  if (speed_m_s_ > kFastMove_m_s)
    all.push_back({AdviceLevel::kWarning, "moving too fast",
                   fmt::format("{:.1f} m/s; keep below {:.0f}", speed_m_s_, kFastMove_m_s)});
}

std::vector<ScanAdvice> ScanAdviser::advise(const ScanMoment& moment) {
  std::vector<ScanAdvice> all;
  if (!moment.T_map_camera)
    all.push_back({AdviceLevel::kBad, moment.has_frame ? "lost: go back to what was seen" : "no picture",
                   moment.trouble});
  if (moment.has_frame && moment.look) {
    const FrameLook& look = *moment.look;
    if (look.depth_share < kLittleDepth)
      all.push_back({look.depth_share < kLittleDepth / 4 ? AdviceLevel::kBad : AdviceLevel::kWarning,
                     "little depth", fmt::format("{:.0f} % of the pixels measure", 100 * look.depth_share)});
    if (look.median_depth_m && *look.median_depth_m < kNear_m)
      all.push_back({AdviceLevel::kWarning, "too near",
                     fmt::format("{:.2f} m; keep {:.1f} m away", *look.median_depth_m, kNear_m)});
    if (look.mean_brightness && *look.mean_brightness < kDark)
      all.push_back({AdviceLevel::kWarning, "too dark",
                     fmt::format("brightness {:.0f} of 255", *look.mean_brightness)});
  }
  judge_motion(moment, all);
  std::stable_sort(all.begin(), all.end(),
                   [](const ScanAdvice& a, const ScanAdvice& b) { return a.level > b.level; });
  return all;
}

}  // namespace hm
