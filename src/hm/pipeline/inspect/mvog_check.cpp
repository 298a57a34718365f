#include "hm/pipeline/inspect/mvog_check.hpp"

#include <fmt/format.h>

#include "hm/core/text/counted.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/pipeline/common/box_json.hpp"
#include "hm/pipeline/common/mvog_file.hpp"

namespace hm {

Result<MvogReport> inspect_mvog(const std::filesystem::path& path) {
  const auto map = read_mvog(path);
  if (!map) return forward_error(map);
  std::error_code code;
  const auto bytes = std::filesystem::file_size(path, code);
  return MvogReport{map->params().resolution_m, map->size(), map->bounds(), code ? 0 : bytes};
}

JsonValue to_json(const MvogReport& report) {
  return JsonValue::object({{"resolution_m", report.resolution_m},
                            {"columns", report.size.columns},
                            {"area_m2", report.size.area_m2},
                            {"volumes_positive", report.size.volumes_positive},
                            {"volumes_negative", report.size.volumes_negative},
                            {"runs", report.size.runs},
                            {"bounds_m", to_json(report.bounds_m)},
                            {"bytes", report.size.bytes},
                            {"file_bytes", report.file_bytes}});
}

std::string to_text(const MvogReport& report) {
  const Vec3 size = report.bounds_m.isEmpty() ? Vec3::Zero() : Vec3(report.bounds_m.sizes());
  return fmt::format(
      "multi-volume occupancy grid of {:g} m cells\n"
      "columns      {} known, {:.1f} m2\n"
      "volumes      {} occupied, {} free\n"
      "size         {:.2f} x {:.2f} x {:.2f} m, {:.2f} MB in memory, {:.2f} MB on disk\n",
      report.resolution_m, with_thousands(report.size.columns), report.size.area_m2,
      with_thousands(report.size.volumes_positive), with_thousands(report.size.volumes_negative), size.x(),
      size.y(), size.z(), static_cast<double>(report.size.bytes) * 1e-6,
      static_cast<double>(report.file_bytes) * 1e-6);
}

}  // namespace hm
