#include "hm/station/web/random_token.hpp"

#include <fmt/format.h>
#include <sys/random.h>

#include <array>

#include "hm/core/check.hpp"

namespace hm {

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  HM_CHECK(::getrandom(bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size()),
           "no random numbers");
  std::string token;
  for (const auto byte : bytes) token += fmt::format("{:02x}", byte);
  return token;
}

}  // namespace hm
