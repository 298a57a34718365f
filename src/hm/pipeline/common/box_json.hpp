#pragma once
#include <string_view>

#include "hm/core/json_value.hpp"
#include "hm/geometry/box.hpp"
#include "hm/report/summary_tree.hpp"

namespace hm {

/// A box as {"min": [x, y, z], "max": [x, y, z]}; null when it is empty.
JsonValue to_json(const Box3& box);

/// Adds a box to a summary: its corners to the JSON, its size (of a box that is not empty) to sentences.
void add_box(SummaryTree& v, std::string_view key, const Box3& box);

}  // namespace hm
