#pragma once
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <set>
#include <span>
#include <vector>

#include "hm/io/map/map_file.hpp"
#include "hm/tsdf/grid/volume_snapshot.hpp"

namespace hm {

/// Writes one snapshot of a grid to a map file, page by page, on a separate thread, as one transaction.
class MapWriter {
 public:
  /// Creates the header after all pages are written, on the writing thread.
  using MakeHeader = std::function<MapHeader()>;

  /// `marks` (see MapSaver) is updated. Both must outlive this object, and must not be used until finish().
  MapWriter(MapFile& file, std::set<VolumeKey>& marks, MakeHeader make_header);
  /// Without finish(), discards uncommitted changes.
  ~MapWriter();
  MapWriter(const MapWriter&) = delete;
  MapWriter& operator=(const MapWriter&) = delete;

  /// Number of volumes waiting to be written.
  [[nodiscard]] std::size_t waiting();
  /// Blocks until fewer than this many volumes wait, or writing failed.
  void wait_below(std::size_t volumes);
  void add(std::vector<PageSnapshot> pages);
  /// Ends the input: the header is written and the transaction committed.
  void close();
  /// True when finish() would not block.
  [[nodiscard]] bool is_done() const;
  /// Waits for the result. Call once, after close().
  Result<void> finish();

 private:
  enum class State { kOpen, kClosed, kAbandoned, kFailed };
  Result<void> write_all();
  void give_up();
  Result<void> write_pages();
  Result<void> write(const PageSnapshot& page);
  bool next(PageSnapshot& page);

  MapFile& file_;
  std::set<VolumeKey>& marks_;
  MakeHeader make_header_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<PageSnapshot> pages_;
  std::size_t waiting_ = 0;
  State state_ = State::kOpen;
  std::vector<std::uint32_t> voxels_;  // of the page being written
  std::future<Result<void>> outcome_;  // last: its thread uses the rest
};

}  // namespace hm
