#include "hm/report/render/color_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace hm {
namespace {

constexpr std::size_t kTableSize = 512;
using Table = std::array<Vec3, kTableSize>;

double srgb_curve(double linear) {
  linear = std::clamp(linear, 0.0, 1.0);
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

Vec3 lightness_chroma_hue(double lightness, double chroma, double hue_deg) {
  const double hue = hue_deg * M_PI / 180;
  return {lightness, chroma * std::cos(hue), chroma * std::sin(hue)};
}

template <class Make>
Table make_table(Make&& make) {
  Table table;
  for (std::size_t i = 0; i < kTableSize; ++i)
    table[i] = oklab_to_srgb(make(static_cast<double>(i) / (kTableSize - 1)));
  return table;
}

Vec3 look_up(const Table& table, double unit) {
  if (!(unit > 0)) return table.front();
  const double at = std::min(unit, 1.0) * (kTableSize - 1);
  return table[static_cast<std::size_t>(at + 0.5)];
}

}  // namespace

Vec3 oklab_to_srgb(const Vec3& lab) {
  const double l = std::pow(lab[0] + 0.3963377774 * lab[1] + 0.2158037573 * lab[2], 3);
  const double m = std::pow(lab[0] - 0.1055613458 * lab[1] - 0.0638541728 * lab[2], 3);
  const double s = std::pow(lab[0] - 0.0894841775 * lab[1] - 1.2914855480 * lab[2], 3);
  return {srgb_curve(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s),
          srgb_curve(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s),
          srgb_curve(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s)};
}

Vec3 sequential_color(double value) {
  static const Table table = make_table([](double t) {
    return lightness_chroma_hue(0.34 + 0.58 * t, 0.095 + 0.05 * (2 * t - 1) * (2 * t - 1), 290 - 190 * t);
  });
  return look_up(table, value);
}

Vec3 diverging_color(double value) {
  static const Table table = make_table([](double t) {
    const double side = 2 * t - 1, away = std::abs(side);
    return lightness_chroma_hue(0.93 - 0.42 * away, 0.19 * std::pow(away, 0.9), side < 0 ? 258 : 27);
  });
  return look_up(table, 0.5 * (value + 1));
}

Rgb8 to_rgb8(const Vec3& color) {
  const auto channel = [](double v) {
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0, 1.0)));
  };
  return {channel(color.x()), channel(color.y()), channel(color.z())};
}

}  // namespace hm
