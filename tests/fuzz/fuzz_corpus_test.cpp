#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "fuzz_readers.hpp"
#include "fuzz_seeds.hpp"
#include "hm/core/testing/sanitized.hpp"
#include "hm/core/testing/source_folder.hpp"
#include "hm/io/bytes/file_bytes.hpp"

/// Every reader over its good files and over what fuzzing found in the past (corpus/READER/), without clang.
namespace hm::fuzz {
namespace {

namespace fs = std::filesystem;

TEST(FuzzCorpus, SeedsOfEveryReaderAreRead) {
  std::set<std::string_view> seeded;
  for (const Seed& seed : seeds()) {
    const Reader* reader = find_reader(seed.reader);
    ASSERT_NE(reader, nullptr) << seed.reader;
    EXPECT_TRUE(reader->run(seed.bytes)) << seed.reader << ", " << seed.bytes.size() << " bytes";
    seeded.insert(seed.reader);
  }
  for (const Reader& reader : readers()) EXPECT_TRUE(seeded.contains(reader.name)) << reader.name;
}

TEST(FuzzCorpus, CutOffAndChangedSeedsAreReadOrRefused) {
  const auto places = static_cast<std::size_t>(test::repetitions(40, 15));
  for (const Seed& seed : seeds()) {
    const Reader& reader = *find_reader(seed.reader);
    const std::size_t step = seed.bytes.size() / places + 1;
    for (std::size_t at = 0; at < seed.bytes.size(); at += step) {
      reader.run(std::span(seed.bytes).first(at));
      auto changed = seed.bytes;
      changed[at] = static_cast<std::uint8_t>(changed[at] ^ 0x81U);
      reader.run(changed);
    }
  }
}

TEST(FuzzCorpus, FormerFindingsAreReadOrRefused) {
  const fs::path corpus = test::source_folder() / "tests/fuzz/corpus";
  ASSERT_TRUE(fs::is_directory(corpus));
  for (const auto& folder : fs::directory_iterator(corpus)) {
    const Reader* reader = find_reader(folder.path().filename().string());
    ASSERT_NE(reader, nullptr) << folder.path();
    for (const auto& entry : fs::directory_iterator(folder)) {
      SCOPED_TRACE(entry.path().string());
      const auto bytes = read_file_bytes(entry.path());
      ASSERT_TRUE(bytes);
      reader->run(*bytes);
    }
  }
}

}  // namespace
}  // namespace hm::fuzz
