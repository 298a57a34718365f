#include "command_line.hpp"

#include <CLI/CLI.hpp>

CommandOption CommandOption::required(bool is_required) const {
  return CommandOption(*option_->required(is_required));
}
CommandOption CommandOption::expected(int values) const { return CommandOption(*option_->expected(values)); }
CommandOption CommandOption::expected(int least, int most) const {
  return CommandOption(*option_->expected(least, most));
}
CommandOption CommandOption::repeatable() const {
  return CommandOption(*option_->take_all()->allow_extra_args(false));
}
CommandOption CommandOption::group(const std::string& name) const {
  return CommandOption(*option_->group(name));
}
CommandOption CommandOption::type_name(const std::string& name) const {
  return CommandOption(*option_->type_name(name));
}
CommandOption CommandOption::excludes(const CommandOption& other) const {
  return CommandOption(*option_->excludes(other.option_));
}
CommandOption CommandOption::excludes(const std::string& name) const {
  return CommandOption(*option_->excludes(name));
}
CommandOption CommandOption::check(const std::function<std::string(const std::string&)>& check) const {
  return CommandOption(*option_->check(check));
}
CommandOption CommandOption::one_of(const std::vector<std::string>& values) const {
  return CommandOption(*option_->check(CLI::IsMember(values)));
}
CommandOption CommandOption::within(int least, int most) const {
  return CommandOption(*option_->check(CLI::Range(least, most)));
}
CommandOption CommandOption::within(double least, double most) const {
  return CommandOption(*option_->check(CLI::Range(least, most)));
}
CommandOption CommandOption::not_negative() const {
  return CommandOption(*option_->check(CLI::NonNegativeNumber));
}
CommandOption CommandOption::above_zero() const {
  // As CLI::PositiveNumber, with a shorter message.
  const CLI::Validator above_zero(
      [](std::string& text) {
        double value = 0;
        const bool is_right = CLI::detail::lexical_cast(text, value) && value > 0;
        return is_right ? std::string() : text + " is not a number above 0";
      },
      "POSITIVE");
  return CommandOption(*option_->check(above_zero));
}
CommandOption CommandOption::each(const std::function<void(const std::string&)>& use) const {
  return CommandOption(*option_->each(use));
}

template <class Value>
CommandOption Command::add_option(const std::string& name, Value& value, const std::string& help) const {
  return CommandOption(*app_->add_option(name, value, help));
}
template CommandOption Command::add_option(const std::string&, std::string&, const std::string&) const;
template CommandOption Command::add_option(const std::string&, double&, const std::string&) const;
template CommandOption Command::add_option(const std::string&, int&, const std::string&) const;
template CommandOption Command::add_option(const std::string&, std::vector<std::string>&,
                                           const std::string&) const;
template CommandOption Command::add_option(const std::string&, std::vector<double>&,
                                           const std::string&) const;
template CommandOption Command::add_option(const std::string&, std::vector<int>&, const std::string&) const;

CommandOption Command::add_flag(const std::string& name, bool& is_given, const std::string& help) const {
  return CommandOption(*app_->add_flag(name, is_given, help));
}
CommandOption Command::add_flag(const std::string& name, std::string& value, const std::string& help) const {
  return CommandOption(*app_->add_flag(name, value, help));
}

void Command::when_parsed(const std::function<void()>& use) const { app_->parse_complete_callback(use); }
