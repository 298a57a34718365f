#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "hm/core/result.hpp"

namespace hm {

/// Takes the outcome of writing `path` in a format that cannot hold every map (OctoMap: 32768 cells from the
/// origin). A map that does not fit costs this file only: it is left out (false) with a warning, and an
/// earlier run's file of that name is removed. True when it was written; other errors pass.
Result<bool> written_unless_too_large(const std::filesystem::path& path, const Result<void>& written,
                                      std::vector<std::string>& warnings);

}  // namespace hm
