#include "hm/pipeline/flight/flight_script.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "hm/core/angle.hpp"
#include "hm/core/text/nearest_name.hpp"
#include "hm/io/bytes/file_bytes.hpp"
#include "hm/io/bytes/text_lines.hpp"

namespace hm {
namespace {

using Kind = FlightOrder::Kind;
using Words = std::span<const std::string_view>;

constexpr std::size_t kMaxQuoted = 40;  ///< letters of a wrong word in an error
constexpr double kMost_m = 1000, kMost_m_s = 20, kMostTurn_deg = 3600, kLongest_s = 86400;

/// The form of a line: its first word, how it is written, and how many words may follow.
struct LineForm {
  std::string_view word, form;
  std::size_t least, most;
};
constexpr std::array<LineForm, 9> kForms{{{"takeoff", "takeoff [HEIGHT]", 0, 1},
                                          {"goto", "goto X Y Z [YAW]", 3, 4},
                                          {"step", "step FORWARD LEFT UP [YAW]", 3, 4},
                                          {"velocity", "velocity VX VY VZ YAW_RATE for S", 6, 6},
                                          {"wait", "wait S", 1, 1},
                                          {"hold", "hold", 0, 0},
                                          {"return", "return", 0, 0},
                                          {"land", "land", 0, 0},
                                          {"estop", "estop", 0, 0}}};  // in the order of Kind
constexpr std::string_view kFault = "fault";

/// The numbers of a line; remembers the first that is wrong.
class LineNumbers {
 public:
  explicit LineNumbers(Words words) : words_(words) {}
  /// The number at this place, within the limits.
  double at(std::size_t place, std::string_view meaning, double least, double most) {
    const std::string_view word = words_[place];
    const auto number = parse_number(word);
    std::string wrong;
    if (!number || !std::isfinite(*number))
      wrong = fmt::format("'{}' is not a number ({})", word.substr(0, kMaxQuoted), meaning);
    else if (*number < least || *number > most)
      wrong = fmt::format("{} of {} is outside of {} .. {}", meaning, *number, least, most);
    if (problem_.empty()) problem_ = wrong;
    return wrong.empty() ? *number : 0;
  }
  Vec3 vector_at(std::size_t place, std::array<std::string_view, 3> meanings, double most) {
    Vec3 v;
    for (std::size_t k = 0; k < 3; ++k)
      v(static_cast<Eigen::Index>(k)) = at(place + k, meanings[k], -most, most);
    return v;
  }
  Duration seconds_at(std::size_t place) {
    constexpr double kShortest_s = 0.001;
    return Duration::from_seconds(at(place, "seconds", kShortest_s, kLongest_s));
  }
  [[nodiscard]] const std::string& problem() const { return problem_; }

 private:
  Words words_;
  std::string problem_;
};

std::string unknown_word(std::string_view word) {
  std::vector<std::string_view> names{kFault};
  for (const LineForm& form : kForms) names.push_back(form.word);
  return unknown_name("word", word.substr(0, kMaxQuoted), names);
}

/// Reads an order kGoTo or kStep.
FlightOrder read_place(Kind kind, Words arguments, LineNumbers& numbers) {
  FlightOrder order;
  order.kind = kind;
  order.position_m = kind == Kind::kGoTo ? numbers.vector_at(0, {"x", "y", "z"}, kMost_m)
                                         : numbers.vector_at(0, {"forward", "left", "up"}, kMost_m);
  if (arguments.size() > 3)
    order.yaw_rad = numbers.at(3, "yaw in degrees", -kMostTurn_deg, kMostTurn_deg) * kRadiansPerDegree;
  return order;
}

FlightOrder read_order(Kind kind, Words arguments, LineNumbers& numbers) {
  FlightOrder order;
  order.kind = kind;
  constexpr double kLowest_m = 0.2, kHighest_m = 100;
  switch (kind) {
    case Kind::kTakeOff:
      if (!arguments.empty()) order.height_m = numbers.at(0, "height in metres", kLowest_m, kHighest_m);
      break;
    case Kind::kGoTo:
    case Kind::kStep:
      return read_place(kind, arguments, numbers);
    case Kind::kVelocity:
      order.velocity_m_s =
          numbers.vector_at(0, {"speed forward", "speed to the left", "speed up"}, kMost_m_s);
      order.yaw_rate_rad_s =
          numbers.at(3, "yaw rate in degrees a second", -kMostTurn_deg, kMostTurn_deg) * kRadiansPerDegree;
      order.duration = numbers.seconds_at(5);
      break;
    case Kind::kWait:
      order.duration = numbers.seconds_at(0);
      break;
    default:
      break;
  }
  return order;
}

/// A comment begins with #.
std::string_view without_comment(std::string_view line) { return line.substr(0, line.find('#')); }

/// Errors of several lines as one.
class Problems {
 public:
  void add(const Error& error) {
    if (!first_)
      first_ = Error{ErrorCode::kUsage, error.message, error.where};
    else
      first_->message.append(1, '\n').append(to_string(error));
  }
  [[nodiscard]] const std::optional<Error>& all() const { return first_; }

