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

/// Writes one snapshot of a grid into a map file, page by page, on a thread of its own, as one transaction.
class MapWriter {
 public:
  /// Makes the header when all pages are written, on the writing thread.
  using MakeHeader = std::function<MapHeader()>;

  /// `marks` (see MapSaver) is kept up to date. Both must outlive this, and are the writer's until finish().
  MapWriter(MapFile& file, std::set<VolumeKey>& marks, MakeHeader make_header);
  /// Without finish(): drops what was not committed.
  ~MapWriter();
  MapWriter(const MapWriter&) = delete;
  MapWriter& operator=(const MapWriter&) = delete;

  /// Volumes that wait to be written.
  [[nodiscard]] std::size_t waiting();
  /// Waits until fewer than this many volumes wait, or writing failed.
  void wait_below(std::size_t volumes);
  void add(std::vector<PageSnapshot> pages);
  /// No more pages come: the header is written and the transaction ends.
  void close();
  /// True when finish() would not have to wait.
  [[nodiscard]] bool is_done() const;
  /// The outcome; waits for it. To be called once, after close().
  Result<void> finish();

 private:
  enum class State { kOpen, kClosed, kAbandoned, kFailed };
  Result<void> write_all();
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
