#include "hm/core/text/known_words.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace hm {
namespace {

constexpr std::string_view kKnown[] = {"ply", "obj"};

TEST(KnownWords, AreSeparatedByCommasAndBlanks) {
  EXPECT_THAT(known_words("ply, obj", kKnown).words, testing::ElementsAre("ply", "obj"));
  EXPECT_THAT(known_words(" obj,,obj", kKnown).words, testing::ElementsAre("obj", "obj"));
  EXPECT_TRUE(known_words("", kKnown).words.empty());
  EXPECT_EQ(known_words("ply, obj", kKnown).unknown, "");
}

TEST(KnownWords, EndAtTheFirstUnknownOne) {
  const KnownWords found = known_words("ply,stl,obj,glb", kKnown);
  EXPECT_EQ(found.unknown, "stl");
  EXPECT_THAT(found.words, testing::ElementsAre("ply"));
}

}  // namespace
}  // namespace hm
