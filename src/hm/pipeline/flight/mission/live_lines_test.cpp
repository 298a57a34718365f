#include "hm/pipeline/flight/mission/live_lines.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <array>

namespace hm {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// Both ends of a pipe.
class Pipe {
 public:
  Pipe() { EXPECT_EQ(::pipe(ends_.data()), 0); }
  ~Pipe() {
    ::close(ends_[0]);
    shut();
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void write(const std::string& text) const {
    EXPECT_EQ(::write(ends_[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void shut() {
    if (ends_[1] >= 0) ::close(ends_[1]);
    ends_[1] = -1;
  }
  [[nodiscard]] int reader() const { return ends_[0]; }

 private:
  std::array<int, 2> ends_{-1, -1};
};

TEST(LiveLines, GivesWholeLinesWithoutWaiting) {
  Pipe pipe;
  LiveLines lines(pipe.reader());
  EXPECT_THAT(lines.take(), IsEmpty());
  pipe.write("takeoff 1\ngo");
  EXPECT_THAT(lines.take(), ElementsAre("takeoff 1"));
  pipe.write("to 1 2 3\n\nland");
  EXPECT_THAT(lines.take(), ElementsAre("goto 1 2 3", ""));
  EXPECT_FALSE(lines.ended());
  pipe.shut();
  EXPECT_THAT(lines.take(), ElementsAre("land"));
  EXPECT_TRUE(lines.ended());
  EXPECT_THAT(lines.take(), IsEmpty());
}

TEST(LiveLines, CutsLinesWithoutAnEnd) {
  Pipe pipe;
  LiveLines lines(pipe.reader());
  pipe.write(std::string(10000, 'x'));
  std::size_t longest = 0;
  for (int i = 0; i < 10; ++i)
    for (const std::string& line : lines.take()) longest = std::max(longest, line.size());
  EXPECT_EQ(longest, 4096U);
}

TEST(LiveLines, AClosedDescriptorIsTheEnd) {
  LiveLines lines(-1);
  EXPECT_THAT(lines.take(), IsEmpty());
  LiveLines closed(1000);
  EXPECT_THAT(closed.take(), IsEmpty());
  EXPECT_TRUE(closed.ended());
}

}  // namespace
}  // namespace hm
