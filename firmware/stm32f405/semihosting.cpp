#include "semihosting.hpp"

#include <array>

namespace hm::semihosting {
namespace {

enum class Call : std::uint32_t {
  kOpen = 0x01,
  kWriteCharacter = 0x03,
  kRead = 0x06,
  kCommandLine = 0x15,
  kExitExtended = 0x20,
};

std::uint32_t call(Call operation, const void* argument) {
  register std::uint32_t r0 asm("r0") = static_cast<std::uint32_t>(operation);
  register const void* r1 asm("r1") = argument;
  asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory", "cc", "r2", "r3", "ip", "lr");
  return r0;
}

std::uint32_t word(const void* pointer) {
  return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(pointer));
}

constexpr std::uint32_t kNone = 0xffffffffU;

}  // namespace

bool command_line(std::span<char> buffer) {
  const std::array<std::uint32_t, 2> block{word(buffer.data()), static_cast<std::uint32_t>(buffer.size())};
  return call(Call::kCommandLine, block.data()) == 0;
}

std::optional<std::uint32_t> open(std::string_view name) {
  constexpr std::uint32_t kReadBinary = 1;
  const std::array<std::uint32_t, 3> block{word(name.data()), kReadBinary,
                                           static_cast<std::uint32_t>(name.size())};
  const std::uint32_t file = call(Call::kOpen, block.data());
  if (file == kNone) return {};
  return file;
}

std::size_t read(std::uint32_t file, std::span<std::uint8_t> bytes) {
  const std::array<std::uint32_t, 3> block{file, word(bytes.data()),
                                           static_cast<std::uint32_t>(bytes.size())};
  const std::uint32_t missing = call(Call::kRead, block.data());
  return missing <= bytes.size() ? bytes.size() - missing : 0;
}

void print(std::string_view text) {
  for (const char letter : text) call(Call::kWriteCharacter, &letter);
}

void print(std::uint32_t number) {
  std::array<char, 10> digits{};
  std::size_t first = digits.size();
  do {
    digits[--first] = static_cast<char>('0' + number % 10);
    number /= 10;
  } while (number != 0);
  print(std::string_view(digits.data() + first, digits.size() - first));
}

void exit(int code) {
  constexpr std::uint32_t kApplicationExit = 0x20026;
  const std::array<std::uint32_t, 2> block{kApplicationExit, static_cast<std::uint32_t>(code)};
  call(Call::kExitExtended, block.data());
  for (;;) {
  }
}

}  // namespace hm::semihosting
