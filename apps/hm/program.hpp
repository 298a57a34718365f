#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "hm/core/json_value.hpp"
#include "hm/core/params.hpp"
#include "hm/core/result.hpp"
#include "hm/core/run_context.hpp"
#include "hm/pipeline/common/parameters.hpp"
#include "hm/pipeline/common/result_folder.hpp"
#include "hm/pipeline/verdict/run_verdict.hpp"

namespace CLI {
class ParseError;
}

/// The options that every verb has.
struct CommonOptions {
  bool json = false;
  bool quiet = false;
  int threads = 0;  ///< 0: all
  std::string params_file;
  std::vector<std::string> assignments;  ///< section.key=value
};

/// Result of a verb that worked: lines for people, keys for machines.
struct Outcome {
  std::string text;                              ///< for standard output, unless --json
  hm::JsonValue json = hm::JsonValue::object();  ///< the verb's own keys
  std::vector<std::string> warnings;
  std::vector<std::filesystem::path> outputs;  ///< files and folders that were written
  bool warnings_in_text = false;               ///< the text states them already
  std::optional<hm::Error> failure = {};       ///< the run went to its end, and what it found is a failure
};

/// Converts a run's summary: its lines, its keys, its warnings, its files.
template <class Summary>
hm::Result<Outcome> outcome_of(const hm::Result<Summary>& summary) {
  if (!summary) return hm::forward_error(summary);
  return Outcome{to_text(*summary), to_json(*summary), summary->warnings, summary->outputs};
}

/// The same for a run with a verdict; `strict`: one that is not ok is a failure of the run.
template <class Summary>
hm::Result<Outcome> outcome_with_verdict(const hm::Result<Summary>& summary, bool strict) {
  auto outcome = outcome_of(summary);
  if (outcome && strict) outcome->failure = hm::strict_failure(summary->verdict);
  return outcome;
}

/// The folder of results of a verb, and what happens to a result that lies there.
struct OutputFlags {
  std::string folder_given;
  bool overwrite = false, resume = false, strict = false;

  /// Adds -o and --overwrite; `by_default` says in the help which folder is taken without -o.
  void add_to(Command command, const std::string& by_default);
  /// Adds --strict.
  void add_strict_to(Command command);
  /// Adds --resume, with these words.
  void add_resume_to(Command command, const std::string& help);
  /// The folder that was asked for; otherwise NAME_suffix in the current folder, after the recording's name
  /// (without the extension of a file's).
  [[nodiscard]] std::filesystem::path folder(const std::filesystem::path& recording,
                                             const std::string& suffix) const;
  [[nodiscard]] hm::ExistingResult existing() const;
  /// Outcome of `--resume` on a complete run: its existing report, judged as that of a new run. Nothing where
  /// frames remain, or where the request differs from that run.
  [[nodiscard]] hm::Result<std::optional<Outcome>> complete_result(
      const hm::ResultFolderRequest& request) const;
};

/// Reads the parameters of the run that is to be continued, if its folder has saved them.
hm::Result<void> read_saved_parameters(const std::filesystem::path& folder, hm::ParamList list);

/// Runs a verb that writes its results at its end, into the folder that it is given; they appear in the
/// requested folder when all of them are there.
template <class Run>
hm::Result<Outcome> run_into_folder(const hm::ResultFolderRequest& request, const Run& run) {
  auto folder = hm::ResultFolder::open(request);
  if (!folder) return hm::forward_error(folder);
  auto summary = run(folder->staging());
  if (!summary) return hm::forward_error(summary);
  if (const auto published = folder->publish(summary->outputs, hm::RunState::kComplete); !published)
    return hm::forward_error(published);
  return outcome_of(summary);
}

using MakeParameterPart = std::function<hm::ParameterPart()>;

/// The sections of every part of this program, with values of their own.
struct AllParameters {
  std::vector<hm::ParameterPart> parts;
  hm::ParamList list;
  /// Reads a parameter file; then what contradicts. Either is a usage error.
  hm::Result<void> read(const std::string& path);
};

/// Services for a verb while it runs.
class Session {
 public:
  Session(CommonOptions options, std::vector<MakeParameterPart> parts);

  [[nodiscard]] int threads() const;
  [[nodiscard]] bool are_threads_given() const { return options_.threads > 0; }
  [[nodiscard]] hm::ProgressSink progress() const { return progress_; }
  /// Context of a run that Ctrl-C does not interrupt, but ends.
  [[nodiscard]] hm::RunContext context() const;
  /// Context of a run that can be stopped. From here on the first Ctrl-C (or SIGTERM) stops it, and
  /// `consequence`
  /// ("finishing with what there is") is said; the second ends the program. Call it before any other thread
  /// is started, and once.
  hm::RunContext interruptible_context(const std::string& consequence);
  /// --params FILE, then every --set, then all ranges; whatever is wrong becomes a usage error. Sections of
  /// other parts may stand there as well: they are checked, and change nothing.
  [[nodiscard]] hm::Result<void> apply(const hm::ParamList& own) const;
  [[nodiscard]] AllParameters all_parameters() const;

 private:
  CommonOptions options_;
  std::vector<MakeParameterPart> parts_;
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
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  void add_registered_verbs();
  /// Adds a verb and returns its command, for the verb's own options.
  Command add(Verb verb);
  /// Adds the parameters of a verb's part of the program.
  void add_parameters(MakeParameterPart make) { parts_.push_back(std::move(make)); }
  int run(int argc, char** argv);

 private:
  int parse_and_run(int argc, char** argv);
  CLI::App& parent_of(const std::string& name);
  int usage_error(const CLI::ParseError& error, std::span<char* const> words, bool json);
  /// The first verb or option that there is not, with the nearest one; empty: there is none.
  [[nodiscard]] std::string describe_typo(std::span<char* const> words) const;
  /// The words of a verb that only a program of more parts can have; empty: there are none.
  [[nodiscard]] std::string absent_verb(std::span<char* const> words) const;

  std::unique_ptr<CLI::App> app_;
  CommonOptions options_;
  std::vector<MakeParameterPart> parts_;
  Verb chosen_;
};

/// Each file with a verb registers the function that adds it, so that a program has the verbs whose files it
/// was built of. `place` orders them.
struct VerbRegistration {
  VerbRegistration(int place, void (*add)(Program&));
};

/// Whether this program has the verbs that need more than dense reconstruction; all_parts.cpp says so before
/// main().
inline bool has_all_parts = false;

/// The error of a word whose part was not built.
hm::Error not_built(const std::string& words);
