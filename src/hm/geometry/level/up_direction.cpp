#include "hm/geometry/level/up_direction.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>

namespace hm {
namespace {

constexpr std::array<std::string_view, 5> kSourceNames{"", "", "floor and walls", "gravity",
                                                       "gravity, floor and walls"};
constexpr std::array<std::string_view, 6> kAxisNames{"x", "y", "z", "-x", "-y", "-z"};

Vec3 axis(std::size_t index) {
  Vec3 v = Vec3::Zero();
  v[static_cast<Eigen::Index>(index % 3)] = index < 3 ? 1 : -1;
  return v;
}

std::optional<Vec3> parse_axis(std::string_view text) {
  for (std::size_t i = 0; i < kAxisNames.size(); ++i)
    if (text == kAxisNames[i]) return axis(i);
  Vec3 v;
  const std::string copy(text);
  const char* at = copy.c_str();
  for (int k = 0; k < 3; ++k) {
    char* end = nullptr;
    v[k] = std::strtod(at, &end);
    if (end == at) return std::nullopt;
    at = end;
  }
  if (*at != '\0' || !v.allFinite() || std::abs(v.norm() - 1) > 1e-2) return std::nullopt;
  return v.normalized();
}

}  // namespace

std::string_view to_string(UpSource source) { return kSourceNames[static_cast<std::size_t>(source)]; }

std::string axis_text(const Vec3& up) {
  for (std::size_t i = 0; i < kAxisNames.size(); ++i)
    if ((up - axis(i)).norm() < 1e-6) return std::string(kAxisNames[i]);
  return fmt::format("{:.4f} {:.4f} {:.4f}", up.x(), up.y(), up.z());
}

std::string to_string(const UpDirection& up) {
  if (!up.known()) return "unknown";
  const std::string_view source = to_string(up.source);
  return source.empty() ? axis_text(up.up) : fmt::format("{} (from {})", axis_text(up.up), source);
}

std::optional<UpDirection> parse_up(std::string_view text) {
  if (text == "unknown") return UpDirection{};
  UpDirection up = z_is_up();
  if (const std::size_t from = text.find(" (from "); from != std::string_view::npos && text.back() == ')') {
    const std::string_view name = text.substr(from + 7, text.size() - from - 8);
    up.source = UpSource::kUnknown;
    for (std::size_t i = 2; i < kSourceNames.size(); ++i)
      if (name == kSourceNames[i]) up.source = static_cast<UpSource>(i);
    if (!up.known()) return std::nullopt;
    text = text.substr(0, from);
  }
  const auto direction = parse_axis(text);
  if (!direction) return std::nullopt;
  up.up = *direction;
  return up;
}

Vec3 snapped_to_axis(const Vec3& up) {
  for (std::size_t i = 0; i < kAxisNames.size(); ++i)
    if (up.dot(axis(i)) > std::cos(kAxisTolerance_rad)) return axis(i);
  return up;
}

Mat3 rotation_to_z_up(const Vec3& up) {
  const Vec3 cross = up.cross(Vec3::UnitZ());
  const double sine = cross.norm(), cosine = up.z();
  if (sine < 1e-9) return cosine > 0 ? Mat3(Mat3::Identity()) : Mat3(Vec3(1, -1, -1).asDiagonal());
  // Rodrigues' formula with the unnormalised axis: exact where up is an axis of the frame.
  const Mat3 K = skew(cross);
  return Mat3::Identity() + K + K * K * ((1 - cosine) / (sine * sine));
}

SE3 level_pose(const Vec3& up_camera) {
  constexpr double kSteep = 0.98;  // 79 degrees
  Vec3 ahead = Vec3::UnitZ();
  if (up_camera.z() < -kSteep) ahead = -Vec3::UnitY();
  if (up_camera.z() > kSteep) ahead = Vec3::UnitY();
  Mat3 R_level_camera;
  R_level_camera.row(2) = up_camera.transpose();
  R_level_camera.row(0) = (ahead - ahead.dot(up_camera) * up_camera).normalized().transpose();
  R_level_camera.row(1) = up_camera.cross(Vec3(R_level_camera.row(0).transpose())).transpose();
  return {R_level_camera, Vec3::Zero()};
}

}  // namespace hm
