#include "hm/odometry/feature/corner_detection.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace hm {

namespace {

constexpr int kFastThreshold = 16;      ///< everywhere
constexpr int kFastThresholdFaint = 5;  ///< in cells where the other finds too few
constexpr int kScoreRadius_px = 3;
constexpr int kScoredPerWanted = 3;  ///< FAST corners of a cell that get a Shi-Tomasi score, by its share
/// A corner scores so many times the variance of the noise, whose windows score about 1.6 times it; noise
/// also imitates corners on edges, which fit anywhere along them. Its variance is that of the fifth of a grid
/// of windows, so far apart, that have least.
constexpr double kLeastScoreByNoise = 8, kNoisyShare = 0.2;
constexpr int kNoiseStep_px = 16;
constexpr double kMaxRefinement_px = 3;
constexpr int kMaxRefinements = 3;

struct Candidate {
  int x = 0, y = 0;
  float fast_response = 0;
  float score = 0;
};

bool by_place(const Candidate& a, const Candidate& b) { return a.y != b.y ? a.y < b.y : a.x < b.x; }

cv::Mat matrix_over(const Image<std::uint8_t>& image) {
  return {image.height(), image.width(), CV_8UC1, const_cast<std::uint8_t*>(image.data())};
}

/// Corner candidates of every cell of one image.
class CellGrid {
 public:
  CellGrid(const cv::Mat& gray, int cell_px)
      : gray_(gray),
        cell_px_(cell_px),
        inner_(kCornerBorder_px, kCornerBorder_px, gray.cols - 2 * kCornerBorder_px,
               gray.rows - 2 * kCornerBorder_px),
        columns_((inner_.width + cell_px - 1) / cell_px),
        rows_((inner_.height + cell_px - 1) / cell_px),
        cells_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)) {}

  [[nodiscard]] std::size_t size() const { return cells_.size(); }
  std::vector<Candidate>& operator[](std::size_t i) { return cells_[i]; }

  /// Runs FAST on the image, then with a lower threshold on cells with fewer than `least` corners.
  void find(std::size_t least) {
    detect(inner_, kFastThreshold);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      if (cells_[i].size() >= least) continue;
      cells_[i].clear();
      detect(cell_rectangle(static_cast<int>(i)), kFastThresholdFaint);
    }
  }

 private:
  [[nodiscard]] cv::Rect cell_rectangle(int index) const {
    const cv::Point corner(inner_.x + index % columns_ * cell_px_, inner_.y + index / columns_ * cell_px_);
    return cv::Rect(corner, cv::Size(cell_px_, cell_px_)) & inner_;
  }

  void detect(const cv::Rect& rectangle, int threshold) {
    // FAST leaves out 3 pixels around its image, suppression of neighbours one more on each side.
    const cv::Rect with_margin(rectangle.x - 4, rectangle.y - 4, rectangle.width + 8, rectangle.height + 8);
    cv::FAST(gray_(with_margin), keypoints_, threshold, true);
    for (const cv::KeyPoint& keypoint : keypoints_) {
      const int x = static_cast<int>(keypoint.pt.x) + with_margin.x;
      const int y = static_cast<int>(keypoint.pt.y) + with_margin.y;
      if (!rectangle.contains({x, y})) continue;
      const int cell = (y - inner_.y) / cell_px_ * columns_ + (x - inner_.x) / cell_px_;
      cells_[static_cast<std::size_t>(cell)].push_back({x, y, keypoint.response});
    }
  }

  cv::Mat gray_;
  int cell_px_;
  cv::Rect inner_;
  int columns_, rows_;
  std::vector<std::vector<Candidate>> cells_;
  std::vector<cv::KeyPoint> keypoints_;
};

/// Second moments of the gradients g around a pixel, and the sum of g g^T d over its offsets d.
struct GradientMoments {
  double xx = 0, xy = 0, yy = 0;
  Vec2 crossing = Vec2::Zero();

