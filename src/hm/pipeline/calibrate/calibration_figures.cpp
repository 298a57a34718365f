#include "hm/pipeline/calibrate/calibration_figures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/report/render/canvas.hpp"
#include "hm/report/render/color_map.hpp"

namespace hm {
namespace {

constexpr Rgb8 kPaper{250, 250, 248}, kInk{45, 50, 60}, kFaint{205, 207, 210};
constexpr int kWidth_px = 960, kFooter_px = 34;
constexpr double kText_px = 13;

/// A drawing of a camera's image, with a line for words below.
struct Sheet {
  Image<Rgb8> image;
  double scale = 1;
  int height_px = 0;
  Sheet(int width, int height)
      : scale(static_cast<double>(kWidth_px) / width),
        height_px(static_cast<int>(std::lround(height * scale))) {
    image = Image<Rgb8>(kWidth_px, height_px + kFooter_px, kPaper);
  }
  [[nodiscard]] Vec2 at(const Vec2& pixel) const { return (pixel + Vec2(0.5, 0.5)) * scale - Vec2(0.5, 0.5); }
  void say(const std::string& words) {
    fill_rectangle(image, {Vec2(0, height_px), Vec2(kWidth_px, height_px + kFooter_px)}, {kPaper, 1});
    draw_text(image, Vec2(10, height_px + 22), words, {kText_px, {kInk, 1}, TextAlign::kLeft});
  }
};

}  // namespace

Image<Rgb8> draw_error_vectors(std::span<const CornerResidual> corners, int width, int height) {
  Sheet sheet(width, height);
  std::vector<double> lengths;
  for (const CornerResidual& corner : corners) lengths.push_back(corner.error_px.norm());
  const double large = std::max(1e-6, quantile(lengths, 0.95));
  const double longer = 18 / large;  // the 95 % error becomes 18 px of the drawing
  for (const CornerResidual& corner : corners) {
    const Vec2 from = sheet.at(corner.pixel), to = from + longer * corner.error_px;
    const Ink ink{to_rgb8(sequential_color(0.75 * std::min(1.0, corner.error_px.norm() / large))), 0.85};
    draw_line(sheet.image, from, to, 1.5, ink);
    fill_circle(sheet.image, from, 1.6, ink);
  }
  sheet.say(fmt::format("{} corners; a line of 18 px is an error of {:.3f} px (95 % are shorter)",
                        corners.size(), large));
  return std::move(sheet.image);
}

Image<Rgb8> draw_coverage(std::span<const CornerResidual> corners, int width, int height) {
  constexpr int kCellsX = 12, kCellsY = 9;
  Sheet sheet(width, height);
  Image<double> counts(kCellsX, kCellsY, 0.0);
  for (const CornerResidual& corner : corners) {
    const int x = std::clamp(static_cast<int>((corner.pixel.x() + 0.5) / width * kCellsX), 0, kCellsX - 1);
    const int y = std::clamp(static_cast<int>((corner.pixel.y() + 0.5) / height * kCellsY), 0, kCellsY - 1);
    ++counts(x, y);
  }
  const double most = std::max(1.0, *std::ranges::max_element(counts.pixels()));
  const double cell_w = static_cast<double>(kWidth_px) / kCellsX,
               cell_h = static_cast<double>(sheet.height_px) / kCellsY;
  int empty = 0;
  for (int y = 0; y < kCellsY; ++y)
    for (int x = 0; x < kCellsX; ++x) {
      const Vec2 corner(x * cell_w, y * cell_h);
      const bool none = counts(x, y) == 0;
      empty += none ? 1 : 0;
      const Rgb8 color =
          none ? kFaint : to_rgb8(sequential_color(0.15 + 0.8 * std::sqrt(counts(x, y) / most)));
      fill_rectangle(sheet.image, {corner, corner + Vec2(cell_w - 1.5, cell_h - 1.5)}, {color, 1});
    }
  for (const CornerResidual& corner : corners)
    fill_circle(sheet.image, sheet.at(corner.pixel), 1.3, {kInk, 0.6});
  sheet.say(fmt::format("corners in each cell, up to {:.0f}; {} of {} cells have none (grey)", most, empty,
                        kCellsX * kCellsY));
  return std::move(sheet.image);
}

double largest_correction_m(const DepthCorrectionModel& model) {
  double largest = 0;
  for (const double z : {model.min_depth_m, (model.min_depth_m + model.max_depth_m) / 2, model.max_depth_m})
    for (int y = 0; y < model.height; y += 8)
      for (int x = 0; x < model.width; x += 8)
        largest = std::max(largest, std::abs(model.correction_m(Vec2(x, y), z)));
  return largest;
}

Image<Rgb8> draw_correction(const DepthCorrectionModel& model, double depth_m, double full_m) {
  constexpr int kStep = 2;
  Sheet sheet(model.width, model.height);
  for (int y = 0; y < model.height; y += kStep)
    for (int x = 0; x < model.width; x += kStep) {
      const double value = model.correction_m(Vec2(x, y), depth_m) / std::max(full_m, 1e-9);
      fill_rectangle(sheet.image,
                     {sheet.at(Vec2(x - 0.5, y - 0.5)), sheet.at(Vec2(x + kStep - 0.5, y + kStep - 0.5))},
                     {to_rgb8(diverging_color(value)), 1});
    }
  sheet.say(fmt::format("added to readings of {:.2f} m: blue {:.1f} mm, grey 0, red +{:.1f} mm", depth_m,
                        -1e3 * full_m, 1e3 * full_m));
  return std::move(sheet.image);
}

}  // namespace hm
