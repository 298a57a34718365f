#include "hm/io/bytes/folder_lock.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <optional>
#include <utility>

#include "hm/io/testing/temporary_folder_test_support.hpp"

namespace hm {
namespace {

TEST(FolderLock, IsHeldOnceAndAsLongAsItLives) {
  const TemporaryFolder folder;
  auto first = FolderLock::acquire(folder / "new/deep");
  ASSERT_TRUE(first) << to_string(first.error());
  std::optional<FolderLock> held(std::move(*first));
  const auto second = FolderLock::acquire(folder / "new/deep");
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kUsage);
  EXPECT_EQ(second.error().where, folder / "new/deep");
  EXPECT_TRUE(FolderLock::acquire(folder / "new")) << "another folder";
  held.reset();
  EXPECT_TRUE(FolderLock::acquire(folder / "new/deep"));
}

TEST(FolderLock, WhatIsNoFolderIsNamed) {
  const TemporaryFolder folder;
  std::ofstream(folder / "file") << "not a folder";
  const auto lock = FolderLock::acquire(folder / "file");
  ASSERT_FALSE(lock);
  EXPECT_EQ(lock.error().code, ErrorCode::kUsage);
  EXPECT_EQ(lock.error().where, folder / "file");
}

}  // namespace
}  // namespace hm
