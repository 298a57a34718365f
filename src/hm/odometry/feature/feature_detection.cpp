#include "hm/odometry/feature/feature_detection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <span>

#include "hm/core/check.hpp"
#include "hm/odometry/feature/corner_detection.hpp"
#include "hm/odometry/feature/image_pyramid.hpp"

namespace hm {

namespace {

constexpr double kLevelScale = 1.2;
constexpr int kOrientationRadius_px = 15;
constexpr int kMinSize_px = 64;
constexpr double kFewShare = 0.4;  ///< of the wanted corners: with fewer, coarser images are searched, too
constexpr int kCoarsestLevel = 2;

cv::Mat view_of(const Image<std::uint8_t>& image) {
  return {image.height(), image.width(), CV_8UC1, const_cast<std::uint8_t*>(image.data())};
}

/// Half width of the orientation disc in each of its rows, from the centre on.
std::array<int, kOrientationRadius_px + 1> disc_rows() {
  std::array<int, kOrientationRadius_px + 1> rows{};
  for (int v = 0; v <= kOrientationRadius_px; ++v) {
    rows[static_cast<std::size_t>(v)] =
        static_cast<int>(std::sqrt(kOrientationRadius_px * kOrientationRadius_px - v * v));
  }
  return rows;
}

/// Direction from a patch's centre to its intensity centroid (Rosin 1999, as in ORB).
float patch_angle_rad(const Image<std::uint8_t>& gray, const Vec2& pixel) {
  static const auto kRows = disc_rows();
  const int x = std::clamp(static_cast<int>(std::lround(pixel.x())), kOrientationRadius_px,
                           gray.width() - 1 - kOrientationRadius_px);
  const int y = std::clamp(static_cast<int>(std::lround(pixel.y())), kOrientationRadius_px,
                           gray.height() - 1 - kOrientationRadius_px);
  int moment_x = 0;
  int moment_y = 0;
  for (int v = -kOrientationRadius_px; v <= kOrientationRadius_px; ++v) {
    const std::uint8_t* row = gray.data() + (y + v) * gray.width() + x;
    const int half_width = kRows[static_cast<std::size_t>(std::abs(v))];
    int sum = 0;
    for (int u = -half_width; u <= half_width; ++u) {
      sum += row[u];
      moment_x += u * row[u];
    }
    moment_y += v * sum;
  }
  return static_cast<float>(std::atan2(moment_y, moment_x));
}

int level_share(int total, int level, int levels) {
  // Shares decrease with the size of the level, as in ORB.
  double sum = 0;
  for (int i = 0; i < levels; ++i) sum += std::pow(kLevelScale, -i);
  return static_cast<int>(std::lround(total * std::pow(kLevelScale, -level) / sum));
}

float degrees(float angle_rad) {
  const float angle = angle_rad * 180.0F / std::numbers::pi_v<float>;
  return angle < 0 ? angle + 360.0F : angle;
}

}  // namespace

Image<std::uint8_t> to_gray(const Image<Rgb8>& color) {
  Image<std::uint8_t> gray(color.width(), color.height());
  const std::span<const Rgb8> in = color.pixels();
  const std::span<std::uint8_t> out = gray.pixels();
  for (std::size_t i = 0; i < in.size(); ++i) {
    // 0.299, 0.587, 0.114 in 1/32768, rounded
    out[i] =
        static_cast<std::uint8_t>((in[i].r * 9798U + in[i].g * 19235U + in[i].b * 3735U + 16384U) >> 15U);
  }
  return gray;
}

double sharpness(const Image<std::uint8_t>& gray) {
  const int width = gray.width();
  std::int64_t count = 0, sum = 0, sum_squares = 0;
  for (int y = 1; y + 1 < gray.height(); y += 2) {
    const std::uint8_t* row = gray.data() + y * width;
    int row_sum = 0, row_squares = 0;
    for (int x = 1; x + 1 < width; ++x) {
      const int laplacian = row[x - 1] + row[x + 1] + row[x - width] + row[x + width] - 4 * row[x];
      row_sum += laplacian;
      row_squares += laplacian * laplacian;
    }
    count += std::max(width - 2, 0);
    sum += row_sum;
    sum_squares += row_squares;
  }
  if (count == 0) return 0;
  const double mean = static_cast<double>(sum) / static_cast<double>(count);
  return static_cast<double>(sum_squares) / static_cast<double>(count) - mean * mean;
}

double depth_coverage(const DepthImage& depth) {
  std::int64_t valid = 0, count = 0;
  for (int y = 0; y < depth.height(); y += 2) {
    const auto row = depth.units.row(y);
    valid += std::count_if(row.begin(), row.end(), [](std::uint16_t unit) { return unit != 0; });
    count += depth.width();
  }
  return count == 0 ? 0 : static_cast<double>(valid) / static_cast<double>(count);
}

void place_in_space(Feature& feature, const DepthImage& depth, const PinholeCamera& camera,
                    const FeatureParams& params, const DepthGate& gate) {
  const int x = static_cast<int>(std::lround(feature.pixel.x()));
  const int y = static_cast<int>(std::lround(feature.pixel.y()));
  const auto at = depth_at(params.depth_model, depth, x, y, params.depth_noise);
  feature.has_depth =
      at && at->mean_m <= gate.max_depth_m && at->variance_m2 <= gate.max_sigma_m * gate.max_sigma_m;
  if (!feature.has_depth) return;
  feature.p_camera = camera.unproject(feature.pixel, at->mean_m);
  feature.covariance = feature_covariance(camera, feature.pixel, *at, params.kPixelSigma_px);
}

struct FeatureDetector::Impl {
  FeatureParams params;
  PinholeCamera camera;
  DepthGate gate;
  cv::Ptr<cv::ORB> orb;
  Image<std::uint8_t> blurred;
  std::vector<Image<std::uint8_t>> levels;  ///< of the pyramid; the first one is not used

