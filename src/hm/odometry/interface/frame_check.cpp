#include "hm/odometry/interface/frame_check.hpp"

#include <fmt/format.h>

namespace hm {

std::string reason_to_skip(const RgbdFrame& frame, const PinholeCamera& camera,
                           const std::optional<Time>& last_stamp, ColorNeed need) {
  const bool has_color = !frame.color.empty();
  if (!has_color && need == ColorNeed::kAlways) return "no colour image";
  if ((has_color && (frame.color.width() != camera.width || frame.color.height() != camera.height)) ||
      frame.depth.width() != camera.width || frame.depth.height() != camera.height)
    return fmt::format("images of {}x{} (colour) and {}x{} (depth), camera of {}x{}", frame.color.width(),
                       frame.color.height(), frame.depth.width(), frame.depth.height(), camera.width,
                       camera.height);
  if (last_stamp && !(frame.stamp > *last_stamp))
    return fmt::format("stamp {:.6f} s is not after {:.6f} s", frame.stamp.seconds(), last_stamp->seconds());
  return {};
}

std::string too_few_features(const TrackingNumbers& numbers, int needed) {
  return fmt::format("{} features with depth of {}, {} needed to begin; sharpness {:.1f}, depth in {:.0f} %",
                     numbers.features_with_depth, numbers.features, needed, numbers.sharpness,
                     100 * numbers.depth_coverage_ratio);
}

std::string why_lost(const std::string& refusal, std::size_t features, int keyframe_matches,
                     const TrackingNumbers& numbers, const std::string& depth_refusal) {
  return fmt::format("{}; {} features, {} match a keyframe at most; sharpness {:.1f}, depth in {:.0f} %{}{}",
                     refusal, features, keyframe_matches, numbers.sharpness,
                     100 * numbers.depth_coverage_ratio, depth_refusal.empty() ? "" : "; ", depth_refusal);
}

Result<RgbdFrame> read_again(std::size_t frame_index, const PinholeCamera& camera,
                             const OdometryHistory& history) {
  auto frame = history.read_frame(frame_index);
  if (!frame) return frame;
  if (const std::string reason = reason_to_skip(*frame, camera, {}, ColorNeed::kIfPresent); !reason.empty())
    return fail(ErrorCode::kInvalidValue, fmt::format("frame {}", frame_index), "{}", reason);
  return frame;
}

}  // namespace hm
