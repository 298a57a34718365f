#include "hm/core/params.hpp"

#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>

#include "hm/core/text/nearest_name.hpp"

namespace hm {
namespace {

using Value = std::variant<double, std::int64_t, bool, std::string>;

std::string unknown_key(std::span<const ParamRef> params, std::string_view name) {
  std::vector<std::string_view> names;
  for (const ParamRef& param : params) names.push_back(param.name);
  auto nearest = nearest_name(name, names);
  // The right word in the wrong section, or without its section.
  if (!nearest && name.find('.') != std::string_view::npos)
    nearest = nearest_name(name.substr(name.find('.') + 1), names);
  return nearest ? fmt::format("unknown parameter '{}'; did you mean '{}'?", name, *nearest)
                 : fmt::format("unknown parameter '{}'; `hm params show --expert` lists all", name);
}

std::string joined(std::span<const std::string_view> names) {
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string range_text(const Range& range) {
  const bool low = std::isfinite(range.min), high = std::isfinite(range.max);
  if (low && high) return fmt::format("{} to {}", range.min, range.max);
  if (low) return fmt::format("at least {}", range.min);
  if (high) return fmt::format("at most {}", range.max);
  return {};
}

/// Description of the violation of a number for this parameter, or nothing. In single precision the ends of
/// the range are rounded as the number is: 0.7 is allowed where 0.7 is the least.
std::string range_violation(const ParamRef& param, double number) {
  if (std::holds_alternative<float*>(param.value)) {
    const auto single = [](double value) { return static_cast<double>(static_cast<float>(value)); };
    if (std::isfinite(single(number)) && single(number) >= single(param.range.min) &&
        single(number) <= single(param.range.max))
      return {};
  } else if (std::isfinite(number) && number >= param.range.min && number <= param.range.max) {
    return {};
  }
  const std::string range = range_text(param.range);
  return fmt::format("{} = {} is not {}", param.name, number, range.empty() ? "a finite number" : range);
}

/// Stores `value` in the parameter; returns the violation, if any. Without `store` only checks.
std::string assign(const ParamRef& param, const Value& value, bool store) {
  const auto number = [&]() -> std::optional<double> {
    if (const auto* real = std::get_if<double>(&value)) return *real;
    if (const auto* integer = std::get_if<std::int64_t>(&value)) return static_cast<double>(*integer);
    return std::nullopt;
  }();
  if (const auto* place = std::get_if<double*>(&param.value)) {
    if (!number) return fmt::format("{} must be a number", param.name);
    if (auto wrong = range_violation(param, *number); !wrong.empty()) return wrong;
    if (store) **place = *number;
  } else if (const auto* single_place = std::get_if<float*>(&param.value)) {
    if (!number) return fmt::format("{} wants a number", param.name);
    if (auto wrong = range_violation(param, *number); !wrong.empty()) return wrong;
    if (store) **single_place = static_cast<float>(*number);
  } else if (const auto* int_place = std::get_if<int*>(&param.value)) {
    if (!std::holds_alternative<std::int64_t>(value))
      return fmt::format("{} must be a whole number", param.name);
    if (auto wrong = range_violation(param, *number); !wrong.empty()) return wrong;
    if (std::abs(*number) > std::numeric_limits<int>::max())
      return fmt::format("{} is too large", param.name);
    if (store) **int_place = static_cast<int>(*number);
  } else if (const auto* bool_place = std::get_if<bool*>(&param.value)) {
    const auto* flag = std::get_if<bool>(&value);
    if (!flag) return fmt::format("{} must be true or false", param.name);
    if (store) **bool_place = *flag;
  } else if (const auto* string_place = std::get_if<std::string*>(&param.value)) {
    const auto* text = std::get_if<std::string>(&value);
    if (!text) return fmt::format("{} must be a text in quotes", param.name);
    if (store) **string_place = *text;
  } else {
    const auto& choice = std::get<ChoiceRef>(param.value);
    const auto* text = std::get_if<std::string>(&value);
    const auto found = text ? std::find(choice.names.begin(), choice.names.end(), *text) : choice.names.end();
    if (found == choice.names.end())
      return fmt::format("{} must be one of: {}", param.name, joined(choice.names));
    if (store) choice.set(static_cast<int>(found - choice.names.begin()));
  }
  return {};
}

/// A value as typed on the command line: TOML, except that texts need no quotes.
Value parse_value(const ParamRef& param, std::string_view text) {
  if (std::holds_alternative<std::string*>(param.value) || std::holds_alternative<ChoiceRef>(param.value))
    return std::string(text);
  if (text == "true" || text == "false") return text == "true";
  std::int64_t integer = 0;
  const char* end = text.data() + text.size();
  if (const auto [rest, error] = std::from_chars(text.data(), end, integer);
      error == std::errc{} && rest == end)
    return integer;
  double real = 0;
  if (const auto [rest, error] = std::from_chars(text.data(), end, real); error == std::errc{} && rest == end)
    return real;
  return std::string(text);
}

std::optional<Value> toml_value(const toml::node& node) {
  if (const auto* boolean = node.as_boolean()) return Value{boolean->get()};
  if (const auto* integer = node.as_integer()) return Value{integer->get()};
  if (const auto* real = node.as_floating_point()) return Value{real->get()};
  if (const auto* text = node.as_string()) return Value{text->get()};
  return std::nullopt;
}

/// Measures the nesting depth of a TOML text. Exact up to the first syntax error, where the parser stops too.
class TomlNesting {
 public:
  explicit TomlNesting(std::string_view text) : text_(text) {}
  /// Line where the nesting is too deep, and a description; nothing if it is within the limit.
  std::optional<std::pair<std::size_t, std::string>> too_deep() {
    while (at_ < text_.size()) {
      step();
      if (dots_ > kMaxDots) return std::pair{line_, fmt::format("a key has more than {} dots", kMaxDots)};
      if (brackets_ > kMaxBrackets)
        return std::pair{line_, fmt::format("more than {} brackets in each other", kMaxBrackets)};
    }
    return std::nullopt;
  }

 private:
  static constexpr int kMaxDots = 8, kMaxBrackets = 32;

  void step() {
    const char c = text_[at_];
    if (c == '"' || c == '\'') return skip_string(c);
    ++at_;
    if (c == '#') at_ = std::min(text_.find('\n', at_), text_.size());
    if (c == '\n') ++line_;
    if (c == '.') ++dots_;
    if (c == '[' || c == '{') ++brackets_;
    if (c == ']' || c == '}') --brackets_;
    if (std::string_view("=,[]{}\n").find(c) != std::string_view::npos) dots_ = 0;
  }

  void skip_string(char quote) {
    const std::string three(3, quote);
    const bool long_string = text_.substr(at_).starts_with(three);
    at_ += long_string ? 3 : 1;
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '\n') ++line_;
      if (c == '\\' && quote == '"') {
        at_ += 2;
      } else if (long_string ? text_.substr(at_).starts_with(three) : c == quote || c == '\n') {
        at_ += long_string ? 3 : 1;
        for (int more = 0; long_string && more < 2 && at_ < text_.size() && text_[at_] == quote; ++more)
          ++at_;
        return;
      } else {
        ++at_;
      }
    }
  }

