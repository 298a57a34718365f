#include "hm/station/station_api.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "hm/core/process_memory.hpp"
#include "hm/io/bytes/json.hpp"
#include "hm/station/live_frames.hpp"

namespace hm {
namespace {

constexpr const char* kJson = "application/json";

/// The newest frame of a kind of which there is one, as JSON.
std::string newest_json(const LiveStore& store, LiveKind kind, std::string without) {
  const auto item = store.read({kind, 0, {}});
  return item ? std::string(bytes_text(*item->payload)) : std::move(without);
}

WebResponse make_response(const StationExport& file) {
  auto bytes = file.make();
  if (!bytes) {
    const bool missing =
        bytes.error().code == ErrorCode::kNoResult || bytes.error().code == ErrorCode::kNotFound;
    return WebResponse::of_text(missing ? 404 : 500,
                                fmt::format("{}: {}\n", file.name, to_string(bytes.error())));
  }
  WebResponse response = WebResponse::of_bytes(std::move(*bytes), file.content_type);
  if (file.name.find('.') != std::string::npos)
    response.headers.emplace_back("Content-Disposition",
                                  fmt::format("attachment; filename=\"{}\"", file.name));
  return response;
}

}  // namespace

ExportMaker::ExportMaker(std::vector<StationExport> exports) : exports_(std::move(exports)) {
  if (!exports_.empty()) thread_ = std::thread([this] { run(); });
}

ExportMaker::~ExportMaker() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

std::vector<std::string> ExportMaker::names() const {
  std::vector<std::string> names;
  for (const auto& file : exports_) names.push_back(file.name);
  return names;
}

bool ExportMaker::make(const std::string& name, WebHandler::Answer answer) {
  const auto file =
      std::find_if(exports_.begin(), exports_.end(), [&](const auto& one) { return one.name == name; });
  if (file == exports_.end()) {
    answer(
        WebResponse::of_text(404, fmt::format("/api/{}: there is no such file here\n", name.substr(0, 60))));
    return true;
  }
  {
    const std::lock_guard lock(mutex_);
    if (requests_.size() < kMaxWaiting) {
      requests_.push_back({&*file, std::move(answer)});
      answer = nullptr;
    }
  }
  if (answer) {
    answer(WebResponse::of_text(503, "too many files are being made: try again later\n"));
    return false;
  }
  changed_.notify_one();
  return true;
}

void ExportMaker::run() {
  while (true) {
    Request request;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return end_ || !requests_.empty(); });
      if (end_) return;
      request = std::move(requests_.front());
      requests_.pop_front();
    }
    request.answer(make_response(*request.file));
  }
}

WebResponse status_response(const LiveStore& store, const std::string& hello, const StationClients& clients) {
  JsonValue refused = JsonValue::object();
  for (std::size_t i = 0; i < RefusalCounts::kNames.size(); ++i)
    refused[RefusalCounts::kNames[i]] =
        static_cast<std::int64_t>(clients.refused.of(static_cast<Refused>(i)));
  const JsonValue memory = JsonValue::object(
      {{"process", static_cast<double>(resident_bytes())}, {"heap", static_cast<double>(heap_bytes())}});
  return WebResponse::of_text(
      200,
      fmt::format("{{\"hello\":{},\"telemetry\":{},\"viewers\":{},\"refused\":{},\"memory\":{}}}\n", hello,
                  newest_json(store, LiveKind::kTelemetry, "null"), clients.viewers,
                  to_json_text(refused, JsonStyle::kCompact), to_json_text(memory, JsonStyle::kCompact)),
      kJson);
}

WebResponse statistics_response(const LiveStore& store) {
  JsonValue all = JsonValue::object();
  for (const LiveItem& item : store.items(LiveKind::kStatistics)) {
    const auto part = parse_json(bytes_text(*item.payload), "statistics");
    if (!part || !part->as_object()) continue;
    for (const auto& [name, value] : *part->as_object()) all[name] = value;
  }
  return WebResponse::of_text(200, to_json_text(all, JsonStyle::kCompact) + "\n", kJson);
}

}  // namespace hm
