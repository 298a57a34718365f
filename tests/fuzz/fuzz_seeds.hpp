#pragma once
#include <cstdint>
#include <string_view>
#include <vector>

namespace hm::fuzz {

/// A good file of one reader, from which fuzzing begins.
struct Seed {
  std::string_view reader;
  std::vector<std::uint8_t> bytes;
};

/// Small files of every format, written by the product's own writers where there is one.
std::vector<Seed> seeds();

}  // namespace hm::fuzz
