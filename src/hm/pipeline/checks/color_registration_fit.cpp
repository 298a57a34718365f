#include "hm/pipeline/checks/color_registration_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "hm/core/statistics.hpp"
#include "hm/pipeline/checks/color_shift.hpp"

namespace hm {
namespace {

constexpr std::size_t kFrames = 24;
/// Two depths that differ by more, with at most so many pixels without a reading between them, have a border.
constexpr double kBorder_ratio = 0.1;
constexpr int kMostGap_px = 4;
constexpr std::size_t kBordersPerFrame = 3000;
constexpr std::size_t kMinBorders = 2000;
/// Less gain may be chance: registered recordings have 1.0 to 1.1, but a second of one up to 1.7.
constexpr double kMinGain_ratio = 1.5;
constexpr double kMinSpan_s = 1.5;
/// So much is gained in three quarters of the image's tiles that have borders.
constexpr std::size_t kMinBordersOfTile = 50;
constexpr double kMinTileGain_ratio = 1.15;
/// Halves of the frames must agree to so much, and the registration must move pixels by as much as that, at
/// the corners of the image and the median depth.
constexpr double kSame_px = 4;

/// A border's pixel and the inverse depth of the nearer side, whose colour edge it is.
struct Border {
  std::size_t image = 0;
  Vec2 pixel = Vec2::Zero();
  double inverse_depth = 0;
};

/// Borders of depth, and the gradients of the colour images.
struct Borders {
  std::vector<Image<std::uint8_t>> gradients;
  std::vector<Border> all;
  Vec2 principal_point = Vec2::Zero();
};

/// Appends the borders along a line of the depth image, whose pixel k is at from + k step.
void add_borders_of_line(const DepthImage& depth, Eigen::Vector2i from, Eigen::Vector2i step, int count,
                         std::size_t image, std::vector<Border>& borders) {
  int last = -1;  // pixel with a reading
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector2i at = from + k * step;
    const double here_m = depth.depth_m(at.x(), at.y());
    if (here_m <= 0) continue;
    if (last >= 0 && k - last <= kMostGap_px) {
      const Eigen::Vector2i before = from + last * step;
      const double before_m = depth.depth_m(before.x(), before.y());
      if (std::abs(here_m - before_m) > kBorder_ratio * std::min(here_m, before_m)) {
        const bool here_is_nearer = here_m < before_m;
        const double place = here_is_nearer ? k - 0.5 : last + 0.5;
        borders.push_back(
            {image, from.cast<double>() + place * step.cast<double>(), 1 / std::min(here_m, before_m)});
      }
    }
    last = k;
  }
}

void add_frame(const RgbdFrame& frame, Borders& borders) {
  std::vector<Border> found;
  const DepthImage& depth = frame.depth;
  const std::size_t image = borders.gradients.size();
  for (int y = 0; y < depth.height(); ++y)
    add_borders_of_line(depth, {0, y}, {1, 0}, depth.width(), image, found);
  for (int x = 0; x < depth.width(); ++x)
    add_borders_of_line(depth, {x, 0}, {0, 1}, depth.height(), image, found);
  found = thinned(std::move(found), kBordersPerFrame);
  borders.all.insert(borders.all.end(), found.begin(), found.end());
  borders.gradients.push_back(color_gradient(frame.color));
}

Borders borders_of(const Recording& recording) {
  Borders borders;
  const PinholeCamera camera = recording.camera();
  borders.principal_point = {camera.cx, camera.cy};
  const std::size_t count = recording.info().frame_count;
  for (std::size_t i = 0; i < std::min(kFrames, count); ++i) {
    const auto frame = recording.read(i * count / std::min(kFrames, count));
    if (frame && !frame->color.empty()) add_frame(*frame, borders);
  }
  return borders;
}

/// Mean gradient at the borders, bilinear; none outside of the image.
double score(const Borders& borders, const std::vector<Border>& of, const ColorRegistration& registration) {
  double sum = 0;
  for (const Border& border : of) {
    const Image<std::uint8_t>& gradient = borders.gradients[border.image];
    const Vec2 at = registration.color_pixel(border.pixel, borders.principal_point, border.inverse_depth);
    const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
    if (!gradient.contains(x, y) || !gradient.contains(x + 1, y + 1)) continue;
    const double right = at.x() - x, down = at.y() - y;
    sum += (1 - down) * ((1 - right) * gradient(x, y) + right * gradient(x + 1, y)) +
           down * ((1 - right) * gradient(x, y + 1) + right * gradient(x + 1, y + 1));
  }
  return of.empty() ? 0 : sum / static_cast<double>(of.size());
}

ColorRegistration best_of_grid(const Borders& borders, const std::vector<Border>& of) {
  constexpr double kWidest_ratio = 0.16, kScaleStep = 0.02, kReach_px = 12, kStep_px = 4, kParallax_px_m = 15;
  ColorRegistration best;
  double best_score = score(borders, of, best);
  for (double scale = 1 - kWidest_ratio; scale < 1 + kWidest_ratio + 1e-9; scale += kScaleStep)
    for (double parallax = -kParallax_px_m; parallax <= kParallax_px_m; parallax += kParallax_px_m)
      for (double right = -kReach_px; right <= kReach_px; right += kStep_px)
        for (double down = -kReach_px; down <= kReach_px; down += kStep_px) {
          const ColorRegistration tried{scale, {right, down}, parallax};
          const double value = score(borders, of, tried);
          if (value > best_score) best_score = value, best = tried;
        }
  return best;
}

/// Steps of one unknown, or of shift and parallax against each other, whose effects are alike; halved until
/// nothing improves.
ColorRegistration refined(const Borders& borders, const std::vector<Border>& of, ColorRegistration best) {
  constexpr double kFinest_px = 0.1, kFirst_px = 2, kScalePerPx = 0.005, kParallaxPerPx = 2.5;
  using Move = std::array<double, 4>;  // scale, right, down, parallax
  constexpr std::array<Move, 6> kMoves{
      {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}, {0, 1, 0, -1}, {1, -1, 0, 0}}};
  double best_score = score(borders, of, best);
  for (double step_px = kFirst_px; step_px >= kFinest_px;) {
    bool improved = false;
    for (const Move& move : kMoves)
      for (const double step : {step_px, -step_px}) {
        ColorRegistration tried = best;
        tried.scale_ratio += kScalePerPx * step * move[0];
        tried.shift_px += step * Vec2(move[1], move[2]);
        tried.parallax_px_m += kParallaxPerPx * step * move[3];
        const double value = score(borders, of, tried);
        if (value > best_score) best_score = value, best = tried, improved = true;
      }
    if (!improved) step_px /= 2;
  }
  return best;
}