  /// Shi and Tomasi's score: the smaller eigenvalue, per pixel.
  [[nodiscard]] double score() const {
    constexpr double kPixels = (2 * kScoreRadius_px + 1) * (2 * kScoreRadius_px + 1);
    return (0.5 * (xx + yy) - std::hypot(0.5 * (xx - yy), xy)) / kPixels;
  }
  /// Offset from the pixel to the least-squares intersection of the window's edges; nothing without two edge
  /// directions.
  [[nodiscard]] std::optional<Vec2> shift() const {
    const double determinant = xx * yy - xy * xy;
    if (determinant <= 1e-3 * xx * yy) return std::nullopt;
    return Vec2(yy * crossing.x() - xy * crossing.y(), xx * crossing.y() - xy * crossing.x()) / determinant;
  }
};

GradientMoments gradient_moments(const Image<std::uint8_t>& gray, int x, int y) {
  int xx = 0, xy = 0, yy = 0, bx = 0, by = 0;
  for (int dy = -kScoreRadius_px; dy <= kScoreRadius_px; ++dy) {
    const std::uint8_t* row = gray.data() + (y + dy) * gray.width() + x;
    for (int dx = -kScoreRadius_px; dx <= kScoreRadius_px; ++dx) {
      const int gx = row[dx + 1] - row[dx - 1];
      const int gy = row[dx + gray.width()] - row[dx - gray.width()];
      const int along = gx * dx + gy * dy;
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
      bx += gx * along;
      by += gy * along;
    }
  }
  return {static_cast<double>(xx), static_cast<double>(xy), static_cast<double>(yy), Vec2(bx, by)};
}

/// Refined corner near a pixel (FAST responds beside it, on its darker or brighter side), or the pixel itself
/// if the steps do not converge.
Vec2 refined(const Image<std::uint8_t>& gray, int x, int y) {
  const Vec2 start(x, y);
  for (int step = 0; step < kMaxRefinements; ++step) {
    const auto shift = gradient_moments(gray, x, y).shift();
    if (!shift) return start;
    const Vec2 place = Vec2(x, y) + *shift;
    if ((place - start).norm() > kMaxRefinement_px) return start;
    const int next_x = static_cast<int>(std::lround(place.x()));
    const int next_y = static_cast<int>(std::lround(place.y()));
    if (next_x == x && next_y == y) return place;
    if (step + 1 == kMaxRefinements && shift->norm() < 1.0) return place;
    x = next_x;
    y = next_y;
  }
  return start;
}

/// Scores the strongest FAST corners of a cell and sorts them by score.
void rank(const Image<std::uint8_t>& gray, std::size_t scored, std::vector<Candidate>& cell) {
  std::sort(cell.begin(), cell.end(), [](const Candidate& a, const Candidate& b) {
    return a.fast_response != b.fast_response ? a.fast_response > b.fast_response : by_place(a, b);
  });
  cell.resize(std::min(cell.size(), scored));
  for (Candidate& c : cell) c.score = static_cast<float>(gradient_moments(gray, c.x, c.y).score());
  std::sort(cell.begin(), cell.end(), [](const Candidate& a, const Candidate& b) {
    return a.score != b.score ? a.score > b.score : by_place(a, b);
  });
}

/// Mask of pixels within the minimum distance of selected corners.
class Occupied {
 public:
  Occupied(int width, int height, double distance_px)
      : mask_(width, height, 0), radius_px_(static_cast<int>(std::ceil(distance_px)) - 1) {}

  /// Selects a pixel if it is free, and marks its neighbourhood; returns true if selected.
  bool take(int x, int y) {
    if (radius_px_ < 0) return true;
    if (mask_(x, y) != 0) return false;
    for (int v = std::max(y - radius_px_, 0); v <= std::min(y + radius_px_, mask_.height() - 1); ++v) {
      const int begin = std::max(x - radius_px_, 0);
      const int end = std::min(x + radius_px_ + 1, mask_.width());
      std::fill(&mask_(begin, v), &mask_(begin, v) + (end - begin), std::uint8_t{1});
    }
    return true;
  }

 private:
  Image<std::uint8_t> mask_;
  int radius_px_;
};

