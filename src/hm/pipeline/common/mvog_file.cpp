#include "hm/pipeline/common/mvog_file.hpp"

#include "hm/io/bytes/file_bytes.hpp"

namespace hm {

Result<MultiVolumeGrid> read_mvog(const std::filesystem::path& path) {
  const auto bytes = read_file_bytes(path);
  if (!bytes) return forward_error(bytes);
  auto map = MultiVolumeGrid::parse(std::as_bytes(std::span(*bytes)));
  if (!map) map.error().where = path.string() + (map.error().where.empty() ? "" : ": " + map.error().where);
  return map;
}

}  // namespace hm
