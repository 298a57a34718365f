#include "hm/core/text/counted.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace hm {
namespace {

TEST(Counted, SingularForOneOnly) {
  EXPECT_EQ(counted(0, "keyframe"), "0 keyframes");
  EXPECT_EQ(counted(1, "keyframe"), "1 keyframe");
  EXPECT_EQ(counted(2, "keyframe"), "2 keyframes");
  EXPECT_EQ(counted(std::size_t{1}, "vertex", "vertices"), "1 vertex");
  EXPECT_EQ(counted(std::size_t{3}, "vertex", "vertices"), "3 vertices");
  EXPECT_EQ(noun_for(1, "map"), "map");
  EXPECT_EQ(noun_for(1001, "map"), "maps");
}

TEST(Counted, SeparatesThousands) {
  EXPECT_EQ(counted(1918, "relation"), "1,918 relations");
  EXPECT_EQ(with_thousands(0), "0");
  EXPECT_EQ(with_thousands(999), "999");
  EXPECT_EQ(with_thousands(-1000), "-1,000");
  EXPECT_EQ(with_thousands(-999), "-999");
  EXPECT_EQ(with_thousands(1234567), "1,234,567");
  EXPECT_EQ(with_thousands(std::numeric_limits<std::int64_t>::min()), "-9,223,372,036,854,775,808");
}

}  // namespace
}  // namespace hm