  const Image<std::uint8_t>& prepared(const Image<std::uint8_t>& gray) {
    if (params.kBlurRadius_px == 0) return gray;
    blurred = Image<std::uint8_t>(gray.width(), gray.height());
    cv::Mat out = view_of(blurred);
    const int size = 2 * params.kBlurRadius_px + 1;
    cv::GaussianBlur(view_of(gray), out, {size, size}, 0);
    return blurred;
  }

  const Image<std::uint8_t>& level_image(const Image<std::uint8_t>& gray, int level) {
    if (level == 0) return gray;
    const double scale = std::pow(kLevelScale, -level);
    auto& image = levels[static_cast<std::size_t>(level)];
    const int width = static_cast<int>(std::lround(gray.width() * scale));
    const int height = static_cast<int>(std::lround(gray.height() * scale));
    if (image.width() != width || image.height() != height) image = Image<std::uint8_t>(width, height);
    cv::Mat out = view_of(image);
    cv::resize(view_of(gray), out, out.size(), 0, 0, cv::INTER_LINEAR);
    return image;
  }

  void add(const Corner& corner, const Image<std::uint8_t>& image, int level, FeatureSet& features) const {
    Feature feature;
    // Pixel centres are at integer coordinates: the outer edges of both images coincide, not their first
    // pixels.
    const double scale = std::pow(kLevelScale, level);
    feature.pixel = (corner.pixel.array() + 0.5) * scale - 0.5;
    feature.response = corner.score;
    feature.angle_rad = params.oriented ? patch_angle_rad(image, corner.pixel) : 0.0F;
    feature.octave = level;
    features.push_back(feature);
  }

  FeatureSet corners(const Image<std::uint8_t>& gray, const DepthImage& depth) {
    FeatureSet features;
    if (params.detector == CornerDetector::kShiTomasi) {
      Image<std::uint8_t> mask(depth.width(), depth.height());
      std::transform(depth.units.pixels().begin(), depth.units.pixels().end(), mask.pixels().begin(),
                     [](std::uint16_t unit) { return static_cast<std::uint8_t>(unit != 0 ? 255 : 0); });
      for (const Corner& c : shi_tomasi_corners(gray, mask, params.max_features, params)) {
        add(c, gray, 0, features);
      }
      return features;
    }
    for (int level = 0; level < params.levels; ++level) {
      const Image<std::uint8_t>& image = level_image(gray, level);
      const int wanted = level_share(params.max_features, level, params.levels);
      for (const Corner& c : grid_corners(image, wanted, params)) add(c, image, level, features);
    }
    if (is_few(features)) add_coarse(gray, features);
    return features;
  }

