#pragma once
#include <string>
#include <vector>

namespace hm {

/// Lines from a descriptor (a terminal, a pipe), without waiting for them.
class LiveLines {
 public:
  explicit LiveLines(int descriptor) : descriptor_(descriptor) {}
  /// The whole lines that have arrived since the last call, without line ends. At the end of the input what
  /// stands there without a line end is a line too. A line longer than 4 kB is cut.
  std::vector<std::string> take();
  /// No line will come any more.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  bool read_some();
  int descriptor_;
  std::string rest_;
  bool ended_ = false;
};

}  // namespace hm
