#pragma once
#include <vector>

namespace hm {

/// "Nice" tick positions (1, 2, 5 times a power of ten) within [min, max], about `wanted` of them.
std::vector<double> nice_ticks(double min, double max, int wanted);

}  // namespace hm
