#pragma once
#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "hm/core/json_value.hpp"
#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/core/run_context.hpp"

/// The options that every verb has.
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  int threads = 0;  ///< 0: all
  std::string params_file;
  std::vector<std::string> assignments;  ///< section.key=value
};

/// A flag's number above 0; the message is as short.
CLI::Validator positive_number();

/// Result of a verb that worked: lines for people, keys for machines.
struct Outcome {
  std::string text;                              ///< for standard output, unless --json
  hm::JsonValue json = hm::JsonValue::object();  ///< the verb's own keys
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;  ///< files and folders that were written
};

/// Converts a run's summary: its lines, its keys, its warnings, its files.
template <class Summary>
hm::Result<Outcome> outcome_of(const hm::Result<Summary>& summary) {
  if (!summary) return hm::forward_error(summary);
  return Outcome{to_text(*summary), to_json(*summary), summary->warnings, summary->outputs};
}

/// The folder of --output; empty: NAME_suffix in the current folder, after the recording's name
/// (without the extension of a file's).
std::filesystem::path output_folder(const std::string& asked, const std::filesystem::path& recording,
                                    const std::string& suffix);

/// Services for a verb while it runs.
class Session {
 public:
  explicit Session(CommonOptions options);

  [[nodiscard]] int threads() const;
  [[nodiscard]] hm::ProgressSink progress() const { return progress_; }
  /// Context of a run that Ctrl-C does not interrupt, but ends.
  [[nodiscard]] hm::RunContext context() const;
  /// Context of a run that can be stopped. From here on the first Ctrl-C (or SIGTERM) stops it, and
  /// `consequence`
  /// ("finishing with what there is") is said; the second ends the program. Call it before any other thread
  /// is started, and once.
  hm::RunContext interruptible_context(const std::string& consequence);
  /// --params FILE, then every --set, then all ranges; whatever is wrong becomes a usage error.
  [[nodiscard]] hm::Result<void> apply(hm::ParamList& params) const;

 private:
  CommonOptions options_;
  hm::ProgressSink progress_;
  hm::LogSink log_;
  std::stop_source stop_;
};

/// The command line: verbs, their common options, exit codes (0 done, 1 run failed, 2 usage or
/// configuration, 3 input data), and the one JSON object of --json.
class Program {
 public:
  using Body = std::function<hm::Result<Outcome>(Session&)>;
  struct Verb {
    std::string name;         ///< "info", or "evaluate trajectory" for a verb with two words
    std::string description;  ///< one sentence
    std::string examples;     ///< runnable lines, shown by --help
    Body body;
  };

  Program();
  /// Adds a verb and returns its command, for the verb's own options.
  CLI::App& add(Verb verb);
  int run(int argc, char** argv);

 private:
  CLI::App& parent_of(const std::string& name);
  int usage_error(const CLI::ParseError& error, bool json);

  CLI::App app_;
  CommonOptions options_;
  Verb chosen_;
};

// One file per verb.
void add_demo(Program& program);
void add_calibrate(Program& program);
void add_info(Program& program);
void add_simulate(Program& program);
void add_reconstruct(Program& program);
void add_odometry(Program& program);
void add_slam(Program& program);
void add_laser(Program& program);
void add_evaluate(Program& program);
void add_convert(Program& program);
void add_params(Program& program);