/// Largest distance of the pixels to which two registrations bring the image's corners at a depth.
double distance_px(const ColorRegistration& a, const ColorRegistration& b, const PinholeCamera& camera,
                   double inverse_depth) {
  const Vec2 principal_point(camera.cx, camera.cy);
  double largest = 0;
  for (const double x : {0.0, camera.width - 1.0})
    for (const double y : {0.0, camera.height - 1.0})
      largest = std::max(largest, (a.color_pixel({x, y}, principal_point, inverse_depth) -
                                   b.color_pixel({x, y}, principal_point, inverse_depth))
                                      .norm());
  return largest;
}

double median_inverse_depth(const std::vector<Border>& borders) {
  std::vector<double> values;
  for (const Border& border : borders) values.push_back(border.inverse_depth);
  return middle_value(std::span(values));
}

/// Gain of a registration that is exceeded in three quarters of the image's tiles; 0 where too few of them
/// have borders.
double gain_all_over(const Borders& borders, const ColorRegistration& registration,
                     const PinholeCamera& camera) {
  std::array<std::vector<Border>, ImageTiles::kCount> tiles;
  for (const Border& border : borders.all)
    tiles[ImageTiles::at(border.pixel.x(), border.pixel.y(), camera.width, camera.height)].push_back(border);
  std::vector<double> gains;
  for (const std::vector<Border>& tile : tiles)
    if (tile.size() >= kMinBordersOfTile)
      gains.push_back(score(borders, tile, registration) / std::max(1e-9, score(borders, tile, {})));
  if (gains.size() < ImageTiles::kMinSeen) return 0;
  std::ranges::nth_element(gains, gains.begin() + static_cast<std::ptrdiff_t>(gains.size() / 4));
  return gains[gains.size() / 4];
}

