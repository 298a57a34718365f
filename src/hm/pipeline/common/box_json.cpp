#include "hm/pipeline/common/box_json.hpp"

#include "hm/geometry/se3.hpp"

namespace hm {

JsonValue to_json(const Box3& box) {
  if (box.isEmpty()) return {};
  const auto corner = [](const Vec3& p) {
    auto list = JsonValue::array();
    for (int axis = 0; axis < 3; ++axis) list.push_back(p[axis]);
    return list;
  };
  return JsonValue::object({{"min", corner(box.min())}, {"max", corner(box.max())}});
}

}  // namespace hm
