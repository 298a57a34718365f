#include "hm/sim/motion/flight.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hm/core/check.hpp"
#include "hm/core/rng.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {
namespace {

using Control = Eigen::Vector4d;

constexpr int kDegree = 5;
constexpr std::uint64_t kSwayStream = 0x73776179;

/// A number or vector with its first two time derivatives.
struct Jet {
  double v = 0, d = 0, dd = 0;
};
struct VecJet {
  Vec3 v, d, dd;
};
VecJet cross(const VecJet& a, const VecJet& b) {
  return {a.v.cross(b.v), a.d.cross(b.v) + a.v.cross(b.d),
          a.dd.cross(b.v) + 2 * a.d.cross(b.d) + a.v.cross(b.dd)};
}
VecJet normalized(const VecJet& a) {
  const Jet s{a.v.squaredNorm(), 2 * a.v.dot(a.d), 2 * (a.d.squaredNorm() + a.v.dot(a.dd))};
  const double root = 1 / std::sqrt(s.v), cube = root / s.v;
  const Jet r{root, -0.5 * cube * s.d, 0.75 * cube / s.v * s.d * s.d - 0.5 * cube * s.dd};
  return {a.v * r.v, a.d * r.v + a.v * r.d, a.dd * r.v + 2 * a.d * r.d + a.v * r.dd};
}

/// Axes of the vehicle for a thrust direction and a yaw angle.
struct Axes {
  VecJet x, y, z;
};
Axes axes_of(const VecJet& thrust, const Jet& yaw) {
  const double c = std::cos(yaw.v), s = std::sin(yaw.v);
  const Vec3 ahead(c, s, 0), left(-s, c, 0);
  const VecJet heading{ahead, left * yaw.d, left * yaw.dd - ahead * (yaw.d * yaw.d)};
  Axes axes;
  axes.z = normalized(thrust);
  axes.y = normalized(cross(axes.z, heading));
  axes.x = cross(axes.y, axes.z);
  return axes;
}

/// Weights of the `degree` + 1 control points between two knots, at the parameter `u` in 0..1 (Cox-de Boor on
/// uniform knots).
std::array<double, kDegree + 1> weights(int degree, double u) {
  std::array<double, kDegree + 1> w{1};
  for (int j = 1; j <= degree; ++j) {
    double saved = 0;
    for (int r = 0; r < j; ++r) {
      const double share = w[static_cast<std::size_t>(r)] / j;
      w[static_cast<std::size_t>(r)] = saved + (r + 1 - u) * share;
      saved = (u + j - r - 1) * share;
    }
    w[static_cast<std::size_t>(j)] = saved;
  }
  return w;
}

/// Heading of the first leg with horizontal motion, used at the start.
double first_heading(const std::vector<FlightPoint>& way) {
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    const Vec3 step = way[i + 1].position - way[i].position;
    if (step.head<2>().norm() > 1e-3) return std::atan2(step.y(), step.x());
  }
  return 0;
}

/// Time between two control points: corners are rounded over about 0.7 of it (standard deviation),
/// independent of the path length at higher speed.
double knot_s(const FlightParams& params) { return 0.5 * std::min(1.0, 1.0 / params.speed_m_s); }

/// Positions on the path at every control point, and whether the vehicle is standing there.
struct Samples {
  std::vector<Vec3> positions;
  std::vector<double> headings;  ///< of the leg, unwrapped
  std::vector<bool> standing;    ///< at the first or the last point
};

Samples sampled(const std::vector<FlightPoint>& way, const FlightParams& params) {
  Samples samples;
  const double step_s = knot_s(params);
  double begin_s = 0, heading = first_heading(way);
  std::size_t next = 0;
  const auto leg_to = [&](const Vec3& a, const Vec3& b, double duration_s, bool standing) {
    for (; static_cast<double>(next) * step_s < begin_s + duration_s; ++next) {
      const double share = (static_cast<double>(next) * step_s - begin_s) / duration_s;
      samples.positions.emplace_back(a + share * (b - a));
      samples.headings.push_back(heading);
      samples.standing.push_back(standing);
    }
    begin_s += duration_s;
  };
  for (std::size_t i = 0; i + 1 < way.size(); ++i) {
    leg_to(way[i].position, way[i].position, way[i].hover_s, i == 0);
    const Vec3 step = way[i + 1].position - way[i].position;
    const double flat_m = step.head<2>().norm();
    if (flat_m > 1e-3) {
      const double turned = std::atan2(step.y(), step.x()) - heading;
      heading += turned - 2 * std::numbers::pi * std::round(turned / (2 * std::numbers::pi));
    }
    leg_to(way[i].position, way[i + 1].position,
           std::max(flat_m / params.speed_m_s, std::abs(step.z()) / params.climb_m_s), false);
  }
  leg_to(way.back().position, way.back().position, way.back().hover_s, true);
  samples.positions.push_back(way.back().position);
  samples.headings.push_back(heading);
  samples.standing.push_back(true);
  return samples;
}

