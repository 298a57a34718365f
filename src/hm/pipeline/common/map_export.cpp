#include "hm/pipeline/common/map_export.hpp"

#include <fmt/format.h>

#include <system_error>

namespace hm {

Result<bool> written_unless_too_large(const std::filesystem::path& path, const Result<void>& written,
                                      std::vector<std::string>& warnings) {
  if (written) return true;
  if (written.error().code != ErrorCode::kInvalidValue) return forward_error(written);
  std::error_code ignored;
  std::filesystem::remove(path, ignored);
  warnings.push_back(fmt::format("no {}: {}", path.filename().string(), written.error().message));
  return false;
}

}  // namespace hm
