#include "hm/io/mesh/isolated_call.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <csignal>
#include <new>
#include <string>

#include "hm/core/testing/sanitized.hpp"

namespace hm {
namespace {

using testing::HasSubstr;

constexpr IsolationLimits kPlenty{std::uint64_t{1} << 30U, 60};

TEST(IsolatedCall, GivesTheResultOrTheErrorOfTheWork) {
  const std::string large(10'000'000, 'x');
  const pid_t here = ::getpid();
  int calls = 0;
  const auto result = call_isolated("a", kPlenty, [&]() -> Result<std::string> {
    ++calls;
    return (::getpid() != here ? "elsewhere " : "here ") + large;
  });
  ASSERT_TRUE(result) << to_string(result.error());
  EXPECT_EQ(*result, "elsewhere " + large);
  EXPECT_EQ(calls, 0);  // of this process
  EXPECT_EQ(*call_isolated("a", kPlenty, [] { return Result<std::string>(""); }), "");
  const auto error = call_isolated("a.stl", kPlenty, []() -> Result<std::string> {
    return fail(ErrorCode::kUnsupported, "elsewhere", "too {}", "new");
  });
  ASSERT_FALSE(error);
  EXPECT_EQ(error.error().code, ErrorCode::kUnsupported);
  EXPECT_EQ(to_string(error.error()), "a.stl: too new");
}

TEST(IsolatedCall, ACrashIsAnError) {
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE}) {
    const auto result = call_isolated("a.stl", kPlenty, [signal]() -> Result<std::string> {
      std::raise(signal);
      return "";
    });
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kCorrupted);
    EXPECT_THAT(to_string(result.error()), HasSubstr("a.stl: its reader crashed"));
  }
  const auto left = call_isolated("a.stl", kPlenty, []() -> Result<std::string> { ::_exit(3); });
  ASSERT_FALSE(left);
  EXPECT_THAT(left.error().message, HasSubstr("gave up"));
  // Part of an answer is none.
  const auto exits = call_isolated("a.stl", kPlenty, []() -> Result<std::string> { ::_exit(0); });
  EXPECT_FALSE(exits);
}

TEST(IsolatedCall, ALoopEnds) {
  const auto result = call_isolated("a.stl", {kPlenty.memory_bytes, 1}, []() -> Result<std::string> {
    for (volatile bool forever = true; forever;) {
    }
    return "";
  });
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("takes longer than 1 s"));
  const auto waits = call_isolated("a.stl", {kPlenty.memory_bytes, 1}, []() -> Result<std::string> {
    for (;;) ::pause();
  });
  ASSERT_FALSE(waits);
  EXPECT_THAT(waits.error().message, HasSubstr("takes longer than 1 s"));
}

TEST(IsolatedCall, TooMuchMemoryIsAnError) {
  if (test::kSanitized) GTEST_SKIP() << "sanitizers reserve all address space: there is no limit";
  const auto result = call_isolated("a.stl", {64 << 20, 60}, []() -> Result<std::string> {
    std::string bytes(std::size_t{200} << 20U, 'x');
    return bytes;
  });
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kOutOfMemory);
}

}  // namespace
}  // namespace hm
