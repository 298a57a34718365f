#include "saved_run_readers.hpp"

#include <cstring>
#include <vector>

#include "fuzz_readers.hpp"
#include "hm/core/hash.hpp"
#include "hm/pipeline/dense/reconstruction_state.hpp"
#include "hm/pipeline/rgbd/resume/slam_checkpoint.hpp"
#include "hm/pipeline/rgbd/resume/slam_journal.hpp"

namespace hm::fuzz {

bool read_reconstruction_state(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto state = state_from_json(text, "map.hmap");
  if (!accepted(state)) return false;
  const std::string written = state_to_json(*state);
  const auto again = state_from_json(written, "again");
  HM_CHECK(again && state_to_json(*again) == written, "what was read is written otherwise");
  return true;
}

bool read_checkpoint(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kChecksumAt = 12, kSizeAt = 20, kBodyAt = 28;
  std::vector<std::uint8_t> sealed(bytes.begin(), bytes.end());
  if (sealed.size() >= kBodyAt) {
    const std::uint64_t size = sealed.size() - kBodyAt, sum = fnv1a(std::span(sealed).subspan(kBodyAt));
    std::memcpy(sealed.data() + kChecksumAt, &sum, sizeof sum);
    std::memcpy(sealed.data() + kSizeAt, &size, sizeof size);
  }
  const auto checkpoint = parse_slam_checkpoint(sealed, "slam_state.bin");
  if (!accepted(checkpoint)) return false;
  HM_CHECK(to_file_bytes(*checkpoint) == sealed, "what was read is written otherwise");
  return true;
}

bool read_journal(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kHeader = 16, kHead = 16;  // of the file; size and checksum of a record
  std::vector<std::uint8_t> sealed(bytes.begin(), bytes.end());
  JournalMark mark{sealed.size(), 0, 0};
  for (std::size_t at = kHeader; at + kHead <= sealed.size(); ++mark.frames) {
    std::uint64_t size = 0;
    std::memcpy(&size, sealed.data() + at, sizeof size);
    if (size > sealed.size() - at - kHead) break;
    const std::uint64_t sum = fnv1a(std::span(sealed).subspan(at + kHead, static_cast<std::size_t>(size)));
    std::memcpy(sealed.data() + at + sizeof size, &sum, sizeof sum);
    Fnv1a digest;
    digest.add(mark.digest);
    digest.add(sum);
    mark.digest = digest.value();
    at += kHead + static_cast<std::size_t>(size);
  }
  const auto records = read_slam_journal(as_file("slam_journal.bin", sealed), mark);
  if (!accepted(records)) return false;
  for (std::size_t i = 1; i < records->size(); ++i)
    HM_CHECK((*records)[i - 1].index < (*records)[i].index, "frame {} does not increase", i);
  return true;
}

}  // namespace hm::fuzz
