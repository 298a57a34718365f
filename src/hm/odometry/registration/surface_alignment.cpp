#include "hm/odometry/registration/surface_alignment.hpp"

#include <array>
#include <cmath>

namespace hm {
namespace {

using Vec6f = Eigen::Matrix<float, 6, 1>;
constexpr float kCauchySigmas = 2.0f;

/// Camera parameters in single precision.
struct PinholeF {
  float fx, fy, cx, cy;
  explicit PinholeF(const PinholeCamera& camera)
      : fx(static_cast<float>(camera.fx)),
        fy(static_cast<float>(camera.fy)),
        cx(static_cast<float>(camera.cx)),
        cy(static_cast<float>(camera.cy)) {}
};

/// Upper triangle of the information and the gradient, summed in single precision row by row.
struct RowSums {
  std::array<float, 21> information{};
  std::array<float, 6> gradient{};
  void add(const Vec6f& jacobian, float weight, float residual) {
    std::size_t k = 0;
    for (int i = 0; i < 6; ++i) {
      const float wj = weight * jacobian[i];
      gradient[static_cast<std::size_t>(i)] += wj * residual;
      for (int j = i; j < 6; ++j) information[k++] += wj * jacobian[j];
    }
  }
  void flush_into(PoseEquations& equations) const {
    std::size_t k = 0;
    for (int i = 0; i < 6; ++i) {
      equations.gradient[i] += static_cast<double>(gradient[static_cast<std::size_t>(i)]);
      for (int j = i; j < 6; ++j) equations.information(i, j) += static_cast<double>(information[k++]);
    }
  }
};

/// Compares readings with surface elements for a motion and sums the normal equations row by row.
class Comparison {
 public:
  Comparison(const SE3& T_ref_cur, const SurfaceMatching& matching)
      : rotation_(T_ref_cur.rotation().cast<float>()),
        translation_(T_ref_cur.translation().cast<float>()),
        matching_(matching),
        gate_(static_cast<float>(matching.gate_sigmas)),
        extra_(static_cast<float>(matching.extra_gate_m)) {}

  [[nodiscard]] Eigen::Vector3f in_reference(const Eigen::Vector3f& p_cur) const {
    return rotation_ * p_cur + translation_;
  }
  [[nodiscard]] Eigen::Vector3f in_current(const Eigen::Vector3f& p_ref) const {
    return rotation_.transpose() * (p_ref - translation_);
  }

  void add(const SurfaceElement& element, const Eigen::Vector3f& p_cur, const Eigen::Vector3f& p_ref) {
    const float residual = element.normal.dot(p_ref - element.point);
    const Eigen::Vector3f normal_cur = rotation_.transpose() * element.normal;
    const float sigma_z = static_cast<float>(matching_.noise.sigma_m(static_cast<double>(p_cur.z())));
    const float cosine = normal_cur.z();
    const float variance = element.sigma_m * element.sigma_m + sigma_z * sigma_z * cosine * cosine;
    const float sigma = std::sqrt(variance);
    if (std::abs(residual) > gate_ * sigma + extra_) return;
    const float normalised = residual / (kCauchySigmas * sigma);
    const float robust = 1 / (1 + normalised * normalised);
    Vec6f jacobian;
    jacobian.head<3>() = normal_cur;
    jacobian.tail<3>() = p_cur.cross(normal_cur);
    sums_.add(jacobian, robust / variance, residual);
    cost_ += static_cast<double>(std::log1p(normalised * normalised));
    ++equations_.terms;
  }

  void end_row() {
    sums_.flush_into(equations_);
    sums_ = {};
  }

  PoseEquations finish() {
    end_row();
    equations_.cost = 0.5 * static_cast<double>(kCauchySigmas * kCauchySigmas) * cost_;
    equations_.information = equations_.information.selfadjointView<Eigen::Upper>();
    return equations_;
  }

 private:
  Eigen::Matrix3f rotation_;
  Eigen::Vector3f translation_;
  const SurfaceMatching& matching_;
  float gate_, extra_;
  RowSums sums_;
  PoseEquations equations_;
  double cost_ = 0;
};

Eigen::Vector3f unproject(const PinholeF& camera, int x, int y, float z) {
  return {(static_cast<float>(x) - camera.cx) / camera.fx * z,
          (static_cast<float>(y) - camera.cy) / camera.fy * z, z};
}

/// Reference element at a reading's projection; null if there is none.
const SurfaceElement* element_at(const SurfaceGrid& reference, const PinholeF& camera,
                                 const Eigen::Vector3f& p_ref) {
  if (p_ref.z() < 0.05f) return nullptr;
  const int x = static_cast<int>(std::lround(camera.fx * p_ref.x() / p_ref.z() + camera.cx));
  const int y = static_cast<int>(std::lround(camera.fy * p_ref.y() / p_ref.z() + camera.cy));
  if (!reference.elements.contains(x, y)) return nullptr;
  const SurfaceElement& element = reference.elements(x, y);
  return element.sigma_m > 0 ? &element : nullptr;
}

}  // namespace

PoseEquations surface_equations(const SurfaceGrid& reference, const DepthGrid& current, const SE3& T_ref_cur,
                                const SurfaceMatching& matching) {
  Comparison comparison(T_ref_cur, matching);
  const PinholeF ref_camera(reference.camera), cur_camera(current.camera);
  for (int y = matching.stride / 2; y < current.depth_m.height(); y += matching.stride) {
    for (int x = matching.stride / 2; x < current.depth_m.width(); x += matching.stride) {
      const float z = current.depth_m(x, y);
      if (!(z > 0)) continue;
      const Eigen::Vector3f p_cur = unproject(cur_camera, x, y, z);
      const Eigen::Vector3f p_ref = comparison.in_reference(p_cur);
      if (const SurfaceElement* element = element_at(reference, ref_camera, p_ref))
        comparison.add(*element, p_cur, p_ref);
    }
    comparison.end_row();
  }
  return comparison.finish();
}

PoseEquations surface_equations(std::span<const SurfaceElement> reference, const DepthGrid& current,
                                const SE3& T_ref_cur, const SurfaceMatching& matching) {
  constexpr std::size_t kRow = 128;  // summed in single precision before they are added up
  Comparison comparison(T_ref_cur, matching);
  const PinholeF camera(current.camera);
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const Eigen::Vector3f expected = comparison.in_current(reference[i].point);
    if (expected.z() < 0.05f) continue;
    const int x = static_cast<int>(std::lround(camera.fx * expected.x() / expected.z() + camera.cx));
    const int y = static_cast<int>(std::lround(camera.fy * expected.y() / expected.z() + camera.cy));
    if (!current.depth_m.contains(x, y) || !(current.depth_m(x, y) > 0)) continue;
    const Eigen::Vector3f p_cur = unproject(camera, x, y, current.depth_m(x, y));
    comparison.add(reference[i], p_cur, comparison.in_reference(p_cur));
    if (i % kRow == kRow - 1) comparison.end_row();
  }
  return comparison.finish();
}

}  // namespace hm
