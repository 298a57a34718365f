#include "hm/sim/vehicle/fault_script.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <optional>

#include "hm/core/text/nearest_name.hpp"

namespace hm {
namespace {

constexpr double kLongest_s = 86400;    ///< a day
constexpr std::size_t kMaxQuoted = 40;  ///< letters of a wrong word in an error
constexpr std::string_view kBlanks = " \t\r";

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) return words;
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
}

/// Nothing when a word is the expected one, else what to say about it.
std::string unexpected(std::string_view word, std::string_view expected) {
  if (word == expected) return {};
  return fmt::format("'{}' instead of '{}'", word.substr(0, kMaxQuoted), expected);
}

std::optional<double> seconds_of(std::string_view word) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

Result<Duration> parse_seconds(std::string_view word, std::string_view meaning, bool may_be_zero,
                               const std::string& where) {
  const auto seconds = seconds_of(word);
  if (!seconds)
    return fail(ErrorCode::kInvalidValue, where, "'{}' is not a number of seconds ({})",
                word.substr(0, kMaxQuoted), meaning);
  if (*seconds < 0 || *seconds > kLongest_s || (*seconds == 0 && !may_be_zero))
    return fail(ErrorCode::kInvalidValue, where, "{} of {} s is outside of {} .. {} s", meaning, *seconds,
                may_be_zero ? "0" : "above 0", kLongest_s);
  return Duration::from_seconds(*seconds);
}

}  // namespace

Result<ScriptedFault> parse_fault(std::string_view line, const std::string& where) {
  constexpr std::string_view kForm = "a fault is written 'fault NAME at T for D'";
  constexpr std::size_t kWords = 6;
  const std::vector<std::string_view> words = words_of(line);
  if (!words.empty() && words[0] != "fault")
    return fail(ErrorCode::kUsage, where, "{}; {}", unexpected(words[0], "fault"), kForm);
  if (words.size() > 1 && std::ranges::find(kFaultNames, words[1]) == std::end(kFaultNames))
    return fail(ErrorCode::kUsage, where, "{}",
                unknown_name("fault", words[1].substr(0, kMaxQuoted), kFaultNames));
  for (const auto& [place, expected] : {std::pair<std::size_t, std::string_view>{2, "at"}, {4, "for"}})
    if (words.size() > place && words[place] != expected)
      return fail(ErrorCode::kUsage, where, "{}; {}", unexpected(words[place], expected), kForm);
  if (words.size() != kWords)
    return fail(ErrorCode::kUsage, where, "{} words instead of {}; {}", words.size(), kWords, kForm);
  const auto at = parse_seconds(words[3], "time of the fault", true, where);
  if (!at) return forward_error(at);
  const auto duration = parse_seconds(words[5], "duration", false, where);
  if (!duration) return forward_error(duration);
  const auto index = std::ranges::find(kFaultNames, words[1]) - std::begin(kFaultNames);
  return ScriptedFault{static_cast<FaultKind>(index), *at, *duration};
}

FaultSchedule::FaultSchedule(std::vector<ScriptedFault> faults) : faults_(std::move(faults)) {}

Result<FaultSchedule> FaultSchedule::parse(std::string_view text, const std::string& name) {
  std::vector<ScriptedFault> faults;
  std::optional<Error> problems;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (words_of(line.substr(0, line.find('#'))).empty()) continue;
    const auto fault = parse_fault(line.substr(0, line.find('#')), fmt::format("{}:{}", name, number));
    if (fault) {
      faults.push_back(*fault);
    } else if (!problems) {
      problems = fault.error();
    } else {
      problems->message += fmt::format("\n{}", to_string(fault.error()));
    }
  }
  if (problems) return tl::make_unexpected(*problems);
  return FaultSchedule(std::move(faults));
}

const ScriptedFault* FaultSchedule::active(FaultKind kind, Duration elapsed) const {
  const auto found = std::ranges::find_if(faults_, [&](const ScriptedFault& fault) {
    return fault.kind == kind && elapsed >= fault.at && elapsed < fault.at + fault.duration;
  });
  return found == faults_.end() ? nullptr : &*found;
}

}  // namespace hm
