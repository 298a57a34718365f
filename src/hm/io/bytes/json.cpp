#include "hm/io/bytes/json.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "hm/io/bytes/file_bytes.hpp"

namespace hm {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMaxDepth = 200;

Json to_nlohmann(const JsonValue& value);

struct Converter {
  Json operator()(std::monostate) const { return nullptr; }
  Json operator()(bool value) const { return value; }
  Json operator()(std::int64_t value) const { return value; }
  Json operator()(double value) const { return std::isfinite(value) ? Json(value) : Json(nullptr); }
  Json operator()(const std::string& value) const { return value; }
  Json operator()(const JsonValue::Array& items) const {
    Json array = Json::array();
    for (const JsonValue& item : items) array.push_back(to_nlohmann(item));
    return array;
  }
  Json operator()(const JsonValue::Object& members) const {
    // JsonValue keeps keys unique; ordered_json::operator[] would search again.
    Json object = Json::object();
    auto& storage = object.get_ref<Json::object_t&>();
    for (const auto& [key, item] : members)
      storage.Json::object_t::Container::emplace_back(key, to_nlohmann(item));
    return object;
  }
};

Json to_nlohmann(const JsonValue& value) { return std::visit(Converter{}, value.data()); }

/// Builds a JsonValue from the events of nlohmann's parser, which itself does not recurse.
class Builder final : public nlohmann::json_sax<Json> {
 public:
  bool null() override { return add(JsonValue()); }
  bool boolean(bool value) override { return add(JsonValue(value)); }
  bool number_integer(number_integer_t value) override { return add(JsonValue(std::int64_t{value})); }
  bool number_unsigned(number_unsigned_t value) override {
    if (value > static_cast<number_unsigned_t>(std::numeric_limits<std::int64_t>::max()))
      return add(JsonValue(static_cast<double>(value)));
    return add(JsonValue(static_cast<std::int64_t>(value)));
  }
  bool number_float(number_float_t value, const string_t&) override { return add(JsonValue(value)); }
  bool string(string_t& value) override { return add(JsonValue(std::move(value))); }
  bool binary(binary_t&) override { return false; }
  bool start_object(std::size_t) override { return open(JsonValue::object()); }
  bool start_array(std::size_t) override { return open(JsonValue::array()); }
  bool key(string_t& name) override {
    levels_.back().key = std::move(name);
    return true;
  }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }
  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& exception) override {
    message_ = exception.what();
    position_ = position;
    return false;
  }

  [[nodiscard]] JsonValue& root() { return root_; }
  [[nodiscard]] std::size_t position() const { return position_; }
  /// Error message without the parser's own prefix.
  [[nodiscard]] std::string message() const {
    const std::size_t colon = message_.find(": ");
    return colon == std::string::npos ? message_ : message_.substr(colon + 2);
  }

 private:
  struct Level {
    JsonValue value;
    std::string key;  ///< of the member that is being read, when value is an object
  };

  bool add(JsonValue value) {
    if (levels_.empty())
      root_ = std::move(value);
    else if (levels_.back().value.as_array())
      levels_.back().value.push_back(std::move(value));
    else
      levels_.back().value[levels_.back().key] = std::move(value);
    return true;
  }
  bool open(JsonValue value) {
    if (levels_.size() >= kMaxDepth) {
      message_ = "more than " + std::to_string(kMaxDepth) + " levels";
      return false;
    }
    levels_.push_back({std::move(value), {}});
    return true;
  }
  bool close() {
    JsonValue value = std::move(levels_.back().value);
    levels_.pop_back();
    return add(std::move(value));
  }

  JsonValue root_;
  std::vector<Level> levels_;
  std::string message_;
  std::size_t position_ = 0;
};

std::string line_and_column(std::string_view text, std::size_t position) {
  const std::string_view before = text.substr(0, std::min(position > 0 ? position - 1 : 0, text.size()));
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t newline = before.rfind('\n');
  const std::size_t column = before.size() - (newline == std::string_view::npos ? 0 : newline + 1) + 1;
  return std::to_string(line) + ":" + std::to_string(column);
}

}  // namespace

std::string to_json_text(const JsonValue& value, JsonStyle style) {
  return to_nlohmann(value).dump(style == JsonStyle::kPretty ? 2 : -1, ' ', false,
                                 Json::error_handler_t::replace);
}

Result<JsonValue> parse_json(std::string_view text, const std::string& where) {
  Builder builder;
  if (!Json::sax_parse(text.begin(), text.end(), &builder))
    return fail(ErrorCode::kCorrupted, where + ":" + line_and_column(text, builder.position()),
                "not valid JSON: {}", builder.message());
  return std::move(builder.root());
}

Result<JsonValue> read_json_file(const std::filesystem::path& path, std::size_t max_bytes) {
  const auto bytes = read_file_bytes(path, max_bytes);
  if (!bytes) return forward_error(bytes);
  return parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, path.string());
}

}  // namespace hm
