#include "hm/core/json_value.hpp"

#include "hm/core/check.hpp"

namespace hm {

JsonValue JsonValue::object(std::initializer_list<std::pair<std::string, JsonValue>> members) {
  JsonValue value;
  value.data_ = Object(members.begin(), members.end());
  return value;
}

JsonValue& JsonValue::operator[](std::string_view key) {
  if (is_null()) data_ = Object{};
  auto* members = std::get_if<Object>(&data_);
  HM_CHECK(members, "key '{}' asked of a JSON value that is not an object", key);
  for (auto& [name, value] : *members)
    if (name == key) return value;
  return members->emplace_back(std::string(key), JsonValue{}).second;
}

const JsonValue* JsonValue::find(std::string_view key) const {
  if (const auto* members = as_object())
    for (const auto& [name, value] : *members)
      if (name == key) return &value;
  return nullptr;
}

void JsonValue::push_back(JsonValue value) {
  if (is_null()) data_ = Array{};
  auto* items = std::get_if<Array>(&data_);
  HM_CHECK(items, "push_back on a JSON value that is not an array");
  items->push_back(std::move(value));
}

std::string JsonValue::text_at(std::string_view key) const {
  const auto* text = find_as<std::string>(key);
  return text ? *text : std::string();
}

std::int64_t JsonValue::integer_at(std::string_view key, std::int64_t fallback) const {
  const auto* integer = find_as<std::int64_t>(key);
  return integer ? *integer : fallback;
}

double JsonValue::number_at(std::string_view key, double fallback) const {
  const JsonValue* member = find(key);
  return member ? member->number_or(fallback) : fallback;
}

const JsonValue::Array& JsonValue::list_at(std::string_view key) const {
  static const Array kNone;
  const auto* list = find_as<Array>(key);
  return list ? *list : kNone;
}

double JsonValue::number_or(double fallback) const {
  if (const auto* integer = std::get_if<std::int64_t>(&data_)) return static_cast<double>(*integer);
  if (const auto* real = std::get_if<double>(&data_)) return *real;
  return fallback;
}

}  // namespace hm
