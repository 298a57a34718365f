// From reset to main(): FPU, stack, data, constructors.
#include <cstdint>

#include "board.hpp"
#include "stack.hpp"

extern "C" {
extern std::uint32_t stack_begin[], stack_end[], data_begin[], data_end[], data_load[], bss_begin[],
    bss_end[];
using Constructor = void (*)();
extern const Constructor init_array_begin[], init_array_end[];
int main();

/// Called by reset(), which has switched the FPU on and painted the stack.
[[noreturn, gnu::used]] void start_program() {
  const std::uint32_t* from = data_load;
  for (std::uint32_t* to = data_begin; to != data_end; ++to) *to = *from++;
  for (std::uint32_t* to = bss_begin; to != bss_end; ++to) *to = 0;
  for (const Constructor* constructor = init_array_begin; constructor != init_array_end; ++constructor)
    (*constructor)();
  main();
  hm::board::stop_motors();
}

/// Before anything else the FPU is switched on (CPACR), since the compiler may use it anywhere; then the
/// stack is filled with a pattern, of which stack_unused() finds the rest.
[[gnu::naked]] void reset() {
  asm volatile(
      "ldr r0, =0xE000ED88\n"
      "ldr r1, [r0]\n"
      "orr r1, r1, #0xF00000\n"
      "str r1, [r0]\n"
      "dsb\n"
      "isb\n"
      "ldr r0, =stack_begin\n"
      "ldr r1, =stack_end\n"
      "ldr r2, =%c0\n"
      "1: str r2, [r0], #4\n"
      "cmp r0, r1\n"
      "bne 1b\n"
      "b start_program\n"
      ".ltorg\n" ::"i"(hm::board::kStackPattern));
}

/// A fault, of which a stack that is full is one: with a fresh stack, the motors are stopped.
[[gnu::naked]] void fault() {
  asm volatile(
      "ldr r0, =stack_end\n"
      "mov sp, r0\n"
      "b stop_after_fault\n"
      ".ltorg\n");
}
[[noreturn, gnu::used]] void stop_after_fault() { hm::board::stop_motors(); }
}

namespace {

struct Vectors {
  const void* stack;
  void (*handlers[15])();
};
/// The first sixteen entries of the vector table: no interrupt is used.
[[gnu::section(".vectors"), gnu::used]] const Vectors vectors{
    stack_end,
    {reset, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault,
     fault}};

}  // namespace

std::uint32_t hm::board::stack_unused() {
  const std::uint32_t* word = stack_begin;
  while (word != stack_end && *word == kStackPattern) ++word;
  return static_cast<std::uint32_t>(word - stack_begin) * 4U;
}
