#include "hm/station/web/web_types.hpp"

namespace hm {

WebResponse WebResponse::of_bytes(std::vector<std::byte> bytes, std::string content_type) {
  WebResponse response;
  response.content_type = std::move(content_type);
  const auto owner = std::make_shared<const std::vector<std::byte>>(std::move(bytes));
  response.body = *owner;
  response.owner = owner;
  return response;
}

WebResponse WebResponse::of_text(unsigned status, std::string text, std::string content_type) {
  WebResponse response;
  response.status = status;
  response.content_type = std::move(content_type);
  const auto owner = std::make_shared<const std::string>(std::move(text));
  response.body = std::as_bytes(std::span(*owner));
  response.owner = owner;
  return response;
}

WebMessage WebMessage::of_text(std::string_view text) {
  WebMessage message;
  message.text = true;
  const auto bytes = std::as_bytes(std::span(text));
  message.head.assign(bytes.begin(), bytes.end());
  return message;
}

}  // namespace hm