/// Moving average over +-half values, with repeated ends.
std::vector<double> averaged(const std::vector<double>& in, int half) {
  std::vector<double> out;
  const auto last = static_cast<int>(in.size()) - 1;
  for (int i = 0; i <= last; ++i) {
    double sum = 0;
    for (int k = i - half; k <= i + half; ++k) sum += in[static_cast<std::size_t>(std::clamp(k, 0, last))];
    out.push_back(sum / (2 * half + 1));
  }
  return out;
}

}  // namespace

Flight::Flight(const std::vector<FlightPoint>& way_points, const FlightParams& params, std::uint64_t seed)
    : knot_s_(knot_s(params)) {
  HM_CHECK(way_points.size() >= 2, "{} way points", way_points.size());
  const Samples samples = sampled(way_points, params);
  const double turn_knots = std::numbers::pi / (params.yaw_rate_rad_s * knot_s_);
  const std::vector<double> yaws =
      averaged(samples.headings, std::max(1, static_cast<int>(std::ceil((turn_knots - 1) / 2))));
  Rng rng(seed, kSwayStream);
  for (std::size_t i = 0; i < yaws.size(); ++i) {
    const Vec3 sway(rng.normal(), rng.normal(), rng.normal());
    Control control;
    control << samples.positions[i] + (samples.standing[i] ? 0 : params.sway_m) * sway, yaws[i];
    controls_.push_back(control);
  }
  // Repeating the position five times makes the spline start and end there, at rest.
  controls_.insert(controls_.begin(), kDegree, controls_.front());
  controls_.insert(controls_.end(), kDegree, controls_.back());
}

double Flight::duration_s() const { return static_cast<double>(controls_.size() - kDegree) * knot_s_; }

double Flight::length_m() const {
  double length = 0;
  Vec3 before = derivatives(0)[0].head<3>();
  for (double t = 0.02; t < duration_s(); t += 0.02) {
    const Vec3 here = derivatives(t)[0].head<3>();
    length += (here - before).norm();
    before = here;
  }
  return length;
}

std::array<Control, 5> Flight::derivatives(double time_s) const {
  const auto spans = static_cast<double>(controls_.size() - kDegree);
  const double at = std::clamp(time_s / knot_s_, 0.0, spans);
  const auto first = std::min(static_cast<std::size_t>(at), controls_.size() - kDegree - 1);
  std::array<Control, kDegree + 1> c;
  std::copy_n(controls_.begin() + static_cast<std::ptrdiff_t>(first), kDegree + 1, c.begin());
  std::array<Control, 5> out;
  double scale = 1;
  for (int k = 0; k < 5; ++k, scale /= knot_s_) {
    const auto w = weights(kDegree - k, at - static_cast<double>(first));
    Control sum = Control::Zero();
    for (std::size_t i = 0; i + static_cast<std::size_t>(k) <= kDegree; ++i) sum += w[i] * c[i];
    out[static_cast<std::size_t>(k)] = scale * sum;
    for (std::size_t i = 0; i + static_cast<std::size_t>(k) < kDegree; ++i) c[i] = c[i + 1] - c[i];
  }
  return out;
}

FlightState Flight::state(double time_s) const {
  const auto [p, v, a, jerk, snap] = derivatives(time_s);
  const VecJet thrust{a.head<3>() + Vec3(0, 0, kGravity_m_s2), jerk.head<3>(), snap.head<3>()};
  const auto [x, y, z] = axes_of(thrust, {p.w(), v.w(), a.w()});
  Mat3 rotation;
  rotation << x.v, y.v, z.v;
  FlightState state{{rotation, p.head<3>()}, v.head<3>(), a.head<3>(), {}, {}};
  // R^T R' is the cross-product matrix of the angular velocity; its derivative that of the acceleration.
  state.angular_velocity_base_rad_s = {z.v.dot(y.d), x.v.dot(z.d), y.v.dot(x.d)};
  state.angular_acceleration_base_rad_s2 = {z.d.dot(y.d) + z.v.dot(y.dd), x.d.dot(z.d) + x.v.dot(z.dd),
                                            y.d.dot(x.d) + y.v.dot(x.dd)};
  return state;
}

SE3 Flight::T_world_base(double time_s) const { return state(time_s).T_world_base; }

}  // namespace hm
