#pragma once
#include "hm/core/json_value.hpp"
#include "hm/geometry/box.hpp"

namespace hm {

/// A box as {"min": [x, y, z], "max": [x, y, z]}; null when it is empty.
JsonValue to_json(const Box3& box);

}  // namespace hm
