#include "hm/link/status_text.hpp"

#include <algorithm>

namespace hm {
namespace {

constexpr unsigned kMostParts = 255;

std::string text_of_part(const MavStatusText& message) {
  std::string text(message.text.begin(), std::ranges::find(message.text, '\0'));
  std::ranges::replace_if(
      text, [](char letter) { return letter < ' ' || letter > '~'; }, '?');
  return text;
}

}  // namespace

void StatusTextReader::finish(std::vector<LinkText>& texts, bool is_whole) {
  if (!begun_) return;
  if (!is_whole) begun_->text.text += "...";
  texts.push_back(std::move(begun_->text));
  begun_.reset();
}

std::vector<LinkText> StatusTextReader::add(const MavStatusText& message, MavlinkAddress from) {
  std::vector<LinkText> texts;
  const std::string part = text_of_part(message);
  if (message.id == 0) {
    finish(texts, false);
    texts.push_back({message.severity, part});
    return texts;
  }
  if (begun_ && (begun_->from != from || begun_->id != message.id)) finish(texts, false);
  if (!begun_) begun_ = Begun{from, message.id, 0, {message.severity, {}}};
  if (message.chunk_seq < begun_->parts) return texts;  // came twice
  if (message.chunk_seq > begun_->parts) begun_->text.text += "...";
  begun_->text.text += part;
  begun_->parts = message.chunk_seq + 1U;
  // Only the last part ends before its 50 letters do.
  if (part.size() < message.text.size() || begun_->parts >= kMostParts) finish(texts, true);
  return texts;
}

}  // namespace hm
