#include <functional>

#include "hm/io/testing/io_test_support.hpp"
#include "hm/io/testing/testing_recordings.hpp"

/// Every prefix and many random corruptions of every file of small recordings: an Error or frames, never a
/// crash (run under ASan and UBSan).
namespace hm {
namespace {

namespace fs = std::filesystem;
using namespace testing_recordings;

/// Opens what is there and reads every frame; errors must name a place and a reason.
void open_and_read(const fs::path& path) {
  const auto opened = open_recording(path);
  if (!opened) {
    EXPECT_FALSE(opened.error().where.empty()) << opened.error().message;
    EXPECT_FALSE(opened.error().message.empty());
    return;
  }
  const RecordingInfo& info = (*opened)->info();
  ASSERT_EQ(info.stamps.size(), info.frame_count);
  ASSERT_EQ(info.frame_poses.size(), info.frame_count);
  for (std::size_t i = 0; i < info.frame_count; ++i) {
    if (i > 0) {
      ASSERT_LT(info.stamps[i - 1], info.stamps[i]);
    }
    const auto frame = (*opened)->read(i);
    if (!frame) {
      EXPECT_FALSE(frame.error().where.empty());
      continue;
    }
    ASSERT_EQ(frame->depth.width(), info.camera.width);
    if (!frame->color.empty()) {
      ASSERT_EQ(frame->color.height(), info.camera.height);
    }
    if (frame->T_world_camera) {
      ASSERT_TRUE(is_rigid(*frame->T_world_camera));
    }
  }
}

/// A new file instead of the old one: some file systems wait for the disk when a file is overwritten.
void replace_file(const fs::path& file, std::string_view text) { test::write_bytes(file, std::string(text)); }

/// Calls `check` with the file cut at every length, and restored at the end.
void with_every_prefix(const fs::path& file, std::size_t step, const std::function<void()>& check) {
  const std::string whole = file_text(file);
  for (std::size_t n = 0; n < whole.size(); n += step) {
    replace_file(file, whole.substr(0, n));
    check();
    if (::testing::Test::HasFatalFailure()) return;
  }
  replace_file(file, whole);
}

/// Bytes changed, inserted or removed at random; in text often to characters that mean something there.
std::string corrupted(std::string bytes, Rng& rng) {
  constexpr std::string_view kMeaningful = "0123456789.-+eE#nafi \n\r\t/:=";
  for (std::uint32_t changes = 1 + rng.below(5); changes > 0 && !bytes.empty(); --changes) {
    const std::size_t at = rng.below(static_cast<std::uint32_t>(bytes.size()));
    const char value = rng.below(3) == 0
                           ? static_cast<char>(rng.below(256))
                           : kMeaningful[rng.below(static_cast<std::uint32_t>(kMeaningful.size()))];
    const std::uint32_t how = rng.below(4);
    if (how == 0)
      bytes.insert(at, 1, value);
    else if (how == 1)
      bytes.erase(at, 1 + rng.below(12));
    else
      bytes[at] = value;
  }
  return bytes;
}

void with_corruptions(const fs::path& file, int rounds, const std::function<void()>& check) {
  const std::string whole = file_text(file);
  Rng rng(whole.size());
  for (int round = 0; round < rounds; ++round) {
    replace_file(file, corrupted(whole, rng));
    check();
    if (::testing::Test::HasFatalFailure()) return;
  }
  replace_file(file, whole);
}

void fuzz(const fs::path& recording, const std::vector<fs::path>& texts,
          const std::vector<fs::path>& images) {
  const auto check = [&] { open_and_read(recording); };
  check();
  for (const fs::path& file : texts) {
    with_every_prefix(recording / file, 1, check);
    with_corruptions(recording / file, 500, check);
  }
  for (const fs::path& file : images) {
    with_every_prefix(recording / file, 7, check);
    with_corruptions(recording / file, 200, check);
  }
}

fs::path first_file(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) return entry.path();
  return {};
}

TEST(RecordingFuzz, Tum) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "r";
  write_small_tum(path, 2);
  ASSERT_TRUE(write_file_text(path / "poses.txt", file_text(path / "groundtruth.txt")));
  fuzz(path, {"depth.txt", "rgb.txt", "groundtruth.txt", "poses.txt", "camera.txt"},
       {first_file(path / "depth"), first_file(path / "rgb")});
}

TEST(RecordingFuzz, TumByAssociations) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "r";
  write_small_tum(path, 2);
  fs::remove(path / "depth.txt");
  fuzz(path, {"associations.txt"}, {});
}

TEST(RecordingFuzz, IclNuim) {
  const TemporaryFolder folder;
  write_small_icl(folder.path(), 2);
  fuzz(folder.path(), {"associations.txt", "groundtruth.txt"}, {});
}

TEST(RecordingFuzz, SevenScenes) {
  const TemporaryFolder folder;
  write_seven_scenes_frame(folder.path(), 0, matrix_text(random_pose(1).matrix()));
  write_seven_scenes_frame(folder.path(), 1, matrix_text(random_pose(2).matrix()));
  ASSERT_TRUE(write_file_text(folder.path() / "camera-intrinsics.txt", "30 0 16\n0 31 12\n0 0 1\n"));
  fuzz(folder.path(), {"frame-000000.pose.txt", "camera-intrinsics.txt"}, {"frame-000001.depth.png"});
}

}  // namespace
}  // namespace hm