 private:
  std::optional<Error> first_;
};

/// Why an order makes no sense after those before it; empty: it does. Keeps track of whether the vehicle
/// flies.
std::string out_of_order(const FlightOrder& order, bool& flies) {
  const bool needs_flight =
      order.kind != Kind::kTakeOff && order.kind != Kind::kWait && order.kind != Kind::kEStop;
  if (needs_flight && !flies) return fmt::format("'{}' before a takeoff", order.text);
  if (order.kind == Kind::kTakeOff && flies) return "a takeoff in flight: land first";
  if (order.kind == Kind::kTakeOff) flies = true;
  const bool ends = order.kind == Kind::kReturn || order.kind == Kind::kLand || order.kind == Kind::kEStop;
  if (ends) flies = false;
  return {};
}

/// Calls `use(line, place)` for each line of a text that says something.
template <class Use>
void for_lines(std::string_view text, const std::string& name, Use&& use) {
  const TextFile file(std::string(text), name);
  for (const TextLine& line : file.lines()) use(without_comment(line.text), file.where(line));
}

FlightOrder order_of(Kind kind, std::string text) {
  FlightOrder order;
  order.kind = kind;
  order.text = std::move(text);
  return order;
}

FlightOrder take_off(double height_m) {
  FlightOrder order = order_of(Kind::kTakeOff, fmt::format("takeoff {:g}", height_m));
  order.height_m = height_m;
  return order;
}

FlightOrder wait(Duration duration) {
  FlightOrder order = order_of(Kind::kWait, fmt::format("wait {:g}", duration.seconds()));
  order.duration = duration;
  return order;
}

Result<std::string> read_text(const std::filesystem::path& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20;
  const auto bytes = read_file_bytes(path, kMostBytes);
  if (!bytes) return forward_error(bytes);
  return std::string(bytes->begin(), bytes->end());
}

}  // namespace

Result<std::variant<FlightOrder, ScriptedFault>> parse_flight_line(std::string_view line,
                                                                   const std::string& where) {
  line = without_comment(line);
  const std::vector<std::string_view> all = words(line);
  if (all.empty()) return fail(ErrorCode::kUsage, where, "an empty line");
  if (all[0] == kFault) {
    const auto fault = parse_fault(line, where);
    if (!fault) return fail(ErrorCode::kUsage, where, "{}", fault.error().message);
    return *fault;
  }
  const auto form = std::ranges::find(kForms, all[0], &LineForm::word);
  if (form == kForms.end()) return fail(ErrorCode::kUsage, where, "{}", unknown_word(all[0]));
  const Words arguments = Words(all).subspan(1);
  if (arguments.size() < form->least || arguments.size() > form->most)
    return fail(ErrorCode::kUsage, where, "it is written '{}'", form->form);
  const auto kind = static_cast<Kind>(form - kForms.begin());
  if (kind == Kind::kVelocity && arguments[4] != "for")
    return fail(ErrorCode::kUsage, where, "'{}' instead of 'for'; it is written '{}'",
                arguments[4].substr(0, kMaxQuoted), form->form);
  LineNumbers numbers(arguments);
  FlightOrder order = read_order(kind, arguments, numbers);
  if (!numbers.problem().empty())
    return fail(ErrorCode::kUsage, where, "{}; it is written '{}'", numbers.problem(), form->form);
  order.text = fmt::format("{}", fmt::join(all, " "));
  return order;
}

Result<FlightScript> parse_flight_script(std::string_view text, const std::string& name) {
  FlightScript script;
  Problems problems;
  bool flies = false;
  for_lines(text, name, [&](std::string_view line, const std::string& where) {
    const auto parsed = parse_flight_line(line, where);
    if (!parsed) return problems.add(parsed.error());
    if (const auto* fault = std::get_if<ScriptedFault>(&*parsed)) return script.faults.push_back(*fault);
    const FlightOrder& order = std::get<FlightOrder>(*parsed);
    if (const std::string wrong = out_of_order(order, flies); !wrong.empty())
      return problems.add({ErrorCode::kUsage, wrong, where});
    script.orders.push_back(order);
  });
  if (!problems.all() && script.orders.empty())
    problems.add({ErrorCode::kUsage, "the script has no order for the vehicle", name});
  if (problems.all()) return tl::make_unexpected(*problems.all());
  return script;
}

Result<FlightScript> read_flight_script(const std::filesystem::path& path) {
  const auto text = read_text(path);
  if (!text) return forward_error(text);
  return parse_flight_script(*text, path.string());
}

Result<FlightScript> parse_way_points(std::string_view text, const std::string& name) {
  FlightScript script;
  Problems problems;
  for_lines(text, name, [&](std::string_view line, const std::string& where) {
    const std::vector<std::string_view> all = words(line);
    if (all.size() < 3 || all.size() > 4)
      return problems.add({ErrorCode::kUsage, "a way point is written 'X Y Z [YAW]'", where});
    LineNumbers numbers(all);
    FlightOrder order = read_place(Kind::kGoTo, all, numbers);
    if (!numbers.problem().empty()) return problems.add({ErrorCode::kUsage, numbers.problem(), where});
    order.text = fmt::format("goto {}", fmt::join(all, " "));
    script.orders.push_back(std::move(order));
  });
  if (!problems.all() && script.orders.empty())
    problems.add({ErrorCode::kUsage, "there is no way point", name});
  if (problems.all()) return tl::make_unexpected(*problems.all());
  constexpr double kLowest_m = 0.4;
  const double height_m = std::max(kLowest_m, script.orders.front().position_m.z());
  script.orders.insert(script.orders.begin(), take_off(height_m));
  script.orders.push_back(order_of(Kind::kLand, "land"));
  return script;
}

Result<FlightScript> read_way_points(const std::filesystem::path& path) {
  const auto text = read_text(path);
  if (!text) return forward_error(text);
  return parse_way_points(*text, path.string());
}

FlightScript hover_script(double height_m, Duration duration) {
  return {{take_off(height_m), wait(duration), order_of(Kind::kLand, "land")}, {}};
}

FlightScript go_to_script(const Vec3& goal_m) {
  constexpr double kLowest_m = 0.4, kStay_s = 2;
  FlightOrder go_to =
      order_of(Kind::kGoTo, fmt::format("goto {:g} {:g} {:g}", goal_m.x(), goal_m.y(), goal_m.z()));
  go_to.position_m = goal_m;
  return {{take_off(std::max(kLowest_m, goal_m.z())), std::move(go_to), wait(Duration::from_seconds(kStay_s)),
           order_of(Kind::kLand, "land")},
          {}};
}

}  // namespace hm
