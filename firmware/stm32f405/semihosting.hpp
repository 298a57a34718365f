#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

/// Files, text and the end of a program through a debugger or an emulator (ARM's "Semihosting for AArch32 and
/// AArch64"). Without one the processor faults.
namespace hm::semihosting {

/// Words of the command line. False if there is none, or it is longer than the buffer.
bool command_line(std::span<char> buffer);
/// Opens a file for reading; the name ends with a zero.
std::optional<std::uint32_t> open(std::string_view name);
/// Reads; how many bytes came, fewer at the end of the file only.
std::size_t read(std::uint32_t file, std::span<std::uint8_t> bytes);
void print(std::string_view text);
void print(std::uint32_t number);
[[noreturn]] void exit(int code);

}  // namespace hm::semihosting