/// Variance of the noise around a pixel: mean square of the mixed second differences, which neither slopes
/// nor straight edges along an axis have (Immerkaer 1996, equation 2).
double noise_variance(const Image<std::uint8_t>& gray, int x, int y) {
  constexpr double kPixels = (2 * kScoreRadius_px + 1) * (2 * kScoreRadius_px + 1), kMaskSquares = 36;
  const int width = gray.width();
  const auto sides = [](const std::uint8_t* at) { return at[-1] - 2 * at[0] + at[1]; };
  int sum = 0;
  for (int dy = -kScoreRadius_px; dy <= kScoreRadius_px; ++dy) {
    const std::uint8_t* row = gray.data() + (y + dy) * width + x;
    for (int dx = -kScoreRadius_px; dx <= kScoreRadius_px; ++dx) {
      const int mixed = sides(row + dx - width) - 2 * sides(row + dx) + sides(row + dx + width);
      sum += mixed * mixed;
    }
  }
  return sum / (kPixels * kMaskSquares);
}

/// Least score of what is no noise.
float least_above_noise(const Image<std::uint8_t>& gray) {
  std::vector<double> variances;
  for (int y = kCornerBorder_px; y < gray.height() - kCornerBorder_px; y += kNoiseStep_px)
    for (int x = kCornerBorder_px; x < gray.width() - kCornerBorder_px; x += kNoiseStep_px)
      variances.push_back(noise_variance(gray, x, y));
  const auto noisy =
      variances.begin() + static_cast<std::ptrdiff_t>(kNoisyShare * static_cast<double>(variances.size()));
  std::nth_element(variances.begin(), noisy, variances.end());
  return static_cast<float>(kLeastScoreByNoise * *noisy);
}

}  // namespace

std::vector<Corner> grid_corners(const Image<std::uint8_t>& gray, int wanted, const FeatureParams& params) {
  const int least_size = 2 * kCornerBorder_px + 1;
  if (gray.width() < least_size || gray.height() < least_size || wanted <= 0) return {};
  CellGrid grid(matrix_over(gray), params.kCell_px);
  const std::size_t share = (static_cast<std::size_t>(wanted) + grid.size() - 1) / grid.size();
  grid.find(share);
  float best = 0;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    rank(gray, 2 + share * kScoredPerWanted, grid[i]);
    if (!grid[i].empty()) best = std::max(best, grid[i].front().score);
  }
  const float least_score =
      std::max({best * static_cast<float>(params.quality_ratio), least_above_noise(gray), 1e-6F});
  std::vector<Corner> corners;
  Occupied occupied(gray.width(), gray.height(), params.min_distance_px);
  bool any = true;
  for (std::size_t round = 0; any; ++round) {
    any = false;
    std::vector<Candidate> taken;
    for (std::size_t i = 0; i < grid.size(); ++i) {
      if (round >= grid[i].size() || grid[i][round].score < least_score) continue;
      any = true;
      taken.push_back(grid[i][round]);
    }
    std::stable_sort(taken.begin(), taken.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    for (const Candidate& c : taken) {
      if (corners.size() == static_cast<std::size_t>(wanted)) return corners;
      if (!occupied.take(c.x, c.y)) continue;
      corners.push_back({params.subpixel ? refined(gray, c.x, c.y) : Vec2(c.x, c.y), c.score});
    }
  }
  return corners;
}

std::vector<Corner> shi_tomasi_corners(const Image<std::uint8_t>& gray, const Image<std::uint8_t>& mask,
                                       int wanted, const FeatureParams& params) {
  std::vector<cv::Point2f> points;
  const cv::Mat mask_view = mask.empty() ? cv::Mat() : matrix_over(mask);
  const double quality = std::max(params.quality_ratio, 1e-9);
  cv::goodFeaturesToTrack(matrix_over(gray), points, wanted, quality, params.min_distance_px, mask_view);
  std::vector<Corner> corners;
  for (const cv::Point2f& point : points) {
    const int x = static_cast<int>(point.x);
    const int y = static_cast<int>(point.y);
    const int margin = kCornerBorder_px;
    if (x < margin || y < margin || x >= gray.width() - margin || y >= gray.height() - margin) {
      continue;  // its descriptor would extend over the border
    }
    const auto score = static_cast<float>(gradient_moments(gray, x, y).score());
    corners.push_back({params.subpixel ? refined(gray, x, y) : Vec2(x, y), score});
  }
  return corners;
}

}  // namespace hm
