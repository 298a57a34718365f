#include "hm/odometry/surface_alignment.hpp"

#include <cmath>

namespace hm {
namespace {

using Vec6f = Eigen::Matrix<float, 6, 1>;
constexpr float kCauchySigmas = 2.0f;

/// A camera's numbers in single precision.
struct PinholeF {
  float fx, fy, cx, cy;
  explicit PinholeF(const PinholeCamera& camera)
      : fx(static_cast<float>(camera.fx)),
        fy(static_cast<float>(camera.fy)),
        cx(static_cast<float>(camera.cx)),
        cy(static_cast<float>(camera.cy)) {}
};

/// The upper triangle of the information and the gradient, summed in single precision row by row.
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

struct Reading {
  const SurfaceElement* element;
  Eigen::Vector3f p_cur, p_ref;
};

/// The element of the reference that a reading falls on; null when it falls on none.
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
  PoseEquations equations;
  const Eigen::Matrix3f rotation = T_ref_cur.rotation().cast<float>();
  const Eigen::Vector3f translation = T_ref_cur.translation().cast<float>();
  const PinholeF ref_camera(reference.camera), cur_camera(current.camera);
  const float gate = static_cast<float>(matching.gate_sigmas);
  const float extra = static_cast<float>(matching.extra_gate_m);
  double cost = 0;
  for (int y = matching.stride / 2; y < current.depth_m.height(); y += matching.stride) {
    RowSums sums;
    for (int x = matching.stride / 2; x < current.depth_m.width(); x += matching.stride) {
      const float z = current.depth_m(x, y);
      if (!(z > 0)) continue;
      const Eigen::Vector3f p_cur((static_cast<float>(x) - cur_camera.cx) / cur_camera.fx * z,
                                  (static_cast<float>(y) - cur_camera.cy) / cur_camera.fy * z, z);
      const Eigen::Vector3f p_ref = rotation * p_cur + translation;
      const SurfaceElement* element = element_at(reference, ref_camera, p_ref);
      if (!element) continue;
      const float residual = element->normal.dot(p_ref - element->point);
      const Eigen::Vector3f normal_cur = rotation.transpose() * element->normal;
      const float sigma_z = static_cast<float>(matching.noise.sigma_m(static_cast<double>(z)));
      const float cosine = normal_cur.z();
      const float variance = element->sigma_m * element->sigma_m + sigma_z * sigma_z * cosine * cosine;
      const float sigma = std::sqrt(variance);
      if (std::abs(residual) > gate * sigma + extra) continue;
      const float normalised = residual / (kCauchySigmas * sigma);
      const float robust = 1 / (1 + normalised * normalised);
      Vec6f jacobian;
      jacobian.head<3>() = normal_cur;
      jacobian.tail<3>() = p_cur.cross(normal_cur);
      sums.add(jacobian, robust / variance, residual);
      cost += static_cast<double>(std::log1p(normalised * normalised));
      ++equations.terms;
    }
    sums.flush_into(equations);
  }
  equations.cost = 0.5 * static_cast<double>(kCauchySigmas * kCauchySigmas) * cost;
  equations.information = equations.information.selfadjointView<Eigen::Upper>();
  return equations;
}

}  // namespace hm
