// Rows about the link: damaged frames, resynchronisation, clocks.
#include <algorithm>
#include <cmath>

#include "hm/core/statistics.hpp"
#include "hm/link/testing/random_messages.hpp"
#include "hm/link/time_sync.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

using link_testing::parse_all;
using link_testing::random_frame;
using link_testing::wire_bytes;

/// Frames that a parser accepts of `count` frames with 1 to 8 wrong bytes in random places, each alone. A
/// checksum of 16 bits lets one of 65,536 pass by chance.
std::size_t accepted_of_damaged(std::size_t count) {
  Rng rng(11);
  std::size_t accepted = 0;
  for (std::size_t n = 0; n < count; ++n) {
    const std::vector<std::uint8_t> good = wire_bytes(random_frame(n, rng));
    std::vector<std::uint8_t> bytes = good;
    while (bytes == good)
      for (std::uint32_t k = 1 + rng.below(8); k > 0; --k)
        bytes[rng.below(static_cast<std::uint32_t>(bytes.size()))] =
            static_cast<std::uint8_t>(rng.next_u32());
    MavlinkParser parser;
    accepted += parse_all(parser, bytes).size();
    while (parser.next_at_end()) ++accepted;
  }
  return accepted;
}

/// After noise full of start bytes: the number of good frames until one is accepted, at most.
std::size_t frames_until_resync(int rounds) {
  Rng rng(12);
  std::size_t most = 0;
  for (int round = 0; round < rounds; ++round) {
    std::vector<std::uint8_t> noise(rng.below(300));
    for (std::uint8_t& byte : noise) {
      byte = static_cast<std::uint8_t>(rng.next_u32());
      if (rng.below(8) == 0) byte = rng.below(2) ? kMavlink2Start : kMavlink1Start;
    }
    MavlinkParser parser;
    std::size_t arrived = parse_all(parser, noise).size(), sent = 0;
    while (arrived == 0 && sent < 100)
      arrived +=
          parse_all(parser, wire_bytes(random_frame(static_cast<std::size_t>(round) + ++sent, rng))).size();
    most = std::max(most, sent);
  }
  return most;
}

/// Largest error (s) of the other clock's time over ten minutes, from the 32nd exchange on, one a second:
/// delays of 1 ms each way with exponential jitter of 1 ms, and up to 20 ms more in one of ten.
double clock_error_s(double drift, std::uint64_t seed) {
  Rng rng(seed);
  TimeSync sync;
  const auto remote = [&](double t_s) { return Time::from_seconds(1000 + t_s + drift * t_s); };
  const auto delay_s = [&] {
    const double jitter_s = -0.001 * std::log(1 - rng.uniform());
    return 0.001 + jitter_s + (rng.below(10) == 0 ? 0.02 * rng.uniform() : 0);
  };
  double worst_s = 0;
  for (int second = 0; second < 600; ++second) {
    const double there_s = delay_s(), back_s = delay_s();
    sync.add(Time::from_seconds(second), remote(second + there_s),
             Time::from_seconds(second + there_s + back_s));
    if (second < static_cast<int>(TimeSync::kWindow)) continue;
    for (const double later_s : {0.1, 0.9}) {
      const double t_s = second + later_s;
      worst_s =
          std::max(worst_s, std::abs((*sync.to_remote(Time::from_seconds(t_s)) - remote(t_s)).seconds()));
    }
  }
  return worst_s;
}

}  // namespace

Result<BenchResult> bench_link_noise(const BenchOptions& options) {
  const std::size_t frames = options.frame_limit > 0 ? 10'000 : 1'000'000;
  std::vector<double> clock_s;
  for (std::uint64_t seed = 1; seed <= 20; ++seed)
    for (const double drift : {50e-6, -50e-6}) clock_s.push_back(clock_error_s(drift, seed));
  BenchResult result;
  result.rows = {{"link_noise", static_cast<double>(accepted_of_damaged(frames)), {}},
                 {"link_noise_resync", static_cast<double>(frames_until_resync(30'000)), {}},
                 {"link_noise_clock", 1e3 * quantile(clock_s, 0.95), {}}};
  result.details = JsonValue::object({{"frames", frames},
                                      {"by_chance", static_cast<double>(frames) / 65536},
                                      {"clock_median_ms", 1e3 * quantile(clock_s, 0.5)},
                                      {"clock_worst_ms", 1e3 * quantile(clock_s, 1)}});
  return result;
}

}  // namespace hm::bench
