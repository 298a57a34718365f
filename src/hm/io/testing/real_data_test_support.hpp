#pragma once
#include <cstdlib>
#include <filesystem>

#include "hm/core/testing/source_folder.hpp"

namespace hm {

/// Folder of real recordings, if available: $HM_DATA, else ../shared/data beside the sources.
inline std::filesystem::path real_data_folder() {
  const char* given = std::getenv("HM_DATA");
  return given != nullptr ? std::filesystem::path(given) : test::source_folder() / ".." / "shared" / "data";
}

}  // namespace hm
