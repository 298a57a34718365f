#pragma once
#include <cstdint>

namespace hm {

/// Seeded random number generator (PCG-XSH-RR 64/32, O'Neill 2014). The same seed and stream give the same
/// numbers on every platform. Not thread safe: give each thread or each item its own stream.
class Rng {
 public:
  explicit Rng(std::uint64_t seed, std::uint64_t stream = 0);

  std::uint32_t next_u32();
  /// Uniform in [0, 1).
  double uniform();
  /// Uniform in [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in {0, ..., n-1}; n > 0.
  std::uint32_t below(std::uint32_t n);
  /// Normal with the given mean and standard deviation (Box-Muller).
  double normal(double mean = 0.0, double sigma = 1.0);

 private:
  std::uint64_t state_ = 0;
  std::uint64_t increment_ = 0;
  double spare_ = 0.0;
  bool has_spare_ = false;
};

}  // namespace hm
