// What the compiler and libm call of the C library: several words at a time where both ends are aligned
// (newlib's small versions take bytes; a step clears and copies about a kilobyte), and an errno without the
// rest of the library's state.
#include <cstddef>
#include <cstdint>

/// The compiler must not replace the loops of these functions by calls of them.
#define NOT_BY_ITSELF [[gnu::optimize("no-tree-loop-distribute-patterns")]]

namespace {

/// May alias any object, as memcpy must.
using Word [[gnu::may_alias]] = std::uint32_t;

bool aligned(const void* a, const void* b) {
  return ((reinterpret_cast<std::uintptr_t>(a) | reinterpret_cast<std::uintptr_t>(b)) & 3U) == 0;
}

int last_error = 0;

}  // namespace

extern "C" {

void* memcpy(void* to, const void* from, std::size_t size);
void* memset(void* to, int value, std::size_t size);
int* __errno();

NOT_BY_ITSELF void* memcpy(void* to, const void* from, std::size_t size) {
  auto* out = static_cast<std::uint8_t*>(to);
  const auto* in = static_cast<const std::uint8_t*>(from);
  if (aligned(to, from)) {
    auto* out_word = static_cast<Word*>(to);
    const auto* in_word = static_cast<const Word*>(from);
    for (; size >= 16; size -= 16, out_word += 4, in_word += 4) {
      const Word a = in_word[0], b = in_word[1], c = in_word[2], d = in_word[3];
      out_word[0] = a, out_word[1] = b, out_word[2] = c, out_word[3] = d;
    }
    for (; size >= 4; size -= 4) *out_word++ = *in_word++;
    out = reinterpret_cast<std::uint8_t*>(out_word);
    in = reinterpret_cast<const std::uint8_t*>(in_word);
  }
  for (; size > 0; --size) *out++ = *in++;
  return to;
}

NOT_BY_ITSELF void* memset(void* to, int value, std::size_t size) {
  auto* out = static_cast<std::uint8_t*>(to);
  const auto byte = static_cast<std::uint8_t>(value);
  for (; size > 0 && !aligned(out, out); --size) *out++ = byte;
  auto* out_word = reinterpret_cast<Word*>(out);
  const Word word = byte * 0x01010101U;
  for (; size >= 32; size -= 32, out_word += 8) {
    out_word[0] = word, out_word[1] = word, out_word[2] = word, out_word[3] = word;
    out_word[4] = word, out_word[5] = word, out_word[6] = word, out_word[7] = word;
  }
  for (; size >= 4; size -= 4) *out_word++ = word;
  out = reinterpret_cast<std::uint8_t*>(out_word);
  for (; size > 0; --size) *out++ = byte;
  return to;
}

int* __errno() { return &last_error; }
}
