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
    flaws.bits_ |= word == kAllFlaws ? (1U << std::size(kFlawNames)) - 1 : 1U << static_cast<unsigned>(index);
  }
  return flaws;
}

FlawSizes draw_flaws(const Flaws& flaws, std::uint64_t seed) {
  Rng rng(seed, 0x666c617773);
  FlawSizes all;  // every size is drawn, so that one flaw does not change another
  all.exposure_s = rng.uniform(0.008, 0.02);
  all.readout_s = rng.uniform(0.015, 0.03);
  all.exposure_lag_s = rng.uniform(0.2, 0.6);
  all.white_balance_ratio = rng.uniform(0.2, 0.5);
  all.focal_x_ratio = signed_size(rng, 0.0025, 0.0045);
  all.focal_y_ratio = all.focal_x_ratio + rng.uniform(-0.0005, 0.0005);
  all.center_x_ratio = rng.uniform(-0.005, 0.005);
  all.center_y_ratio = rng.uniform(-0.005, 0.005);
  const double shift_px = rng.uniform(1, 3), along_rad = rng.uniform(0, 2 * std::numbers::pi);
  all.color_shift_x_px = shift_px * std::cos(along_rad);
  all.color_shift_y_px = shift_px * std::sin(along_rad);
  all.color_baseline_m = signed_size(rng, 0.001, 0.004);
  all.bend_at_3m_m = signed_size(rng, 0.01, 0.03);
  all.color_delay_s = rng.uniform(0.005, 0.02);
  all.glass_angle_rad = rng.uniform(0.3, 0.6);
  all.people = 1 + static_cast<int>(rng.below(3));

  FlawSizes sizes;
  sizes.flaws = all.flaws = flaws;
  // Copies the sizes that belong to the flaws, and those only: both visits name the same members.
  ParamList from, to;
  from.add("flaws", all);
  to.add("flaws", sizes);
  for (std::size_t i = 0; i < to.all().size(); ++i) {
    if (double* const* size = std::get_if<double*>(&to.all()[i].value))
      **size = **std::get_if<double*>(&from.all()[i].value);
    else
      sizes.people = all.people;
  }
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
