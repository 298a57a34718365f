#include "hm/pipeline/common/box_json.hpp"

#include <fmt/format.h>

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

void add_box(SummaryTree& v, std::string_view key, const Box3& box) {
  v.json(key, to_json(box));
  if (box.isEmpty()) return;
  const Vec3 size = box.sizes();
  v.shown(key, "size", fmt::format("{:.2f} x {:.2f} x {:.2f} m", size.x(), size.y(), size.z()));
}

}  // namespace hm
