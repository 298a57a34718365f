#include "hm/pipeline/checks/color_shift.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace hm {
namespace {

constexpr std::size_t kMaxEdgesPerFrame = 4000;
constexpr std::size_t kScaledEdgesPerFrame = 1000;
constexpr std::size_t kMinEdges = 500;
constexpr std::size_t kMinEdgesOfTile = 20;

int luminance(const Rgb8& c) { return (77 * c.r + 150 * c.g + 29 * c.b) >> 8; }

/// True between two valid depths that differ by more than a tenth: the border of something.
bool is_edge(std::uint16_t a, std::uint16_t b) {
  return a > 0 && b > 0 && 10 * std::abs(static_cast<int>(a) - static_cast<int>(b)) > std::min(a, b);
}

}  // namespace

Image<std::uint8_t> color_gradient(const Image<Rgb8>& color) {
  constexpr int kCap = 60;
  Image<std::uint8_t> result(color.width(), color.height());
  for (int y = 1; y + 1 < color.height(); ++y)
    for (int x = 1; x + 1 < color.width(); ++x) {
      const int sum = std::abs(luminance(color(x + 1, y)) - luminance(color(x - 1, y))) +
                      std::abs(luminance(color(x, y + 1)) - luminance(color(x, y - 1)));
      result(x, y) = static_cast<std::uint8_t>(std::min(sum, kCap));
    }
  return result;
}

ColorShiftEstimator::ColorShiftEstimator()
    : sums_(static_cast<std::size_t>(kSide * kSide), 0.0),
      scaled_sums_(static_cast<std::size_t>((2 * kScales + 1) * kCoarseSide * kCoarseSide), 0.0) {}

void ColorShiftEstimator::add_scales(const std::vector<std::pair<int, int>>& edges,
                                     const Image<std::uint8_t>& colors) {
  const double middle_x = (colors.width() - 1) / 2.0, middle_y = (colors.height() - 1) / 2.0;
  const std::size_t step = edges.size() / kScaledEdgesPerFrame + 1;
  for (std::size_t i = 0; i < edges.size(); i += step) {
    const auto [x, y] = edges[i];
    scaled_none_ += colors(x, y);
    std::size_t place = 0;
    for (int scale = -kScales; scale <= kScales; ++scale) {
      const double ratio = 1 + scale * kScaleStep;
      const auto at_x = static_cast<int>(std::lround(middle_x + ratio * (x - middle_x)));
      const auto at_y = static_cast<int>(std::lround(middle_y + ratio * (y - middle_y)));
      for (int dy = -kReach_px; dy <= kReach_px; dy += kCoarseStep_px)
        for (int dx = -kReach_px; dx <= kReach_px; dx += kCoarseStep_px, ++place)
          if (colors.contains(at_x + dx, at_y + dy)) scaled_sums_[place] += colors(at_x + dx, at_y + dy);
    }
  }
}

void ColorShiftEstimator::add(const RgbdFrame& frame) {
  if (frame.color.empty()) return;
  const Image<std::uint16_t>& depth = frame.depth.units;
  std::vector<std::pair<int, int>> edges;
  for (int y = kReach_px; y + kReach_px < depth.height(); ++y)
    for (int x = kReach_px; x + kReach_px < depth.width(); ++x)
      if (is_edge(depth(x - 1, y), depth(x + 1, y)) || is_edge(depth(x, y - 1), depth(x, y + 1)))
        edges.emplace_back(x, y);
  for (const auto& [x, y] : edges) ++edges_of_tile_[ImageTiles::at(x, y, depth.width(), depth.height())];
  const Image<std::uint8_t> colors = color_gradient(frame.color);
  add_scales(edges, colors);
  const std::size_t step = edges.size() / kMaxEdgesPerFrame + 1;
  for (std::size_t i = 0; i < edges.size(); i += step) {
    ++edges_;
    std::size_t place = 0;
    for (int dy = -kReach_px; dy <= kReach_px; ++dy)
      for (int dx = -kReach_px; dx <= kReach_px; ++dx)
        sums_[place++] += colors(edges[i].first + dx, edges[i].second + dy);
  }
}

/// The scale whose best shift has the largest sum, if that is clearly larger than without a scale.
std::optional<ColorShift> ColorShiftEstimator::best_scaled() const {
  constexpr double kMinGain_ratio = 1.2;
  constexpr std::ptrdiff_t kPlane = kCoarseSide * kCoarseSide;
  const auto begin = scaled_sums_.begin();
  const auto most = std::ranges::max_element(scaled_sums_) - begin;
  const double unscaled = *std::max_element(begin + kScales * kPlane, begin + (kScales + 1) * kPlane);
  const double largest = scaled_sums_[static_cast<std::size_t>(most)];
  if (scaled_none_ <= 0 || largest < kMinGain_ratio * unscaled) return std::nullopt;
  const auto at = static_cast<int>(most % kPlane);
  return ColorShift{at % kCoarseSide * kCoarseStep_px - kReach_px,
                    at / kCoarseSide * kCoarseStep_px - kReach_px, largest / scaled_none_,
                    1 + (static_cast<int>(most / kPlane) - kScales) * kScaleStep, true};
}

ColorShift ColorShiftEstimator::best() const {
  constexpr std::size_t kMiddle = static_cast<std::size_t>(kSide * kSide / 2);
  const auto seen_tiles =
      std::ranges::count_if(edges_of_tile_, [](std::size_t edges) { return edges >= kMinEdgesOfTile; });
  if (edges_ < kMinEdges || static_cast<std::size_t>(seen_tiles) < ImageTiles::kMinSeen ||
      sums_[kMiddle] <= 0)
    return {};
  if (const auto scaled = best_scaled()) return *scaled;
  const auto most = static_cast<int>(std::ranges::max_element(sums_) - sums_.begin());
  return {most % kSide - kReach_px, most / kSide - kReach_px,
          sums_[static_cast<std::size_t>(most)] / sums_[kMiddle], 1, true};
}

}  // namespace hm
