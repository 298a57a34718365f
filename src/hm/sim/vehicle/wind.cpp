#include "hm/sim/vehicle/wind.hpp"

#include <cmath>
#include <numbers>

namespace hm {
namespace {

constexpr std::uint64_t kTurbulenceStream = 0x77696e, kGustStream = 5ull << 32, kFaultGustStream = 6ull << 32;

}  // namespace

Vec3 WindGust::velocity_world_m_s(double time_s) const {
  const double share = (time_s - begin_s) / duration_s;
  if (share <= 0 || share >= 1) return Vec3::Zero();
  const double speed = peak_m_s / 2 * (1 - std::cos(2 * std::numbers::pi * share));
  return speed * Vec3(std::cos(direction_rad), std::sin(direction_rad), 0);
}

WindModel::WindModel(const WindParams& params, std::uint64_t seed)
    : params_(params), seed_(seed), rng_(seed, kTurbulenceStream) {
  for (double& v : turbulence_) v = rng_.normal(0, params.turbulence_m_s);
}

void WindModel::step(double step_s) {
  time_s_ += step_s;
  const double keep = std::exp(-step_s / params_.kTurbulenceCorrelation_s);
  const double fresh = params_.turbulence_m_s * std::sqrt(1 - keep * keep);
  for (double& v : turbulence_) v = keep * v + rng_.normal(0, fresh);
}

double WindModel::direction_rad(std::uint64_t stream) const {
  return Rng(seed_, stream).uniform(-std::numbers::pi, std::numbers::pi);
}

void WindModel::begin_gust(double duration_s) {
  const auto stream = kFaultGustStream + static_cast<std::uint64_t>(std::llround(time_s_ * 1e3));
  fault_gust_ = WindGust{time_s_, duration_s, params_.kFaultGust_m_s, direction_rad(stream)};
}

std::optional<WindGust> WindModel::periodic_gust() const {
  const double periods = std::floor(time_s_ / params_.kGustPeriod_s - 0.5);
  if (periods < 0) return std::nullopt;
  return WindGust{(periods + 0.5) * params_.kGustPeriod_s, params_.kGustDuration_s, params_.gust_m_s,
                  direction_rad(kGustStream + static_cast<std::uint64_t>(periods))};
}

Vec3 WindModel::velocity_world_m_s() const {
  Vec3 velocity = turbulence_;
  if (const auto gust = periodic_gust()) velocity += gust->velocity_world_m_s(time_s_);
  if (fault_gust_) velocity += fault_gust_->velocity_world_m_s(time_s_);
  return velocity;
}

}  // namespace hm
