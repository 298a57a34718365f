#include "hm/mapping/map_writer.hpp"

#include <bit>
#include <chrono>
#include <new>
#include <utility>

namespace hm {
namespace {

Result<void> out_of_memory(const MapFile& file) {
  return fail(ErrorCode::kOutOfMemory, file.path().string(), "out of memory while the map is saved");
}

}  // namespace

MapWriter::MapWriter(MapFile& file, std::set<VolumeKey>& marks, MakeHeader make_header)
    : file_(file),
      marks_(marks),
      make_header_(std::move(make_header)),
      outcome_(std::async(std::launch::async, [this] { return write_all(); })) {}

MapWriter::~MapWriter() {
  {
    const std::scoped_lock lock(mutex_);
    if (state_ == State::kOpen) state_ = State::kAbandoned;
  }
  changed_.notify_all();
  if (outcome_.valid()) outcome_.wait();
}

std::size_t MapWriter::waiting() {
  const std::scoped_lock lock(mutex_);
  return waiting_;
}

void MapWriter::wait_below(std::size_t volumes) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return waiting_ < volumes || state_ == State::kFailed; });
}

void MapWriter::add(std::vector<PageSnapshot> pages) {
  {
    const std::scoped_lock lock(mutex_);
    if (state_ == State::kFailed) return;
    for (PageSnapshot& page : pages) {
      waiting_ += page.volumes.size();
      pages_.push_back(std::move(page));
    }
  }
  changed_.notify_all();
}

void MapWriter::close() {
  {
    const std::scoped_lock lock(mutex_);
    if (state_ == State::kOpen) state_ = State::kClosed;
  }
  changed_.notify_all();
}

bool MapWriter::is_done() const {
  return outcome_.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

Result<void> MapWriter::finish() {
  try {
    return outcome_.get();
  } catch (const std::bad_alloc&) {
    return out_of_memory(file_);
  }
}

/// Takes the next page; false when there are no more.
bool MapWriter::next(PageSnapshot& page) {
  std::unique_lock lock(mutex_);
  waiting_ -= page.volumes.size();  // of the previous page, which has been written
  page = {};
  changed_.notify_all();
  changed_.wait(lock, [&] { return !pages_.empty() || state_ != State::kOpen; });
  if (pages_.empty() || state_ == State::kAbandoned) return false;
  page = std::move(pages_.front());
  pages_.pop_front();
  return true;
}

Result<void> MapWriter::write_pages() {
  try {
    PageSnapshot page;
    while (next(page))
      if (const auto written = write(page); !written) return written;
    {
      const std::scoped_lock lock(mutex_);
      if (state_ == State::kAbandoned) return {};
    }
    return file_.commit(make_header_());
  } catch (const std::bad_alloc&) {
    return out_of_memory(file_);
  }
}

void MapWriter::give_up() {
  {
    const std::scoped_lock lock(mutex_);
    state_ = State::kFailed;
    pages_.clear();
    waiting_ = 0;
  }
  changed_.notify_all();
}

Result<void> MapWriter::write_all() {
  // Runs even if allocating the error message fails, so that no caller waits for a thread that has ended.
  struct AtEnd {
    MapWriter& writer;
    bool succeeded;
    ~AtEnd() {
      if (!succeeded) writer.give_up();
    }
  } at_end{*this, false};
  Result<void> outcome = write_pages();
  at_end.succeeded = outcome.has_value();
  return outcome;
}

Result<void> MapWriter::write(const PageSnapshot& page) {
  std::uint64_t gone = page.wanted;
  std::vector<MapBlockView> blocks;
  voxels_.resize(page.volumes.size() * 2 * kMapBlockVoxels);
  for (const VolumeSnapshot& volume : page.volumes) {
    std::uint32_t* plane = voxels_.data() + blocks.size() * 2 * kMapBlockVoxels;
    static_assert(sizeof(TsdfVoxel) == 4 && sizeof(ColorVoxel) == 4 && kMapBlockVoxels == kVolumeVoxels);
    volume.contents.unpack(reinterpret_cast<TsdfVoxel*>(plane),
                           reinterpret_cast<ColorVoxel*>(plane + kMapBlockVoxels));
    MapBlockView view{{volume.key.x, volume.key.y, volume.key.z}, {plane, kMapBlockVoxels}, {}};
    if (volume.contents.has_colors()) view.colors = {plane + kMapBlockVoxels, kMapBlockVoxels};
    blocks.push_back(view);
    gone &= ~place_bit(volume.key);
    if (volume.may_hold_interior != volume.contents.holds_interior())
      marks_.insert(volume.key);
    else
      marks_.erase(volume.key);
  }
  std::vector<MapBlockKey> erased;
  for (; gone != 0; gone &= gone - 1) {
    const VolumeKey key = key_at(page.page, std::countr_zero(gone));
    erased.push_back({key.x, key.y, key.z});
    marks_.erase(key);
  }
  if (const auto done = file_.erase(erased); !done) return done;
  return file_.put_blocks(blocks);
}

}  // namespace hm
