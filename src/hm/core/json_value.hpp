#pragma once
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace hm {

/// JSON document as a value; objects keep the order in which keys were set. Written and parsed by
/// hm/io/bytes/json.hpp, where NaN and infinities become null.
class JsonValue {
 public:
  using Array = std::vector<JsonValue>;
  using Object = std::vector<std::pair<std::string, JsonValue>>;

  JsonValue() = default;
  JsonValue(std::nullptr_t) {}
  JsonValue(bool value) : data_(value) {}
  JsonValue(int value) : data_(static_cast<std::int64_t>(value)) {}
  JsonValue(std::int64_t value) : data_(value) {}
  JsonValue(std::uint64_t value) : data_(static_cast<std::int64_t>(value)) {}
  JsonValue(double value) : data_(value) {}
  JsonValue(const char* value) : data_(std::string(value)) {}
  JsonValue(std::string_view value) : data_(std::string(value)) {}
  JsonValue(std::string value) : data_(std::move(value)) {}
  JsonValue(Array value) : data_(std::move(value)) {}
  static JsonValue array() { return JsonValue(Array{}); }
  /// Array of the values of a range (numbers, strings).
  template <class Range>
  static JsonValue array_of(const Range& values) {
    auto list = array();
    for (const auto& value : values) list.push_back(value);
    return list;
  }
  static JsonValue object(std::initializer_list<std::pair<std::string, JsonValue>> members = {});

  /// Member with this key, inserted as null if missing; a null value becomes an object first.
  JsonValue& operator[](std::string_view key);
  /// The member with this key, or nullptr (also when this is not an object).
  [[nodiscard]] const JsonValue* find(std::string_view key) const;
  /// The member with this key if it is a T (bool, std::int64_t, std::string, Array, Object), or nullptr.
  template <class T>
  [[nodiscard]] const T* find_as(std::string_view key) const {
    const JsonValue* member = find(key);
    return member ? std::get_if<T>(&member->data_) : nullptr;
  }
  /// The member with this key; the fallback, or nothing, when it is missing or of another type.
  [[nodiscard]] std::string text_at(std::string_view key) const;
  [[nodiscard]] std::int64_t integer_at(std::string_view key, std::int64_t fallback) const;
  [[nodiscard]] double number_at(std::string_view key, double fallback) const;
  [[nodiscard]] const Array& list_at(std::string_view key) const;
  /// Appends to an array; a null value becomes an array first.
  void push_back(JsonValue value);

  [[nodiscard]] bool is_null() const { return std::holds_alternative<std::monostate>(data_); }
  [[nodiscard]] const bool* as_bool() const { return std::get_if<bool>(&data_); }
  [[nodiscard]] const std::int64_t* as_integer() const { return std::get_if<std::int64_t>(&data_); }
  [[nodiscard]] const std::string* as_string() const { return std::get_if<std::string>(&data_); }
  [[nodiscard]] const Array* as_array() const { return std::get_if<Array>(&data_); }
  [[nodiscard]] const Object* as_object() const { return std::get_if<Object>(&data_); }
  /// The number as double; `fallback` when this value is not a number.
  [[nodiscard]] double number_or(double fallback) const;

  using Data = std::variant<std::monostate, bool, std::int64_t, double, std::string, Array, Object>;
  [[nodiscard]] const Data& data() const { return data_; }

 private:
  Data data_;
};

}  // namespace hm
