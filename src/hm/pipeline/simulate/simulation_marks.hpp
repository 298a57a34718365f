#pragma once
#include <filesystem>

namespace hm::detail {

// The parameters in effect, beside what was simulated with them; the other name until all is written. What
// bears one of the two may be removed by remove_simulation().
inline constexpr const char* kFinishedMark = "simulation.toml";
inline constexpr const char* kUnfinishedMark = "simulation.unfinished.toml";

/// Removes the files of a simulation from its folder, whose lock the caller holds.
void remove_simulated_files(const std::filesystem::path& folder);

}  // namespace hm::detail