  std::string_view text_;
  std::size_t at_ = 0, line_ = 1;
  int dots_ = 0, brackets_ = 0;
};

}  // namespace

void ParamList::add_missing(const ParamList& other) {
  std::set<std::string> present;
  for (const ParamRef& param : params_) present.insert(param.name);
  for (const ParamRef& param : other.params_)
    if (!present.contains(param.name)) params_.push_back(param);
  renamed_.insert(renamed_.end(), other.renamed_.begin(), other.renamed_.end());
}

Result<void> check_toml_text(std::string_view text, const std::string& where) {
  if (text.size() > kMaxTomlBytes)
    return fail(ErrorCode::kUnsupported, where, "{} bytes of TOML; at most {} are read", text.size(),
                kMaxTomlBytes);
  if (const auto found = TomlNesting(text).too_deep())
    return fail(ErrorCode::kUnsupported, fmt::format("{}:{}", where, found->first),
                "tables are nested too deeply: {}", found->second);
  return {};
}

const ParamRef* ParamList::find(std::string_view name) const {
  const auto found =
      std::find_if(params_.begin(), params_.end(), [&](const auto& p) { return p.name == name; });
  return found == params_.end() ? nullptr : &*found;
}

void ParamList::add_renamed(std::string_view old_name, std::string_view new_name) {
  renamed_.emplace_back(old_name, new_name);
}

std::string ParamList::unknown_name(std::string_view name) const {
  const std::string_view section = name.substr(0, name.find('.'));
  for (const auto& [old_name, new_name] : renamed_) {
    if (old_name == name) return fmt::format("'{}' is called '{}' now", name, new_name);
    if (old_name != section) continue;
    const std::string moved = new_name + std::string(name.substr(section.size()));
    return fmt::format("section '{}' is called '{}' now: '{}'{}", old_name, new_name, moved,
                       find(moved) ? "" : ", which is no parameter any more");
  }
  return unknown_key(params_, name);
}

Result<void> ParamList::set(std::string_view assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos)
    return fail(ErrorCode::kUsage, "--set", "'{}' is not of the form section.key=value", assignment);
  const std::string_view name = assignment.substr(0, equals);
  const ParamRef* param = find(name);
  if (!param) return fail(ErrorCode::kUsage, "--set", "{}", unknown_name(name));
  const std::string wrong = assign(*param, parse_value(*param, assignment.substr(equals + 1)), true);
  if (!wrong.empty()) return fail(ErrorCode::kInvalidValue, "--set", "{}", wrong);
  return {};
}

