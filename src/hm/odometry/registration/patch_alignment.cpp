#include "hm/odometry/registration/patch_alignment.hpp"

#include <Eigen/Dense>
#include <array>
#include <cmath>

namespace hm {
namespace {

constexpr int kSide = 12;  // of the patch; a multiple of the vector's length
constexpr int kBordered = kSide + 2;
constexpr float kMiddle = 0.5f * (kSide - 1);
constexpr int kPatchIterations = 10;
constexpr float kConverged_px = 0.02f;
constexpr double kMinNoise = 2.0;     // grey levels: rounding and model errors
constexpr double kMinSigma_px = 0.1;  // of a match, however strong its gradients are

using Patch = std::array<float, kSide * kSide>;
using Vec4f = Eigen::Vector4f;

struct Template {
  Patch value, gx, gy;
  Eigen::Matrix4f inverse = Eigen::Matrix4f::Zero();    // of the normal matrix of (x, y, gain, offset)
  Eigen::Matrix2d gradients = Eigen::Matrix2d::Zero();  // normal matrix of (x, y), gain and offset eliminated
  float mean = 0, variance = 0;
};

bool sample_bordered(const Image<std::uint8_t>& image, const Vec2& centre, const Mat2& warp,
                     std::array<float, kBordered * kBordered>& out) {
  const Eigen::Matrix2f step = warp.cast<float>();
  const Eigen::Vector2f c = centre.cast<float>();
  const float reach = 0.5f * (kBordered - 1);
  const float rx = reach * (std::abs(step(0, 0)) + std::abs(step(0, 1)));
  const float ry = reach * (std::abs(step(1, 0)) + std::abs(step(1, 1)));
  if (!(c.x() - rx >= 0 && c.y() - ry >= 0 && c.x() + rx < static_cast<float>(image.width() - 1) &&
        c.y() + ry < static_cast<float>(image.height() - 1)))
    return false;
  const std::uint8_t* data = image.data();
  const int stride = image.width();
  float* to = out.data();
  for (int y = 0; y < kBordered; ++y) {
    const float dy = static_cast<float>(y) - reach;
    float u = c.x() - step(0, 0) * reach + step(0, 1) * dy;
    float v = c.y() - step(1, 0) * reach + step(1, 1) * dy;
    for (int x = 0; x < kBordered; ++x, u += step(0, 0), v += step(1, 0)) {
      const int ix = static_cast<int>(u), iy = static_cast<int>(v);
      const float a = u - static_cast<float>(ix), b = v - static_cast<float>(iy);
      const std::uint8_t* p = data + iy * stride + ix;
      const float top = static_cast<float>(p[0]) + a * static_cast<float>(p[1] - p[0]);
      const float low = static_cast<float>(p[stride]) + a * static_cast<float>(p[stride + 1] - p[stride]);
      *to++ = top + b * (low - top);
    }
  }
  return true;
}

/// Sums of products over a patch, four at a time so that the compiler can keep them in a vector.
float dot(const float* a, const float* b) {
  std::array<float, 4> sums{};
  for (int i = 0; i < kSide * kSide; i += 4)
    for (int k = 0; k < 4; ++k) sums[static_cast<std::size_t>(k)] += a[i + k] * b[i + k];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}
float total(const float* a) {
  std::array<float, 4> sums{};
  for (int i = 0; i < kSide * kSide; i += 4)
    for (int k = 0; k < 4; ++k) sums[static_cast<std::size_t>(k)] += a[i + k];
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

bool make_template(const Image<std::uint8_t>& image, const Vec2& centre, const Mat2& warp, Template& out) {
  std::array<float, kBordered * kBordered> wide;
  if (!sample_bordered(image, centre, warp, wide)) return false;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const float* p = wide.data() + (y + 1) * kBordered + x + 1;
      const auto i = static_cast<std::size_t>(y * kSide + x);
      out.value[i] = p[0];
      out.gx[i] = 0.5f * (p[1] - p[-1]);
      out.gy[i] = 0.5f * (p[kBordered] - p[-kBordered]);
    }
  constexpr float n = kSide * kSide;
  out.mean = total(out.value.data()) / n;
  for (float& value : out.value) value -= out.mean;
  const float* columns[3] = {out.gx.data(), out.gy.data(), out.value.data()};
  Eigen::Matrix4f normal;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 3; ++j) normal(i, j) = normal(j, i) = dot(columns[i], columns[j]);
    normal(i, 3) = normal(3, i) = total(columns[i]);
  }
  normal(3, 3) = n;
  out.variance = normal(2, 2) / n;
  if (out.variance < 4.0f) return false;
  const Eigen::Matrix4d normal_d = normal.cast<double>();
  out.gradients = normal_d.topLeftCorner<2, 2>() - normal_d.topRightCorner<2, 2>() *
                                                       normal_d.bottomRightCorner<2, 2>().inverse() *
                                                       normal_d.bottomLeftCorner<2, 2>();
  if (!(out.gradients.determinant() > 1e2)) return false;
  out.inverse = normal_d.inverse().cast<float>();
  return true;
}

