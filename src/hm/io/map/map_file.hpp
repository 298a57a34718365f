#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hm/core/result.hpp"

namespace hm {

/// Newest `.hmap` version that this program writes and reads.
inline constexpr int kMapFormatVersion = 1;
/// Number of voxels of one block: 8 x 8 x 8.
inline constexpr std::size_t kMapBlockVoxels = 512;

/// Coordinates of a block (x, y, z): its voxels have the world indices 8 * key + (0..7).
using MapBlockKey = std::array<std::int32_t, 3>;

/// Box of block keys from min to max, both included.
struct MapKeyBox {
  MapBlockKey min{};
  MapBlockKey max{};
  bool operator==(const MapKeyBox&) const = default;
};

/// Voxels of one block, 32 bits each in the volume grid's encoding, which the file does not interpret.
struct MapBlockView {
  MapBlockKey key{};
  std::span<const std::uint32_t> voxels;  ///< kMapBlockVoxels
  std::span<const std::uint32_t> colors;  ///< kMapBlockVoxels, or empty: no colour plane
};

/// Metadata of a map.
struct MapHeader {
  int format_version = kMapFormatVersion;
  double voxel_size_m = 0;           ///< edge of a voxel
  double sdf_unit_m = 0;             ///< distance of one unit of a voxel's signed distance
  std::string program_version;       ///< program that last saved the map
  std::string parameters_toml;       ///< parameters in effect
  std::string state_json;            ///< state of the pipeline: next frame, recording, counts ......
  std::int64_t created_unix_ms = 0;  ///< set by create() when 0
  std::int64_t updated_unix_ms = 0;  ///< set by commit()
};

enum class MapOpenMode {
  kRead,
  kReadLenient,  ///< like kRead, but damaged parts are skipped and counted where possible
  kReadWrite,
};

/// Outcome of reading blocks.
struct MapReadReport {
  std::uint64_t blocks_read = 0;
  std::uint64_t blocks_skipped = 0;   ///< damaged; only in kReadLenient
  bool complete = true;               ///< false: the callback asked to stop
  std::vector<std::string> problems;  ///< descriptions of the first few
};

/// Map on disk (`.hmap`; docs/file_formats.md): blocks of voxels by key, and a header.
///
/// All changes since the last commit() form one transaction together with the header that commit() writes: a
/// process killed at any time leaves the state of the last commit(). Closing without commit() drops the
/// changes, and so does an error of a change or of commit(), in memory and on disk. While no transaction is
/// open the map is a single file. One thread at a time may use a MapFile; several processes may read a file
/// while none writes it.
class MapFile {
 public:
  /// Creates an empty map, replacing an existing file. Errors: cannot be written, sizes not positive.
  static Result<MapFile> create(const std::filesystem::path& path, const MapHeader& header);
  /// Opens a map. An interrupted save is rolled back first. Errors: not found, not a map, a newer version
  /// (kUnsupported), truncated, corrupted. Reads the whole directory; kReadWrite checks the whole file.
  static Result<MapFile> open(const std::filesystem::path& path, MapOpenMode mode);

  ~MapFile();
  MapFile(MapFile&&) noexcept;
  MapFile& operator=(MapFile&&) noexcept;

  [[nodiscard]] const MapHeader& header() const;
  [[nodiscard]] const std::filesystem::path& path() const;

  /// Stores blocks, replacing those with the same keys; of equal keys in `blocks` the last counts. Blocks are
  /// packed in pages of 4 x 4 x 4, so passing all changed blocks in one call is fastest.
  Result<void> put_blocks(std::span<const MapBlockView> blocks);
  /// Removes blocks; missing keys are ignored.
  Result<void> erase(std::span<const MapBlockKey> keys);
  /// Removes all blocks.
  Result<void> clear();
  /// Makes all changes since the last commit durable, together with the pipeline's state.
  Result<void> commit(const std::string& state_json);
  /// Also replaces parameters and program version (not the voxel and unit sizes, which must be the same).
  Result<void> commit(const MapHeader& header);

  /// Calls `visit` with every block, or with those in `box`, sorted by pages, then by key (z, y, x); stops
  /// early when it returns false. The views are valid during the call. Only pages that touch the box are
  /// read. A damaged page is an error naming it, or skipped and counted in kReadLenient.
  Result<MapReadReport> for_each_block(const std::optional<MapKeyBox>& box,
                                       const std::function<bool(const MapBlockView&)>& visit) const;

  [[nodiscard]] std::uint64_t block_count() const;
  /// Bounding box of all keys; nothing for a map without blocks.
  [[nodiscard]] std::optional<MapKeyBox> key_bounds() const;
  /// Size of the file on disk in bytes.
  [[nodiscard]] std::uint64_t file_bytes() const;
  /// Descriptions of the damage that kReadLenient found when opening; empty: none.
  [[nodiscard]] const std::vector<std::string>& problems() const;

 private:
  struct Impl;
  explicit MapFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
