// A board whose sensors and motors are a simulator at the other end of its serial port (USART1): the emulated
// netduinoplus2. Records of core.trace come and go, a step at a time (docs/firmware.md).
#include "board.hpp"

#include <span>

#include "hm/flight/trace/core_recorder.hpp"
#include "hm/flight/trace/core_replay.hpp"
#include "registers.hpp"
#include "stack.hpp"

namespace hm::board {
namespace {

CoreTraceParser parser;
CoreInputReader reader;
std::uint32_t sequence = 0;

void send(std::uint8_t byte) {
  while ((usart_status() & kMaySend) == 0) {
  }
  usart_data() = byte;
}

/// Sleeps until a byte is there: interrupts are masked, their requests only wake the processor. (An emulator
/// whose processor asks again and again hardly finds time for its port.)
std::uint8_t receive() {
  for (;;) {
    nvic_clear_pending_1() = kUsart1Interrupt;
    if ((usart_status() & kReceived) != 0) break;
    asm volatile("dsb\n wfi" ::: "memory");
  }
  return static_cast<std::uint8_t>(usart_data());
}

}  // namespace

void start() {
  rcc_apb2_enable() = rcc_apb2_enable() | kUsart1Clock;
  usart_baud() = 84'000'000 / 921'600;
  asm volatile("cpsid i");
  nvic_enable_1() = kUsart1Interrupt;
  usart_control() = kUsartOn;
  send('R');  // ready: what was sent before is lost
}

const AutopilotInputs& wait_step() {
  for (;;) {
    while (const auto record = parser.next())
      if (const AutopilotInputs* inputs = reader.add(*record)) return *inputs;
    parser.push(receive());
  }
}

void drive(const AutopilotOutputs& outputs, const BasicVehicleState<float>& estimate) {
  const CoreTraceFrame frame = frame_of(core_outputs_record(outputs, estimate, ++sequence));
  for (const std::uint8_t byte : std::span(frame.bytes).first(frame.size)) send(byte);
}

void stop_motors() {
  send('F');  // fault
  for (;;) {
  }
}

}  // namespace hm::board
