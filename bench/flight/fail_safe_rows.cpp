// The row about fail-safes: each of the table (docs/flight.md), provoked in closed loop over seeds.
#include <algorithm>
#include <cmath>

#include "hm/core/parallel.hpp"
#include "hm/flight/flight_text.hpp"
#include "hm/pipeline/flight/testing/fail_safe_provocation.hpp"
#include "measurement.hpp"

namespace hm::bench {

namespace {

/// Without the rounding of times, and as a number where a fail-safe never acted (JSON has no infinity).
double whole_micro_steps(double steps) {
  constexpr double kNever_steps = 1e6, kMicro = 1e6;
  return std::min(std::round(steps * kMicro) / kMicro, kNever_steps);
}

}  // namespace

Result<BenchResult> bench_fly_failsafes(const BenchOptions& options) {
  constexpr int kSeeds = 20;
  const auto seeds =
      static_cast<std::size_t>(options.frame_limit > 0 ? std::min(options.frame_limit, kSeeds) : kSeeds);
  const FlightSite site(WorldKind::kHouse, 1);
  const std::vector<Provocation> all = fail_safe_provocations();
  std::vector<ProvocationOutcome> outcomes(all.size() * seeds);
  ParallelLoop(options.threads).for_ranges(outcomes.size(), 1, [&](std::size_t i, std::size_t) {
    outcomes[i] = provoke(site, all[i / seeds], static_cast<int>(i % seeds) + 1);
  });
  BenchResult result;
  double worst_steps = 0;
  std::size_t collisions = 0;
  for (std::size_t row = 0; row < all.size(); ++row) {
    std::vector<double> off_steps(all[row].judged.size(), 0.0);
    std::size_t touched = 0, ended_well = 0;
    for (std::size_t seed = 0; seed < seeds; ++seed) {
      const ProvocationOutcome& outcome = outcomes[row * seeds + seed];
      for (std::size_t i = 0; i < off_steps.size(); ++i)
        off_steps[i] = std::max(off_steps[i], whole_micro_steps(outcome.off_steps[i]));
      touched += outcome.collisions;
      ended_well += outcome.ended_well ? 1 : 0;
    }
    worst_steps = std::max(worst_steps, *std::max_element(off_steps.begin(), off_steps.end()));
    collisions += (stays_whole(all[row].end) ? touched : 0) +
                  (seeds - ended_well);  // what is cut or not carried falls, as it must
    JsonValue steps = JsonValue::object();
    for (std::size_t i = 0; i < off_steps.size(); ++i)
      steps[std::string(text_of(all[row].judged[i]))] = off_steps[i];
    result.details[all[row].name] =
        JsonValue::object({{"steps_off", steps}, {"collisions", touched}, {"ended_well", ended_well}});
  }
  result.details["seeds"] = seeds;
  result.rows = {{"fly_failsafes", worst_steps, {}},
                 {"fly_failsafes_collisions", static_cast<double>(collisions), {}}};
  return result;
}

}  // namespace hm::bench