  [[nodiscard]] bool is_few(const FeatureSet& features) const {
    return static_cast<double>(features.size()) < kFewShare * params.max_features;
  }

  /// Corners that only images of half and quarter size show above the noise, whose variance falls to a
  /// quarter with each while the score of a smooth texture rises fourfold.
  void add_coarse(const Image<std::uint8_t>& gray, FeatureSet& features) const {
    const ImagePyramid pyramid(gray, kCoarsestLevel + 1);
    for (int level = 1; level <= kCoarsestLevel && is_few(features); ++level) {
      const double distance_px = params.min_distance_px * (1 << level);
      const std::size_t finer = features.size();
      for (Corner corner : grid_corners(pyramid.level(level), params.max_features, params)) {
        corner.pixel = pixel_from_level(corner.pixel, level);
        const bool is_near = std::ranges::any_of(std::span(features).first(finer), [&](const Feature& f) {
          return (f.pixel - corner.pixel).norm() < distance_px;
        });
        if (!is_near) add(corner, gray, 0, features);
      }
    }
  }

  /// OpenCV's ORB drops keypoints near the border and sorts the rest by level: their class_id leads back.
  void describe(const Image<std::uint8_t>& gray, FeatureSet& features) const {
    std::vector<cv::KeyPoint> keypoints;
    for (std::size_t i = 0; i < features.size(); ++i) {
      const Feature& f = features[i];
      const auto scale = static_cast<float>(std::pow(kLevelScale, f.octave));
      keypoints.emplace_back(static_cast<float>(f.pixel.x()), static_cast<float>(f.pixel.y()), 31.0F * scale,
                             degrees(f.angle_rad), f.response, f.octave, static_cast<int>(i));
    }
    cv::Mat descriptors;
    orb->compute(view_of(gray), keypoints, descriptors);
    FeatureSet described;
    for (std::size_t i = 0; i < keypoints.size(); ++i) {
      Feature& feature = features[static_cast<std::size_t>(keypoints[i].class_id)];
      std::memcpy(feature.descriptor.data(), descriptors.ptr(static_cast<int>(i)), sizeof(BinaryDescriptor));
      described.push_back(feature);
    }
    features = std::move(described);
  }
};

FeatureDetector::FeatureDetector(const FeatureParams& params, const PinholeCamera& camera,
                                 const DepthGate& gate)
    : impl_(std::make_unique<Impl>()) {
  HM_CHECK(camera.distortion.is_zero(), "features are placed by a camera without lens distortion");
  // Otherwise OpenCV would use all cores, for the whole process; odometry is single-threaded.
  static const bool kOneThread = (cv::setNumThreads(1), true);
  (void)kOneThread;
  impl_->params = params;
  impl_->camera = camera;
  impl_->gate = gate;
  impl_->levels.resize(static_cast<std::size_t>(params.levels));
  impl_->orb = cv::ORB::create(params.max_features, static_cast<float>(kLevelScale), params.levels, 1);
}

FeatureDetector::~FeatureDetector() = default;
FeatureDetector::FeatureDetector(FeatureDetector&&) noexcept = default;
FeatureDetector& FeatureDetector::operator=(FeatureDetector&&) noexcept = default;

FeatureSet FeatureDetector::detect(const Image<std::uint8_t>& gray, const DepthImage& depth) {
  const bool same_size = depth.width() == gray.width() && depth.height() == gray.height();
  HM_CHECK(depth.units.empty() || same_size, "depth {} x {}, image {} x {}", depth.width(), depth.height(),
           gray.width(), gray.height());
  if (gray.width() < kMinSize_px || gray.height() < kMinSize_px) return {};
  const Image<std::uint8_t>& image = impl_->prepared(gray);
  FeatureSet features = impl_->corners(image, depth);
  if (features.empty()) return features;
  impl_->describe(image, features);
  for (Feature& f : features) place_in_space(f, depth, impl_->camera, impl_->params, impl_->gate);
  return features;
}

}  // namespace hm
