#pragma once

namespace hm {

/// The smallest multiple of `of` that is no smaller than n >= 0.
constexpr int round_up(int n, int of) { return (n + of - 1) / of * of; }

}  // namespace hm