Result<void> ParamList::read_toml(std::string_view text, const std::string& where) {
  if (auto checked = check_toml_text(text, where); !checked) return checked;
  toml::table document;
  try {
    document = toml::parse(text, where);
  } catch (const toml::parse_error& error) {
    return fail(ErrorCode::kCorrupted, fmt::format("{}:{}", where, error.source().begin.line), "{}",
                error.description());
  }
  std::vector<std::string> wrongs;
  std::vector<std::pair<const ParamRef*, Value>> assignments;
  for (const auto& [section, content] : document) {
    const auto* table = content.as_table();
    if (!table) {
      wrongs.push_back(fmt::format("line {}: '{}' stands outside of a [section]", content.source().begin.line,
                                   section.str()));
      continue;
    }
    for (const auto& [key, node] : *table) {
      const std::string name = fmt::format("{}.{}", section.str(), key.str());
      const ParamRef* param = find(name);
      const auto value = toml_value(node);
      std::string wrong;
      if (!param)
        wrong = unknown_name(name);
      else if (!value)
        wrong = fmt::format("{} has a value of an unknown kind", name);
      else
        wrong = assign(*param, *value, false);
      if (!wrong.empty())
        wrongs.push_back(fmt::format("line {}: {}", node.source().begin.line, wrong));
      else
        assignments.emplace_back(param, *value);
    }
  }
  if (!wrongs.empty()) return fail(ErrorCode::kInvalidValue, where, "{}", fmt::join(wrongs, "; "));
  for (const auto& [param, value] : assignments) assign(*param, value, true);
  return {};
}

Result<void> ParamList::read_toml_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return fail(ErrorCode::kNotFound, path, "cannot open this parameter file");
  // Reads one byte more than allowed, so that endless devices are rejected like files that are too large.
  std::string text(kMaxTomlBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) return fail(ErrorCode::kUnreadable, path, "cannot read this parameter file");
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMaxTomlBytes)
    return fail(ErrorCode::kUnsupported, path, "more than {} bytes: not a parameter file", kMaxTomlBytes);
  return read_toml(text, path);
}

Result<void> ParamList::check() const {
  std::vector<std::string> wrongs;
  for (const ParamRef& param : params_) {
    std::string wrong;
    if (const auto* real = std::get_if<double*>(&param.value)) wrong = range_violation(param, **real);
    if (const auto* single = std::get_if<float*>(&param.value)) wrong = range_violation(param, **single);
    if (const auto* integer = std::get_if<int*>(&param.value)) wrong = range_violation(param, **integer);
    if (!wrong.empty()) wrongs.push_back(std::move(wrong));
  }
  if (!wrongs.empty()) return fail(ErrorCode::kInvalidValue, "parameters", "{}", fmt::join(wrongs, "; "));
  return {};
}

std::string ParamList::to_toml(ParamLevel least) const {
  std::string out, section;
  for (const ParamRef& param : params_) {
    if (param.level < least) continue;
    const std::size_t dot = param.name.find('.');
    if (const std::string own = param.name.substr(0, dot); own != section) {
      out += fmt::format("{}[{}]\n", out.empty() ? "" : "\n", own);
      section = own;
    }
    std::string allowed = range_text(param.range);
    if (const auto* choice = std::get_if<ChoiceRef>(&param.value)) allowed = joined(choice->names);
    out += fmt::format("# {}{}\n{} = {}\n", param.help, allowed.empty() ? "" : " (" + allowed + ")",
                       param.name.substr(dot + 1), value_text(param));
  }
  return out;
}

std::string value_text(const ParamRef& param) {
  const auto with_point = [](std::string text) {
    return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
  };
  if (const auto* real = std::get_if<double*>(&param.value)) return with_point(fmt::format("{}", **real));
  if (const auto* single = std::get_if<float*>(&param.value)) return with_point(fmt::format("{}", **single));
  if (const auto* integer = std::get_if<int*>(&param.value)) return fmt::format("{}", **integer);
  if (const auto* flag = std::get_if<bool*>(&param.value)) return **flag ? "true" : "false";
  const auto quoted = [](std::string_view text) {
    std::ostringstream out;
    out << toml::value<std::string>(std::string(text));
    return out.str();
  };
  if (const auto* text = std::get_if<std::string*>(&param.value)) return quoted(**text);
  const auto& choice = std::get<ChoiceRef>(param.value);
  return quoted(choice.names[static_cast<std::size_t>(choice.get())]);
}

}  // namespace hm
