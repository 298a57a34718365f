#include "hm/station/station.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <variant>

#include "hm/io/bytes/json.hpp"
#include "hm/station/foxglove_session.hpp"
#include "hm/station/live_session.hpp"
#include "hm/station/page_files.hpp"
#include "hm/station/pilot_session.hpp"
#include "hm/station/station_api.hpp"
#include "hm/station/web/access_rules.hpp"
#include "hm/station/web/random_token.hpp"
#include "hm/station/web/web_server.hpp"

namespace hm {
namespace {

constexpr std::uint16_t kDefaultPort = 8710;
constexpr int kPortsTried = 20;
constexpr std::size_t kMaxViewers = 16, kMaxPilots = 16;

/// Foxglove in the browser: it may look, not fly.
constexpr std::array<std::string_view, 1> kFoxglovePages{"https://app.foxglove.dev"};

constexpr std::string_view kNoPage =
    "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>housemartin</title><p>This program was "
    "built without "
    "its page: <code>./hm serve</code> builds it where <code>node</code> and <code>npm</code> are installed. "
    "Everything "
    "else works: <code>/live</code>, <code>/foxglove</code> and <code>/api/status</code>.</html>\n";

bool is_loopback(const std::string& address) { return address == "::1" || address.starts_with("127."); }

std::string hello_json(const StationOptions& options, const LiveStore& store, const WebLimits& limits) {
  auto names = JsonValue::array();
  for (const auto& file : options.exports) names.push_back(file.name);
  const auto can = JsonValue::object({{"pilot", options.pilot != nullptr},
                                      {"replay", static_cast<bool>(options.replay)},
                                      {"exports", names}});
  return to_json_text(
      JsonValue::object(
          {{"protocol", 1},
           {"session", store.session()},
           {"program", "housemartin " + options.program_version},
           {"source", options.source},
           {"can", can},
           {"limits", JsonValue::object({{"in_bytes", static_cast<std::int64_t>(limits.message_bytes)},
                                         {"in_per_s", limits.messages_per_s}})}}),
      JsonStyle::kCompact);
}

/// Limits what a browser may do with an answer: only what this server serves, in no frame, and no address
/// (which has the token) is told to others.
void add_policy(WebResponse& response, const std::string& host) {
  response.headers.emplace_back("Content-Security-Policy",
                                fmt::format("default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; "
                                            "style-src 'self' 'unsafe-inline'; img-src 'self' "
                                            "blob: data:; connect-src 'self' ws://{}; worker-src 'self' "
                                            "blob:; font-src 'self'; manifest-src 'self'; "
                                            "base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
                                            host));
  response.headers.emplace_back("Referrer-Policy", "no-referrer");
  response.headers.emplace_back("X-Frame-Options", "DENY");
  response.headers.emplace_back("Cross-Origin-Resource-Policy", "same-origin");
  response.headers.emplace_back("Cross-Origin-Opener-Policy", "same-origin");
}

WebResponse file_response(const PageFile& file, const std::string& if_none_match) {
  WebResponse response;
  response.content_type = file.content_type;
  const std::string etag = fmt::format("\"{}\"", file.etag);
  response.headers = {{"ETag", etag}, {"Cache-Control", "no-cache"}};
  if (if_none_match == etag) {
    response.status = 304;
    return response;
  }
  response.headers.emplace_back("Content-Encoding", "gzip");
  response.body = std::as_bytes(file.gzip);
  return response;
}

/// A WebSocket that is opened only to say why it is refused: browsers show no page the reason of a refused
/// handshake.
class RefusedSession : public WebSocketSession {
 public:
  explicit RefusedSession(WebClose reason) : reason_(std::move(reason)) {}
  WebOutput receive(std::string_view, bool, Duration) override { return reason_; }
  WebOutput next(Duration) override { return reason_; }

 private:
  WebClose reason_;
};

/// Counts viewers while it lives.
template <class Session>
class CountedSession : public Session {
 public:
  template <class... Args>
  explicit CountedSession(std::atomic<std::size_t>& count, Args&&... args)
      : Session(std::forward<Args>(args)...), count_(count) {
    ++count_;
  }
  ~CountedSession() override { --count_; }
  CountedSession(const CountedSession&) = delete;
  CountedSession& operator=(const CountedSession&) = delete;

 private:
  std::atomic<std::size_t>& count_;
};

}  // namespace

struct Station::Impl : WebHandler {
  using Opened = std::variant<WebSocketOpening, WebResponse>;

  Impl(StationOptions given, std::string the_token)
      : options(std::move(given)),
        token(std::move(the_token)),
        access(own_names(), token),
        hello(hello_json(options, store, limits)),
        exports(options.exports) {
    if (options.pilot) desk.emplace(*options.pilot);
  }

  static std::vector<std::string> own_names() {
    const std::string name = machine_name();
    return {name, name + ".local"};
  }

  void respond(const WebRequest& request, Answer answer) override {
    if (const auto refusal = access.refuse_host(request.host))
      return answer(forbidden(Refused::kHost, *refusal));
    const auto answer_with_policy = [host = request.host, answer = std::move(answer)](WebResponse response) {
      add_policy(response, host);
      answer(std::move(response));
    };
    if (request.path.starts_with("/api/")) return api(request, answer_with_policy);
    const std::string path = request.path == "/" ? "/index.html" : request.path;
    const auto files = page_files();
    const auto file =
        std::find_if(files.begin(), files.end(), [&](const PageFile& one) { return one.path == path; });
    if (file != files.end()) return answer_with_policy(file_response(*file, request.if_none_match));
    if (request.path == "/")
      return answer_with_policy(WebResponse::of_text(200, std::string(kNoPage), "text/html; charset=utf-8"));
    answer_with_policy(WebResponse::of_text(404, "there is no such page\n"));
  }

