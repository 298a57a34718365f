#pragma once
#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
class Option;
}  // namespace CLI

// Verbs state their words and options with these, which only pass on to CLI11: its headers take seconds to
// compile, and are read by command_line.cpp and program.cpp alone.

/// An option of a command, or a word that follows it. Functions narrow down what it takes, and return it.
class CommandOption {
 public:
  explicit CommandOption(CLI::Option& option) : option_(&option) {}

  CommandOption required(bool is_required = true) const;
  /// Numbers of values.
  CommandOption expected(int values) const;
  CommandOption expected(int least, int most) const;
  /// Of an option that may be repeated: each time it has one value.
  CommandOption repeatable() const;
  /// Its heading in the help.
  CommandOption group(const std::string& name) const;
  /// What the help calls its value.
  CommandOption type_name(const std::string& name) const;
  CommandOption excludes(const CommandOption& other) const;
  CommandOption excludes(const std::string& name) const;
  /// `check` gives the usage error of a value; empty: none.
  CommandOption check(const std::function<std::string(const std::string&)>& check) const;
  CommandOption one_of(const std::vector<std::string>& values) const;
  CommandOption within(int least, int most) const;
  CommandOption within(double least, double most) const;
  CommandOption not_negative() const;
  CommandOption above_zero() const;
  /// Calls `use` with each value.
  CommandOption each(const std::function<void(const std::string&)>& use) const;

 private:
  CLI::Option* option_;
};

/// A verb on the command line. Values are written where references point, which must outlive the parsing.
class Command {
 public:
  explicit Command(CLI::App& app) : app_(&app) {}

  /// For the types of values that command_line.cpp lists.
  template <class Value>
  CommandOption add_option(const std::string& name, Value& value, const std::string& help) const;
  CommandOption add_flag(const std::string& name, bool& is_given, const std::string& help) const;
  /// A flag that may have a value ("--name{value without one}").
  CommandOption add_flag(const std::string& name, std::string& value, const std::string& help) const;
  /// Calls `use` when the words of this command have been read.
  void when_parsed(const std::function<void()>& use) const;

 private:
  CLI::App* app_;
};
