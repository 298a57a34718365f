#pragma once
#include <string>
#include <string_view>
#include <utility>

#include "hm/station/pilot_desk.hpp"
#include "hm/station/web/web_types.hpp"

namespace hm {

/// One pilot's WebSocket on `/pilot`. The desk must outlive it.
class PilotSession : public WebSocketSession {
 public:
  PilotSession(PilotDesk& desk, Duration now) : desk_(desk), id_(desk.open(now)) {}
  ~PilotSession() override { desk_.close(id_); }
  PilotSession(const PilotSession&) = delete;
  PilotSession& operator=(const PilotSession&) = delete;

  WebOutput receive(std::string_view message, bool is_text, Duration now) override {
    if (!is_text) return WebClose{WebClose::kData, "binary messages are not taken here"};
    if (auto reason = desk_.receive(id_, message, now))
      return WebClose{WebClose::kProtocol, std::move(*reason)};
    return {};
  }
  WebOutput next(Duration now) override {
    if (auto reason = desk_.reason_to_end(id_, now))
      return WebClose{WebClose::kPolicy, std::move(*reason), Refused::kSilent};
    auto text = desk_.next(id_, now);
    if (!text) return {};
    return WebMessage::of_text(*text);
  }

 private:
  PilotDesk& desk_;
  PilotId id_;
};

}  // namespace hm
