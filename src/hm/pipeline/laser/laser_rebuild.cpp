#include "hm/pipeline/laser/laser_rebuild.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace hm {
namespace {

constexpr std::size_t kScansPerReport = 100;

const LaserScan* find_scan(const LaserRecording& recording, const MappedScan& mapped) {
  const auto& scans = recording.lasers[mapped.laser].scans;
  const auto found = std::lower_bound(scans.begin(), scans.end(), mapped.scan_stamp,
                                      [](const LaserScan& scan, Time stamp) { return scan.stamp < stamp; });
  return found != scans.end() && found->stamp == mapped.scan_stamp ? &*found : nullptr;
}

constexpr std::size_t kFileBufferBytes = std::size_t{1} << 16u;
using PoseNumbers = std::array<double, 12>;

PoseNumbers numbers_of(const SE3& pose) {
  PoseNumbers numbers;
  Eigen::Map<Mat3>(numbers.data()) = pose.rotation();
  Eigen::Map<Vec3>(numbers.data() + 9) = pose.translation();
  return numbers;
}
SE3 pose_from(const PoseNumbers& numbers) {
  return {Mat3(Eigen::Map<const Mat3>(numbers.data())), Vec3(Eigen::Map<const Vec3>(numbers.data() + 9))};
}

/// What precedes the knots of a scan in the file.
struct ScanHead {
  std::uint64_t laser = 0, knots = 0;
  std::int64_t scan_stamp_ns = 0, stamp_ns = 0;
  PoseNumbers T_odom_base{};
};
struct KnotNumbers {
  std::uint64_t beam = 0;
  PoseNumbers T_odom_base{};
};

}  // namespace

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

void MappedScanFile::add(const MappedScan& scan) {
  if (!file_ && failure_ == 0) open();
  if (failure_ != 0) return;
  const ScanHead head{scan.laser, scan.sweep.size(), scan.scan_stamp.ns, scan.stamp.ns,
                      numbers_of(scan.T_odom_base)};
  write(&head, sizeof head);
  for (const SweepKnot& knot : scan.sweep) {
    const KnotNumbers numbers{knot.beam, numbers_of(knot.T_odom_base)};
    write(&numbers, sizeof numbers);
  }
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
  ScanHead head;
  KnotNumbers numbers;
  for (std::size_t i = 0; i < count_ && read(&head, sizeof head); ++i) {
    MappedScan scan{
        head.laser, Time{head.scan_stamp_ns}, Time{head.stamp_ns}, pose_from(head.T_odom_base), {}};
    for (std::size_t knot = 0; knot < head.knots && read(&numbers, sizeof numbers); ++knot)
      scan.sweep.push_back({numbers.beam, pose_from(numbers.T_odom_base)});
    if (failure_ == 0) take(scan);
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
