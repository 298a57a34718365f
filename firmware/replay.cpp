// Repeats the flight of a core.trace on the board, compares it with what was recorded, and measures each
// step.
//
// The file is named in the command line of semihosting. Prints "name: value" lines; ends with 0 when every
// step gave the recorded bits, 1 when one differs (the first is printed), 2 when there is no such file, 3
// when the processor faults.
#include <array>
#include <span>
#include <string_view>

#include "board.hpp"
#include "hm/flight/trace/core_replay.hpp"
#include "stm32f405/registers.hpp"
#include "stm32f405/semihosting.hpp"
#include "stm32f405/stack.hpp"

namespace {

using hm::semihosting::print;

hm::Autopilot autopilot;
hm::CoreReplay replay(autopilot);

/// Ticks of the processor's clock that something takes, up to 0.1 s.
class Stopwatch {
 public:
  Stopwatch() : start_(hm::board::systick_value()) {}
  [[nodiscard]] std::uint32_t ticks() const {
    return (start_ - hm::board::systick_value()) % hm::board::kSystickRange;
  }

 private:
  std::uint32_t start_;
};

struct Times {
  std::uint64_t sum = 0;
  std::uint32_t worst = 0;
  void add(std::uint32_t ticks) {
    sum += ticks;
    if (ticks > worst) worst = ticks;
  }
};

void report(std::string_view name, std::uint32_t value) {
  print(name);
  print(": ");
  print(value);
  print("\n");
}

void report(const hm::CoreDifference& difference) {
  print("difference: ");
  print(difference.field);
  print("\n");
  report("index", difference.index);
  report("step", difference.step);
  report("record", difference.sequence);
  report("recorded_bits", difference.recorded);
  report("replayed_bits", difference.replayed);
}

int run(std::uint32_t file) {
  std::array<std::uint8_t, hm::CoreTraceRecord::kBytes> bytes{};
  Times times;
  int result = 0;
  while (result == 0 && hm::semihosting::read(file, bytes) == bytes.size()) {
    const auto record = hm::decode_core_trace(bytes);
    if (!record) break;  // damaged: readable up to here
    if (const hm::AutopilotInputs* inputs = replay.read(*record)) {
      const Stopwatch watch;
      autopilot.step(*inputs);
      times.add(watch.ticks());
    }
    if (const auto difference = replay.compare(*record)) {
      report(*difference);
      result = 1;
    }
  }
  const std::uint32_t steps = replay.steps();
  report("steps", steps);
  report("mean_ticks", steps == 0 ? 0 : static_cast<std::uint32_t>(times.sum / steps));
  report("worst_ticks", times.worst);
  report("stack_unused_bytes", hm::board::stack_unused());
  return result;
}

}  // namespace

[[noreturn]] void hm::board::stop_motors() {
  print("fault: with so much of the stack never used, in bytes: ");
  print(stack_unused());
  print("\n");
  semihosting::exit(3);
}

int main() {
  static std::array<char, 256> name;
  hm::board::systick_reload() = hm::board::kSystickRange - 1;
  hm::board::systick_value() = 0;
  hm::board::systick_control() = 5;  // on, processor's clock, no interrupt
  if (!hm::semihosting::command_line(name)) hm::semihosting::exit(2);
  const auto file = hm::semihosting::open(std::string_view(name.data()));
  if (!file) {
    print("no such file\n");
    hm::semihosting::exit(2);
  }
  hm::semihosting::exit(run(*file));
}
