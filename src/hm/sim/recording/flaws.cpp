#include "hm/sim/recording/flaws.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <vector>

#include "hm/core/text/known_words.hpp"

namespace hm {
namespace {

constexpr std::string_view kAllFlaws = "all";

/// Uniform in [low, high) or in (-high, -low].
double signed_size(Rng& rng, double low, double high) {
  const double size = rng.uniform(low, high);
  return rng.uniform() < 0.5 ? -size : size;
}

}  // namespace

Result<Flaws> Flaws::parse(std::string_view names) {
  std::vector<std::string_view> known(std::begin(kFlawNames), std::end(kFlawNames));
  known.push_back(kAllFlaws);
  const KnownWords found = known_words(names, known);
  if (!found.unknown.empty())
    return fail(ErrorCode::kUsage, "parameters", "simulation.flaws names '{}'; known are {}", found.unknown,
                fmt::join(known, ", "));
  Flaws flaws;
  for (const std::string& word : found.words) {
    const auto index = std::ranges::find(kFlawNames, word) - std::begin(kFlawNames);
    flaws.bits_ |= word == kAllFlaws ? (1U << kRealisticFlaws) - 1 : 1U << static_cast<unsigned>(index);
  }
  return flaws;
}

FlawSizes draw_flaws(const Flaws& flaws, std::uint64_t seed) {
  Rng rng(seed, 0x666c617773);
  FlawSizes sizes;  // every size is drawn, so that one flaw does not change another
  sizes.exposure_s = rng.uniform(0.008, 0.02);
  sizes.readout_s = rng.uniform(0.015, 0.03);
  sizes.exposure_lag_s = rng.uniform(0.2, 0.6);
  sizes.white_balance_ratio = rng.uniform(0.2, 0.5);
  sizes.focal_x_ratio = signed_size(rng, 0.0025, 0.0045);
  sizes.focal_y_ratio = sizes.focal_x_ratio + rng.uniform(-0.0005, 0.0005);
  sizes.center_x_ratio = rng.uniform(-0.005, 0.005);
  sizes.center_y_ratio = rng.uniform(-0.005, 0.005);
  const double shift_px = rng.uniform(1, 3), along_rad = rng.uniform(0, 2 * std::numbers::pi);
  sizes.color_shift_x_px = shift_px * std::cos(along_rad);
  sizes.color_shift_y_px = shift_px * std::sin(along_rad);
  sizes.color_baseline_m = signed_size(rng, 0.001, 0.004);
  sizes.bend_at_3m_m = signed_size(rng, 0.01, 0.03);
  sizes.color_delay_s = rng.uniform(0.005, 0.02);
  sizes.glass_angle_rad = rng.uniform(0.3, 0.6);
  sizes.people = 1 + static_cast<int>(rng.below(3));
  sizes.color_focal_ratio = -0.1;
  sizes.color_beside_m = 0.03;
  sizes.short_at_1m_ratio = 0.04;
  const auto only_for = [&](Flaw flaw, auto&... of_it) {
    if (!flaws.has(flaw)) ((of_it = 0), ...);
  };
  only_for(Flaw::kBlur, sizes.exposure_s);
  only_for(Flaw::kRollingShutter, sizes.readout_s);
  only_for(Flaw::kExposure, sizes.exposure_lag_s, sizes.white_balance_ratio);
  only_for(Flaw::kIntrinsics, sizes.focal_x_ratio, sizes.focal_y_ratio, sizes.center_x_ratio,
           sizes.center_y_ratio);
  only_for(Flaw::kRegistration, sizes.color_shift_x_px, sizes.color_shift_y_px, sizes.color_baseline_m);
  only_for(Flaw::kDepthBend, sizes.bend_at_3m_m);
  only_for(Flaw::kTimeOffset, sizes.color_delay_s);
  only_for(Flaw::kGlass, sizes.glass_angle_rad);
  only_for(Flaw::kPeople, sizes.people);
  only_for(Flaw::kUnregistered, sizes.color_focal_ratio, sizes.color_beside_m);
  only_for(Flaw::kShortDepth, sizes.short_at_1m_ratio);
  sizes.flaws = flaws;
  return sizes;
}

PinholeCamera true_camera(const PinholeCamera& stated, const FlawSizes& sizes) {
  PinholeCamera camera = stated;
  camera.fx *= 1 + sizes.focal_x_ratio;
  camera.fy *= 1 + sizes.focal_y_ratio;
  camera.cx += sizes.center_x_ratio * stated.width;
  camera.cy += sizes.center_y_ratio * stated.width;
  return camera;
}

}  // namespace hm
