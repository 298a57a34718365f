#pragma once
#include <cstdint>

/// The registers that we use, by the reference manuals of the Cortex-M4 (ARM DDI 0403E) and the STM32F405
/// (RM0090).
namespace hm::board {

using Register = volatile std::uint32_t&;
inline Register at(std::uintptr_t address) { return *reinterpret_cast<volatile std::uint32_t*>(address); }

// System timer: counts down with the processor's clock.
inline Register systick_control() { return at(0xE000E010); }
inline Register systick_reload() { return at(0xE000E014); }
inline Register systick_value() { return at(0xE000E018); }
inline constexpr std::uint32_t kSystickRange = 1U << 24U;

// Clock gates, and the port USART1.
inline Register rcc_apb2_enable() { return at(0x40023844); }
inline constexpr std::uint32_t kUsart1Clock = 1U << 4U;
inline Register usart_status() { return at(0x40011000); }
inline Register usart_data() { return at(0x40011004); }
inline Register usart_baud() { return at(0x40011008); }
inline Register usart_control() { return at(0x4001100C); }
inline constexpr std::uint32_t kReceived = 1U << 5U, kMaySend = 1U << 7U;
// Device, request on a received byte, sender, receiver.
inline constexpr std::uint32_t kUsartOn = 1U << 13U | 1U << 5U | 1U << 3U | 1U << 2U;

// Interrupt 37, USART1: enabled, and no longer pending.
inline Register nvic_enable_1() { return at(0xE000E104); }
inline Register nvic_clear_pending_1() { return at(0xE000E284); }
inline constexpr std::uint32_t kUsart1Interrupt = 1U << (37U - 32U);

}  // namespace hm::board