  void api(const WebRequest& request, Answer answer) {
    if (const auto refusal = access.refuse_origin(request))
      return answer(forbidden(Refused::kOrigin, *refusal));
    if (const auto refusal = access.refuse_token(request.query))
      return answer(forbidden(Refused::kToken, *refusal));
    const auto answer_fresh = [answer = std::move(answer)](WebResponse response) {
      response.headers.emplace_back("Cache-Control", "no-store");
      answer(std::move(response));
    };
    const std::string name = request.path.substr(5);
    if (name == "status") return answer_fresh(status_response(store, hello, {viewers, all_refusals()}));
    if (name == "statistics") return answer_fresh(statistics_response(store));
    if (!exports.make(name, answer_fresh)) refused(Refused::kFull);
  }

  WebResponse forbidden(Refused why, const std::string& reason) {
    refused(why);
    return WebResponse::of_text(403, reason + "\n");
  }

  void refused(Refused why) override { refusals.add(why); }

  [[nodiscard]] RefusalCounts all_refusals() const {
    RefusalCounts all = refusals;
    if (desk) all.add(Refused::kCommand, desk->refused());
    return all;
  }

  Opened open(const WebRequest& request) override {
    const bool foxglove = request.path == "/foxglove";
    if (!foxglove && request.path != "/live" && request.path != "/pilot")
      return WebResponse::of_text(404, "there is no such WebSocket\n");
    if (const auto refusal = access.refuse_host(request.host)) return forbidden(Refused::kHost, *refusal);
    const auto friends = foxglove ? kFoxglovePages : std::span<const std::string_view>();
    if (const auto refusal = access.refuse_origin(request, friends))
      return forbidden(Refused::kOrigin, *refusal);
    if (auto refusal = access.refuse_token(request.query))
      return refuse({WebClose::kPolicy, std::move(*refusal), Refused::kToken});
    if (request.path == "/pilot") return open_pilot();
    if (viewers >= kMaxViewers)
      return refuse({WebClose::kTryLater, fmt::format("{} viewers are connected already", kMaxViewers),
                     Refused::kFull});
    if (foxglove) return open_foxglove(request);
    const LiveSessionContext context{store, hello, options.replay};
    return WebSocketOpening{std::make_unique<CountedSession<LiveSession>>(viewers, context, now), ""};
  }

  Opened open_foxglove(const WebRequest& request) {
    const auto protocol = foxglove_protocol(request.protocols);
    if (!protocol) {
      refused(Refused::kRequest);
      return WebResponse::of_text(400,
                                  "the subprotocol has to be foxglove.sdk.v1 or foxglove.websocket.v1\n");
    }
    return WebSocketOpening{std::make_unique<CountedSession<FoxgloveSession>>(viewers, store), *protocol};
  }

  Opened open_pilot() {
    if (!desk) return refuse({WebClose::kPolicy, "there is nothing to fly here"});
    if (pilots >= kMaxPilots)
      return refuse(
          {WebClose::kTryLater, fmt::format("{} pilots are connected already", kMaxPilots), Refused::kFull});
    return WebSocketOpening{std::make_unique<CountedSession<PilotSession>>(pilots, *desk, now), ""};
  }

  /// Counted when it is closed.
  static Opened refuse(WebClose reason) {
    return WebSocketOpening{std::make_unique<RefusedSession>(std::move(reason)), ""};
  }

  void tick(Duration time) override {
    now = time;
    if (desk) desk->tick(time);
  }

  StationOptions options;
  std::string token;
  WebLimits limits;
  LiveStore store;
  AccessRules access;
  std::string hello;
  RefusalCounts refusals;  ///< of the server's thread
  std::atomic<std::size_t> viewers = 0, pilots = 0;
  std::optional<PilotDesk> desk;
  Duration now;  ///< of the last tick
  std::unique_ptr<WebServer> server;
  ExportMaker exports;  ///< ends before the server, to which it answers
};

Station::Station(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Station::~Station() = default;

Result<std::unique_ptr<Station>> Station::start(StationOptions options) {
  if (options.address == "localhost") options.address = "127.0.0.1";
  WebAddress address{options.address, options.port, 1};
  if (!options.port_given && options.port == 0) address = {options.address, kDefaultPort, kPortsTried};
  const std::string token = is_loopback(options.address) ? "" : random_token();
  auto impl = std::make_unique<Impl>(std::move(options), token);
  auto server = WebServer::start(address, impl->limits, *impl);
  if (!server) return forward_error(server);
  impl->server = std::move(*server);
  return std::unique_ptr<Station>(new Station(std::move(impl)));
}

LiveStore& Station::store() { return impl_->store; }

bool Station::is_public() const { return !impl_->token.empty(); }

std::string Station::url() const {
  std::string host = impl_->options.address;
  if (host == "0.0.0.0" || host == "::") host = reachable_address().value_or(machine_name());
  if (host.find(':') != std::string::npos) host = "[" + host + "]";
  const std::string token = impl_->token.empty() ? "" : "?token=" + impl_->token;
  return fmt::format("http://{}:{}/{}", host, impl_->server->port(), token);
}

void Station::answer(std::uint64_t sequence, bool accepted, const std::string& reason) {
  if (!impl_->desk) return;
  impl_->server->post(
      [impl = impl_.get(), sequence, accepted, reason] { impl->desk->answer(sequence, accepted, reason); });
}

std::size_t Station::viewers() const { return impl_->viewers; }

}  // namespace hm