/// Reads the patch around a pixel; false when it is not inside the image.
bool sample_patch(const Image<std::uint8_t>& image, const Eigen::Vector2f& centre, Patch& out) {
  const float u = centre.x() - kMiddle, v = centre.y() - kMiddle;
  if (!(u >= 0 && v >= 0 && u + kSide < static_cast<float>(image.width() - 1) &&
        v + kSide < static_cast<float>(image.height() - 1)))
    return false;
  const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
  const float a = u - static_cast<float>(x0), b = v - static_cast<float>(y0);
  const float w00 = (1 - a) * (1 - b), w01 = a * (1 - b), w10 = (1 - a) * b, w11 = a * b;
  for (int y = 0; y < kSide; ++y) {
    const std::uint8_t* top = &image(x0, y0 + y);
    const std::uint8_t* low = top + image.width();
    float* to = out.data() + y * kSide;
    for (int x = 0; x < kSide; ++x)
      to[x] = w00 * static_cast<float>(top[x]) + w01 * static_cast<float>(top[x + 1]) +
              w10 * static_cast<float>(low[x]) + w11 * static_cast<float>(low[x + 1]);
  }
  return true;
}

struct LevelResult {
  Eigen::Vector2f centre;
  float noise_variance = 0, correlation = 0;
};

std::optional<LevelResult> align_level(const Template& reference, const Image<std::uint8_t>& image,
                                       Eigen::Vector2f centre) {
  constexpr float n = kSide * kSide;
  Patch patch;
  bool converged = false;
  for (int iteration = 0; iteration < kPatchIterations && !converged; ++iteration) {
    if (!sample_patch(image, centre, patch)) return std::nullopt;
    for (std::size_t i = 0; i < patch.size(); ++i) patch[i] -= reference.value[i] + reference.mean;
    const Vec4f rhs(dot(patch.data(), reference.gx.data()), dot(patch.data(), reference.gy.data()),
                    dot(patch.data(), reference.value.data()), total(patch.data()));
    const Vec4f step = reference.inverse * rhs;
    if (!step.allFinite() || step.head<2>().squaredNorm() > 36.0f) return std::nullopt;
    centre -= step.head<2>();
    converged = step.head<2>().squaredNorm() < kConverged_px * kConverged_px;
  }
  if (!converged || !sample_patch(image, centre, patch)) return std::nullopt;
  const float mean = total(patch.data()) / n;
  for (float& value : patch) value -= mean;
  const float own = dot(patch.data(), patch.data()) / n;
  const float cross = dot(patch.data(), reference.value.data()) / n;
  LevelResult result{centre};
  result.correlation = cross / std::sqrt(std::max(1e-3f, own * reference.variance));
  result.noise_variance = std::max(0.0f, own - cross * cross / reference.variance);
  return result;
}

}  // namespace

std::optional<Mat2> plane_warp(const PinholeCamera& camera, const SE3& T_ref_cur, const Vec3& p_cur,
                               const Vec3& normal_cur) {
  const Vec3 p_ref = T_ref_cur * p_cur;
  if (!(p_cur.z() > 0.05 && p_ref.z() > 0.05)) return std::nullopt;
  const Vec3 ray(p_cur.x() / p_cur.z(), p_cur.y() / p_cur.z(), 1);
  const double facing = normal_cur.dot(ray);
  if (std::abs(facing) < 0.1 * ray.norm()) return std::nullopt;
  Mat2 warp;
  for (int axis = 0; axis < 2; ++axis) {
    // The point of the plane under the neighbouring pixel moves by z (d ray - ray (n d ray) / (n ray)).
    Vec3 d_ray = Vec3::Zero();
    d_ray[axis] = 1 / (axis == 0 ? camera.fx : camera.fy);
    const Vec3 d_cur = p_cur.z() * (d_ray - ray * (normal_cur.dot(d_ray) / facing));
    const Vec3 d_ref = T_ref_cur.rotation() * d_cur;
    warp(0, axis) = camera.fx * (d_ref.x() - p_ref.x() / p_ref.z() * d_ref.z()) / p_ref.z();
    warp(1, axis) = camera.fy * (d_ref.y() - p_ref.y() / p_ref.z() * d_ref.z()) / p_ref.z();
  }
  const double area = warp.determinant();
  if (!(area > 0.1 && area < 10) || warp.norm() > 4) return std::nullopt;
  return warp;
}

std::optional<PatchMatch> align_patch(const PatchSource& source, const ImagePyramid& current,
                                      const Vec2& guess, const PatchSearch& search) {
  PatchMatch match;
  match.pixel = guess;
  Template reference;
  for (int level = std::min(search.first_level, current.levels() - 1); level >= search.last_level; --level) {
    const Vec2 centre = pixel_in_level(source.pixel, level);
    if (!make_template(source.pyramid->level(level), centre, source.ref_from_cur, reference)) {
      if (level > search.last_level) continue;  // near the border or flat there: the finer one decides
      return std::nullopt;
    }
    const auto aligned =
        align_level(reference, current.level(level), pixel_in_level(match.pixel, level).cast<float>());
    if (!aligned) return std::nullopt;
    match.pixel = pixel_from_level(aligned->centre.cast<double>(), level);
    if ((match.pixel - guess).norm() > search.max_shift_px) return std::nullopt;
    if (level > search.last_level) continue;
    match.correlation = static_cast<double>(aligned->correlation);
    if (match.correlation < search.min_correlation) return std::nullopt;
    const double noise = kMinNoise * kMinNoise + static_cast<double>(aligned->noise_variance);
    const Mat2 covariance =
        noise * reference.gradients.inverse() + Mat2::Identity() * kMinSigma_px * kMinSigma_px;
    match.information = covariance.inverse() / std::pow(4.0, level);
  }
  return match;
}

}  // namespace hm
