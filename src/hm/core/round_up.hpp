#pragma once

namespace hm {

/// The smallest multiple of `of` that is no smaller than n >= 0.
template <class Integer>
constexpr Integer round_up(Integer n, Integer of) {
  return (n + of - 1) / of * of;
}

}  // namespace hm
