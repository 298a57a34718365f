#include "hm/sim/motion/walk.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr double kStep_s = 1.0 / 60;

WalkPoint blend(const WalkPoint& a, const WalkPoint& b, double t) {
  return {a.position + t * (b.position - a.position), a.yaw_rad + t * (b.yaw_rad - a.yaw_rad),
          a.pitch_rad + t * (b.pitch_rad - a.pitch_rad)};
}

/// Samples the path at constant speed from point to point, every kStep_s.
std::vector<WalkPoint> sampled(const std::vector<WalkPoint>& way, const Walk::Limits& limits) {
  std::vector<WalkPoint> samples;
  double begin_s = 0;
  std::size_t next = 0;
  for (std::size_t leg = 0; leg + 1 < way.size(); ++leg) {
    const WalkPoint &a = way[leg], &b = way[leg + 1];
    const double duration_s = std::max({(b.position - a.position).norm() / limits.speed_m_s,
                                        std::abs(b.yaw_rad - a.yaw_rad) / limits.yaw_rate_rad_s,
                                        std::abs(b.pitch_rad - a.pitch_rad) / limits.pitch_rate_rad_s, 1e-6});
    while (static_cast<double>(next) * kStep_s < begin_s + duration_s)
      samples.push_back(blend(a, b, (static_cast<double>(next++) * kStep_s - begin_s) / duration_s));
    begin_s += duration_s;
  }
  samples.push_back(way.back());
  return samples;
}

/// Moving average over +-half samples, with repeated ends. It neither leaves the convex hull of the path nor
/// exceeds its speeds.
std::vector<WalkPoint> averaged(const std::vector<WalkPoint>& in, int half) {
  const auto count = static_cast<int>(in.size());
  const auto at = [&](int i) -> const WalkPoint& {
    return in[static_cast<std::size_t>(std::clamp(i, 0, count - 1))];
  };
  const double share = 1.0 / (2 * half + 1);
  std::vector<WalkPoint> out(in.size());
  for (int i = 0; i < count; ++i) {
    WalkPoint sum;
    for (int k = i - half; k <= i + half; ++k) {
      sum.position += at(k).position;
      sum.yaw_rad += at(k).yaw_rad;
      sum.pitch_rad += at(k).pitch_rad;
    }
    out[static_cast<std::size_t>(i)] = {sum.position * share, sum.yaw_rad * share, sum.pitch_rad * share};
  }
  return out;
}

/// Cubic between b and c with Catmull-Rom tangents.
template <class T>
T cubic(const T& a, const T& b, const T& c, const T& d, double t) {
  const T m0 = (c - a) * 0.5, m1 = (d - b) * 0.5;
  const double t2 = t * t, t3 = t2 * t;
  return b * (2 * t3 - 3 * t2 + 1) + m0 * (t3 - 2 * t2 + t) + c * (3 * t2 - 2 * t3) + m1 * (t3 - t2);
}

}  // namespace

Walk::Walk(const std::vector<WalkPoint>& way_points, const Limits& limits) {
  HM_CHECK(way_points.size() >= 2, "{} way points", way_points.size());
  const int half = std::max(1, static_cast<int>(std::lround(limits.smoothing_s / 2 / kStep_s)));
  std::vector<WalkPoint> exact = sampled(way_points, limits);
  // Room for the window at both ends, so that the walk starts and ends at rest on its first and last point.
  exact.insert(exact.begin(), static_cast<std::size_t>(2 * half), exact.front());
  exact.insert(exact.end(), static_cast<std::size_t>(2 * half), exact.back());
  samples_ = averaged(averaged(exact, half), half);
}

double Walk::duration_s() const { return static_cast<double>(samples_.size() - 1) * kStep_s; }

double Walk::length_m() const {
  double length = 0;
  for (std::size_t i = 1; i < samples_.size(); ++i)
    length += (samples_[i].position - samples_[i - 1].position).norm();
  return length;
}

WalkPoint Walk::point_at(double time_s) const {
  const auto last = static_cast<int>(samples_.size()) - 1;
  const double at = std::clamp(time_s / kStep_s, 0.0, static_cast<double>(last));
  const int i = std::min(static_cast<int>(at), last - 1);
  const double t = at - i;
  const auto sample = [&](int k) -> const WalkPoint& {
    return samples_[static_cast<std::size_t>(std::clamp(k, 0, last))];
  };
  const WalkPoint &a = sample(i - 1), &b = sample(i), &c = sample(i + 1), &d = sample(i + 2);
  return {cubic(a.position, b.position, c.position, d.position, t),
          cubic(a.yaw_rad, b.yaw_rad, c.yaw_rad, d.yaw_rad, t),
          cubic(a.pitch_rad, b.pitch_rad, c.pitch_rad, d.pitch_rad, t)};
}

SE3 Walk::T_world_camera(double time_s) const {
  const WalkPoint p = point_at(time_s);
  const double cy = std::cos(p.yaw_rad), sy = std::sin(p.yaw_rad);
  const double cp = std::cos(p.pitch_rad), sp = std::sin(p.pitch_rad);
  const Vec3 forward(cp * cy, cp * sy, sp), right(sy, -cy, 0);
  Mat3 rotation;
  rotation << right, forward.cross(right), forward;
  return {rotation, p.position};
}

}  // namespace hm
