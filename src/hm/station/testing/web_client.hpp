#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hm {

/// A client on plain sockets that does exactly what a test tells it, right or wrong. Every wait ends after
/// `patience_s`.
class WebClient {
 public:
  explicit WebClient(std::uint16_t port, double patience_s = 5, int receive_buffer_bytes = 0);
  ~WebClient();
  WebClient(const WebClient&) = delete;
  WebClient& operator=(const WebClient&) = delete;

  struct Response {
    int status = 0;
    std::string header, body;
  };
  struct Message {
    int opcode = 0;  ///< 1 text, 2 binary, 8 close
    std::string data;
    /// Code of a close frame.
    [[nodiscard]] int code() const;
    [[nodiscard]] std::string reason() const { return data.size() > 2 ? data.substr(2) : ""; }
    [[nodiscard]] std::span<const std::byte> bytes() const { return std::as_bytes(std::span(data)); }
  };

  void send_raw(std::string_view bytes);
  /// Reads an answer with its body; status 0 if the connection ends first.
  Response read_response(bool with_body = true);
  Response get(const std::string& target, const std::string& more_headers = "",
               const std::string& method = "GET");
  /// The handshake of a WebSocket; the headers of Host and Origin as given.
  Response upgrade(const std::string& target, const std::string& more_headers = "",
                   const std::string& host = "");

  /// Masked, as clients have to.
  void send_frame(int opcode, std::string_view data, bool masked = true, bool last = true);
  void send_text(std::string_view text) { send_frame(1, text); }
  /// Next message but pings, which are answered; nothing when the connection ended or nothing came in time.
  std::optional<Message> read_message();
  /// Whether there is something to read, waiting so long for it.
  bool has_data(double wait_s);
  /// The next bytes as they are; nothing when fewer come.
  std::optional<std::string> take(std::size_t count);
  /// True when the other end has closed the connection.
  bool wait_for_end();
  [[nodiscard]] std::uint16_t port() const { return port_; }

 private:
  bool fill();
  std::uint16_t port_;
  double patience_s_;
  int socket_;
  std::string buffer_;
};

}  // namespace hm
