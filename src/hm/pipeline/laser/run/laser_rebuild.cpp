#include "hm/pipeline/laser/run/laser_rebuild.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "hm/geometry/state_bytes.hpp"

namespace hm {
namespace {

constexpr std::size_t kScansPerReport = 100;

constexpr std::size_t kFileBufferBytes = std::size_t{1} << 16u;

}  // namespace

const LaserScan* find_scan(const LaserRecording& recording, const MappedScan& mapped) {
  const auto& scans = recording.lasers[mapped.laser].scans;
  const auto found = std::lower_bound(scans.begin(), scans.end(), mapped.scan_stamp,
                                      [](const LaserScan& scan, Time stamp) { return scan.stamp < stamp; });
  return found != scans.end() && found->stamp == mapped.scan_stamp ? &*found : nullptr;
}

std::optional<MappedScan> mapped_scan(const LaserStep& step) {
  if (!step.T_odom_base || step.sweep.empty()) return std::nullopt;
  return MappedScan{step.laser, step.scan_stamp, step.stamp, *step.T_odom_base, step.sweep};
}

void MappedScanFile::note_failure() {
  if (failure_ == 0) failure_ = errno != 0 ? errno : EIO;
}

void MappedScanFile::open() {
  const std::filesystem::path path = folder_ / "mapped_scans";
  const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (descriptor < 0) return note_failure();
  ::unlink(path.c_str());
  file_.reset(::fdopen(descriptor, "w+b"));
  if (file_) {
    std::setvbuf(file_.get(), nullptr, _IOFBF, kFileBufferBytes);
    return;
  }
  note_failure();
  ::close(descriptor);
}

void MappedScanFile::write(const void* bytes, std::size_t count) {
  errno = 0;
  if (failure_ == 0 && std::fwrite(bytes, 1, count, file_.get()) != count) note_failure();
}

void MappedScanFile::add(MappedScan scan) {
  if (!file_ && failure_ == 0) open();
  if (failure_ != 0) return;
  StateWriter record;
  record(scan);
  const std::uint64_t size = record.bytes().size();
  write(&size, sizeof size);
  write(record.bytes().data(), record.bytes().size());
  ++count_;
}

Result<void> MappedScanFile::written() const {
  if (failure_ == 0) return {};
  return fail(ErrorCode::kUnreadable, folder_.string(),
              "the scans of the map cannot be kept here until it is rebuilt: {}", std::strerror(failure_));
}

Result<void> MappedScanFile::for_each(const std::function<void(const MappedScan&)>& take) {
  errno = 0;
  if (file_ && failure_ == 0 && std::fseek(file_.get(), 0, SEEK_SET) != 0) note_failure();
  const auto read = [this](void* bytes, std::size_t count) {
    errno = 0;
    if (failure_ == 0 && std::fread(bytes, 1, count, file_.get()) != count) note_failure();
    return failure_ == 0;
  };
  std::vector<std::uint8_t> bytes;
  std::uint64_t size = 0;
  for (std::size_t i = 0; i < count_ && read(&size, sizeof size); ++i) {
    bytes.resize(size);
    if (!read(bytes.data(), bytes.size())) break;
    MappedScan scan;
    StateReader record(bytes);
    record(scan);
    if (!record.ok()) {
      note_failure();
      break;
    }
    take(scan);
  }
  if (file_ && failure_ == 0 && std::fseek(file_.get(), 0, SEEK_END) != 0) note_failure();
  return written();
}

Result<MultiVolumeGrid> rebuild_laser_map(const RebuildInput& input, const LaserParameters& params,
                                          const RunContext& run) {
  MultiVolumeGrid grid(params.mvog);
  SweepPoints points(params.run.clear_without_return_m);
  std::size_t done = 0;
  const auto read = input.scans.for_each([&](const MappedScan& mapped) {
    if (++done % kScansPerReport == 0 && run.progress)
      run.progress({"map of the corrected path", done, input.scans.count(), {}});
    const LaserScan* scan = find_scan(input.recording, mapped);
    if (!scan) return;
    const SE2 T_map_odom = input.map_frame.T_map_odom_at(mapped.stamp, SE2::from_se3(mapped.T_odom_base));
    points.compute_again(*scan, input.rigs[mapped.laser], mapped.sweep, T_map_odom.to_se3());
    grid.insert(points.beam_scan());
  });
  if (!read) return forward_error(read);
  return grid;
}

}  // namespace hm
