#pragma once
#include <cstdint>
#include <filesystem>
#include <string>

#include "hm/core/json_value.hpp"
#include "hm/core/result.hpp"
#include "hm/geometry/box.hpp"
#include "hm/mvog/multi_volume_grid.hpp"

namespace hm {

/// Summary of a multi-volume occupancy grid for `hm info`.
struct MvogReport {
  double resolution_m = 0;
  MvogSize size;
  Box3 bounds_m;  ///< of all that is known
  std::uint64_t file_bytes = 0;
};
/// Reads all of a grid (.mvog).
Result<MvogReport> inspect_mvog(const std::filesystem::path& path);
JsonValue to_json(const MvogReport& report);
std::string to_text(const MvogReport& report);

}  // namespace hm
