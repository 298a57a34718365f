#pragma once
#include <string>
#include <string_view>

namespace hm::detail {

/// The definition of a message type that a bag carries with each connection, with all types inside of it.
std::string bag_message_definition(std::string_view type);

}  // namespace hm::detail
