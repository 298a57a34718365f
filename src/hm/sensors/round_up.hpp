#pragma once

namespace hm {

/// Smallest multiple of `of` > 0 that is not less than n >= 0.
template <class Integer>
constexpr Integer round_up(Integer n, Integer of) {
  return (n + of - 1) / of * of;
}

}  // namespace hm
