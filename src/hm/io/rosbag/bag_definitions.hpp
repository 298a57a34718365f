#pragma once
#include <string>
#include <string_view>

namespace hm::detail {

/// Definition text of a message type, including all nested types, as stored with each connection of a bag.
std::string bag_message_definition(std::string_view type);

}  // namespace hm::detail
