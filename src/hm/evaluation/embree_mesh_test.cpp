#include "hm/evaluation/embree_mesh.hpp"

#include <embree3/rtcore.h>
#include <gtest/gtest.h>

namespace hm {
namespace {

TEST(EmbreeMesh, OnlyMemoryIsCalledMemory) {
  const Error memory = embree_error(RTC_ERROR_OUT_OF_MEMORY, "bad_alloc", 12);
  EXPECT_EQ(memory.code, ErrorCode::kOutOfMemory);
  EXPECT_NE(memory.message.find("out of memory"), std::string::npos) << memory.message;
  for (const RTCError code : {RTC_ERROR_UNKNOWN, RTC_ERROR_INVALID_ARGUMENT, RTC_ERROR_INVALID_OPERATION,
                              RTC_ERROR_UNSUPPORTED_CPU, RTC_ERROR_CANCELLED}) {
    const Error other = embree_error(code, "Resource temporarily unavailable", 12);
    EXPECT_EQ(other.code, ErrorCode::kInternal) << code;
    EXPECT_EQ(other.message.find("memory"), std::string::npos) << other.message;
    EXPECT_NE(other.message.find("Resource temporarily unavailable"), std::string::npos) << other.message;
    EXPECT_NE(embree_error(code, "", 12).message.find("no reason given"), std::string::npos);
  }
}

}  // namespace
}  // namespace hm
