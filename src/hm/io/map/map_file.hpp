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

/// The newest `.hmap` version this program writes and reads.
inline constexpr int kMapFormatVersion = 1;
/// Voxels of one block: 8 x 8 x 8.
inline constexpr std::size_t kMapBlockVoxels = 512;

/// The place of a block: its voxels have the world indices 8 * key + (0..7), in the order x, y, z.
using MapBlockKey = std::array<std::int32_t, 3>;

/// Keys from min to max, both included, on each axis.
struct MapKeyBox {
  MapBlockKey min{};
  MapBlockKey max{};
  bool operator==(const MapKeyBox&) const = default;
};

/// The voxels of one block, 32 bits each, as the volume grid holds them; the file does not interpret them.
struct MapBlockView {
  MapBlockKey key{};
  std::span<const std::uint32_t> voxels;  ///< kMapBlockVoxels
  std::span<const std::uint32_t> colors;  ///< kMapBlockVoxels, or empty: no colour plane
};

/// What a map says about itself.
struct MapHeader {
  int format_version = kMapFormatVersion;
  double voxel_size_m = 0;           ///< edge of a voxel
  double sdf_unit_m = 0;             ///< distance of one unit of a voxel's signed distance
  std::string program_version;       ///< of the program that saved it last
  std::string parameters_toml;       ///< the parameters that were in effect
  std::string state_json;            ///< the pipeline's own state: next frame, recording, counts ...
  std::int64_t created_unix_ms = 0;  ///< set by create() when 0
  std::int64_t updated_unix_ms = 0;  ///< set by commit()
};

enum class MapOpenMode {
  kRead,
  kReadLenient,  ///< like kRead, but damaged parts are skipped and counted where possible
  kReadWrite,
};

/// What reading came across.
struct MapReadReport {
  std::uint64_t blocks_read = 0;
  std::uint64_t blocks_skipped = 0;   ///< damaged; only in kReadLenient
  bool complete = true;               ///< false: the callback asked to stop
  std::vector<std::string> problems;  ///< the first few, in words
};

/// A map on disk (`.hmap`; docs/file_formats.md): blocks of voxels by key, and a header.
///
/// All changes since the last commit() form one transaction together with the header that commit() writes: a
/// process killed at any moment leaves the state of the last commit(). Closing without commit() drops the
/// changes, and so does an Error from a change or from commit(): the map is then that of the last commit(),
/// in memory and on disk. A file that is not being written is a single file. One thread at a time may use a
/// MapFile; several processes may read a file while none writes it.
class MapFile {
 public:
  /// Makes a map without blocks, replacing a file that is there. Errors: no place to write, sizes not
  /// positive.
  static Result<MapFile> create(const std::filesystem::path& path, const MapHeader& header);
  /// Opens a map. A save that was interrupted is rolled back first. Errors: not there, not a map, a newer
  /// version (kUnsupported), truncated, corrupted. Costs a walk over the directory; kReadWrite checks the
  /// whole file.
  static Result<MapFile> open(const std::filesystem::path& path, MapOpenMode mode);

  ~MapFile();
  MapFile(MapFile&&) noexcept;
  MapFile& operator=(MapFile&&) noexcept;

  [[nodiscard]] const MapHeader& header() const;
  [[nodiscard]] const std::filesystem::path& path() const;

  /// Stores blocks, each replacing the one with its key; of equal keys in `blocks` the last counts. Blocks
  /// are packed by 4 x 4 x 4: it is fastest to pass everything that changed in one call.
  Result<void> put_blocks(std::span<const MapBlockView> blocks);
  /// Removes blocks; keys that are not there are ignored.
  Result<void> erase(std::span<const MapBlockKey> keys);
  /// Removes all blocks.
  Result<void> clear();
  /// Makes everything since the last commit durable, together with the pipeline's state.
  Result<void> commit(const std::string& state_json);
  /// Also replaces parameters and program version (not the voxel and unit sizes, which must be the same).
  Result<void> commit(const MapHeader& header);

  /// Calls `visit` with every block, or with those in `box`, sorted by pages, then by key (z, y, x); stops
  /// early when it returns false. The views are valid during the call. Only pages that touch the box are
  /// read. A damaged page is an Error naming it, or skipped and counted in kReadLenient.
  Result<MapReadReport> for_each_block(const std::optional<MapKeyBox>& box,
                                       const std::function<bool(const MapBlockView&)>& visit) const;

  [[nodiscard]] std::uint64_t block_count() const;
  /// The box around all keys; nothing for a map without blocks.
  [[nodiscard]] std::optional<MapKeyBox> key_bounds() const;
  /// The size of the file on disk.
  [[nodiscard]] std::uint64_t file_bytes() const;
  /// What kReadLenient found wrong when opening, in words; empty: nothing.
  [[nodiscard]] const std::vector<std::string>& problems() const;

 private:
  struct Impl;
  explicit MapFile(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace hm
