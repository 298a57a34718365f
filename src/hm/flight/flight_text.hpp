#pragma once
#include <string_view>

#include "hm/flight/fail_safes.hpp"
#include "hm/flight/flight_state.hpp"

namespace hm {

// Words for people; the core itself only knows the numbers.

[[nodiscard]] std::string_view text_of(AutopilotState state);
[[nodiscard]] std::string_view text_of(FlightPhase phase);
/// Why a command was refused, with what to do about it.
[[nodiscard]] std::string_view text_of(Refusal refusal);
/// Why a fail-safe acts.
[[nodiscard]] std::string_view text_of(FailSafe reason);

}  // namespace hm
