#pragma once
#include <cstddef>
#include <vector>

namespace hm {

/// At most so many of the items, in their order, spread evenly from the first one on.
template <class Item>
std::vector<Item> thinned(std::vector<Item> items, std::size_t most) {
  if (items.size() <= most) return items;
  for (std::size_t i = 0; i < most; ++i) items[i] = items[i * items.size() / most];
  items.erase(items.begin() + static_cast<std::ptrdiff_t>(most), items.end());
  return items;
}

}  // namespace hm