double span_s(const RecordingInfo& info) {
  return info.stamps.empty() ? 0 : (info.stamps.back() - info.stamps.front()).seconds();
}

/// Those of every other image.
std::vector<Border> half_of(const std::vector<Border>& borders, std::size_t parity) {
  std::vector<Border> half;
  std::ranges::copy_if(borders, std::back_inserter(half),
                       [&](const Border& border) { return border.image % 2 == parity; });
  return half;
}

class RegisteredRecording final : public Recording {
 public:
  RegisteredRecording(std::unique_ptr<Recording> recording, const ColorRegistration& registration)
      : recording_(std::move(recording)), registration_(registration) {}
  [[nodiscard]] const RecordingInfo& info() const override { return recording_->info(); }
  [[nodiscard]] PinholeCamera camera() const override { return recording_->camera(); }
  [[nodiscard]] Result<RgbdFrame> read(std::size_t index) const override {
    auto frame = recording_->read(index);
    if (frame && !frame->color.empty())
      frame->color = register_color(frame->color, frame->depth, camera(), registration_);
    return frame;
  }
  [[nodiscard]] Result<RgbdFrame> read_depth(std::size_t index) const override {
    return recording_->read_depth(index);
  }

 private:
  std::unique_ptr<Recording> recording_;
  ColorRegistration registration_;
};

}  // namespace

std::optional<FittedRegistration> fit_color_registration(const Recording& recording) {
  if (recording.info().has_own_stamps && span_s(recording.info()) < kMinSpan_s) return std::nullopt;
  const Borders borders = borders_of(recording);
  if (borders.all.size() < kMinBorders) return std::nullopt;
  constexpr std::size_t kCoarseBorders = 4000;
  const ColorRegistration start = best_of_grid(borders, thinned(borders.all, kCoarseBorders));
  const ColorRegistration best = refined(borders, borders.all, start);
  const double before = score(borders, borders.all, {});
  const double gain = before > 0 ? score(borders, borders.all, best) / before : 0;
  if (gain < kMinGain_ratio) return std::nullopt;
  const PinholeCamera camera = recording.camera();
  if (gain_all_over(borders, best, camera) < kMinTileGain_ratio) return std::nullopt;
  const double inverse_depth = median_inverse_depth(borders.all);
  if (distance_px(best, {}, camera, inverse_depth) < kSame_px) return std::nullopt;
  for (const std::size_t parity : {0, 1}) {
    const ColorRegistration by_half = refined(borders, half_of(borders.all, parity), start);
    if (distance_px(best, by_half, camera, inverse_depth) > kSame_px) return std::nullopt;
  }
  return FittedRegistration{best, gain};
}

std::unique_ptr<Recording> with_registered_color(std::unique_ptr<Recording> recording,
                                                 const ColorRegistration& registration) {
  return std::make_unique<RegisteredRecording>(std::move(recording), registration);
}

std::string to_string(const FittedRegistration& fitted, const PinholeCamera& depth_camera) {
  const ColorRegistration& r = fitted.registration;
  const double focal_px = r.scale_ratio * depth_camera.fx;
  const double left_m = r.parallax_px_m / focal_px;
  return fmt::format(
      "colour was not registered to depth and is now, as depth borders and colour edges show it: a colour "
      "camera of focal length {:.0f} px, principal point {:.0f} {:.0f} px, {:.0f} mm to the {} of the depth "
      "camera; edges match {:.2f} times as well as before",
      focal_px, depth_camera.cx + r.shift_px.x(), depth_camera.cy + r.shift_px.y(), 1e3 * std::abs(left_m),
      left_m > 0 ? "left" : "right", fitted.gain_ratio);
}

}  // namespace hm
