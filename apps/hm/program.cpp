#include "program.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <sstream>

#include "hm/core/stopwatch.hpp"
#include "hm/core/text/nearest_name.hpp"
#include "hm/io/bytes/json.hpp"
#include "output.hpp"
#include "version.hpp"

namespace {

void add_common_options(Command command, CommonOptions& options) {
  const auto group = "Common options";
  command.add_flag("--json", options.json, "print one JSON object on standard output and nothing else there")
      .group(group);
  command.add_flag("--quiet", options.quiet, "print nothing but errors (and the object of --json)")
      .group(group);
  command
      .add_option("--threads", options.threads,
                  "number of threads (default: all; of scan, all but one until its end)")
      .within(1, 256)
      .group(group);
  command.add_option("--params", options.params_file, "read parameters from this TOML file").group(group);
  command
      .add_option("--set", options.assignments,
                  "set one parameter: section.key=value (repeatable; `hm params show` lists them)")
      .repeatable()
      .group(group);
}

struct RegisteredVerb {
  int place;
  void (*add)(Program&);
};

std::vector<RegisteredVerb>& registered_verbs() {
  static std::vector<RegisteredVerb> verbs;
  return verbs;
}

/// "unknown option '--voxle'; did you mean '--voxel'?"
std::string unknown_word(std::string_view kind, std::string_view word,
                         const std::vector<std::string>& names) {
  const std::vector<std::string_view> views(names.begin(), names.end());
  const auto nearest = hm::nearest_name(word, views);
  return fmt::format("unknown {} '{}'{}", kind, word,
                     nearest ? fmt::format("; did you mean '{}'?", *nearest) : std::string());
}

}  // namespace

VerbRegistration::VerbRegistration(int place, void (*add)(Program&)) {
  registered_verbs().push_back({place, add});
}

hm::Error not_built(const std::string& words) {
  return {hm::ErrorCode::kUsage,
          fmt::format("'{}' is not in this program, which was built for dense reconstruction only; "
                      "./hm build all builds all verbs",
                      words),
          {}};
}

void OutputFlags::add_to(Command command, const std::string& by_default) {
  command.add_option("-o,--output", folder_given, "folder for the results (default: " + by_default + ")");
  command.add_flag("--overwrite", overwrite, "replace an existing result in this folder");
}

void OutputFlags::add_strict_to(Command command) {
  command.add_flag("--strict", strict, "fail (exit code 1) unless the verdict of the run is ok");
}

void OutputFlags::add_resume_to(Command command, const std::string& help) {
  command.add_flag("--resume", resume, help).excludes("--overwrite");
}

hm::ExistingResult OutputFlags::existing() const {
  if (resume) return hm::ExistingResult::kResume;
  return overwrite ? hm::ExistingResult::kOverwrite : hm::ExistingResult::kRefuse;
}

hm::Result<std::optional<Outcome>> OutputFlags::complete_result(
    const hm::ResultFolderRequest& request) const {
  const auto& folder = request.folder;
  const auto record = hm::read_run_record(folder);
  if (!record) return hm::forward_error(record);
  if (!*record || !(*record)->is_of(request) || (*record)->state != hm::RunState::kComplete)
    return std::nullopt;
  const auto path = folder / "report.json";
  auto report = hm::read_json_file(path);
  if (!report) return hm::forward_error(report);
  Outcome outcome;
  outcome.text = fmt::format("{}: already complete; --overwrite runs it again\n", folder.string());
  outcome.json = std::move(*report);
  outcome.json["complete"] = true;
  if (strict) outcome.failure = hm::strict_failure(hm::verdict_of_report(outcome.json));
  for (const std::string& name : (*record)->files) outcome.outputs.push_back(folder / name);
  return outcome;
}

hm::Result<void> read_saved_parameters(const std::filesystem::path& folder, hm::ParamList list) {
  const auto path = folder / "parameters.toml";
  std::error_code code;
  if (!std::filesystem::exists(path, code)) return {};
  return list.read_toml_file(path);
}

std::filesystem::path OutputFlags::folder(const std::filesystem::path& recording,
                                          const std::string& suffix) const {
  if (!folder_given.empty()) return folder_given;
  auto name = std::filesystem::absolute(recording).lexically_normal();
  if (!name.has_filename()) name = name.parent_path();
  std::error_code code;
  const bool is_file = std::filesystem::is_regular_file(name, code);
  return (is_file ? name.stem() : name.filename()).string() + "_" + suffix;
}

Program::Program()
    : app_(std::make_unique<CLI::App>("housemartin: live 3D reconstruction of buildings on an ordinary CPU",
                                      "hm")) {
  app_->set_version_flag("--version", std::string("housemartin ") + kVersion);
  app_->require_subcommand(1);
  app_->footer(
      "Start with `hm demo`. `hm VERB --help` shows a verb's options and examples.\n"
      "Exit codes: 0 done, 1 the run failed, 2 usage or configuration, 3 input data.");
}

Program::~Program() = default;

void Program::add_registered_verbs() {
  auto verbs = registered_verbs();
  std::sort(verbs.begin(), verbs.end(), [](const auto& a, const auto& b) { return a.place < b.place; });
  for (const RegisteredVerb& verb : verbs) verb.add(*this);
}

CLI::App& Program::parent_of(const std::string& name) {
  const std::size_t space = name.find(' ');
  if (space == std::string::npos) return *app_;
  return *app_->get_subcommand(name.substr(0, space));
}

Command Program::add(Verb verb) {
  const std::string word = verb.name.substr(verb.name.find(' ') + 1);
  CLI::App& command = *parent_of(verb.name).add_subcommand(word, verb.description);
  if (!verb.examples.empty()) command.footer("Examples:\n" + verb.examples);
  if (!verb.body) {  // a word that needs a second one
    command.require_subcommand(1);
    return Command(command);
  }
  add_common_options(Command(command), options_);
  command.callback([this, verb = std::move(verb)] { chosen_ = verb; });
  return Command(command);
}

int Program::run(int argc, char** argv) {
  const bool json = std::any_of(argv, argv + argc, [](std::string_view word) { return word == "--json"; });
  report_uncaught({argc > 1 ? argv[1] : "", 0, json});
  try {
    return parse_and_run(argc, argv);
  } catch (...) {  // no room lets one out; the allocator and libraries do
    return print_result({chosen_.name, 0, json}, tl::make_unexpected(error_of(std::current_exception())));
  }
}

namespace {

bool is_number(std::string_view word) {
  return !word.empty() && word.find_first_not_of("0123456789") == std::string_view::npos;
}

/// PORT, ADDRESS:PORT, or an IPv4 address, as --serve takes them.
bool is_like_address(std::string_view word) {
  if (is_number(word) || word == "localhost") return true;
  const std::size_t colon = word.rfind(':');
  if (colon != std::string_view::npos && is_number(word.substr(colon + 1))) return true;
  return std::count(word.begin(), word.end(), '.') == 3 &&
         word.find_first_not_of("0123456789.") == std::string_view::npos;
}

/// The error of an address that a blank parts from --serve: it would be taken for the next argument. Empty:
/// there is none.
std::string address_apart(std::span<char* const> words) {
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    const std::string_view word = words[i], next = words[i + 1];
    std::error_code ignored;
    if (word == "--serve" && is_like_address(next) && !std::filesystem::exists(next, ignored))
      return fmt::format("the address of --serve follows a '=', as it may be left out: --serve={}", next);
  }
  return {};
}

}  // namespace

int Program::parse_and_run(int argc, char** argv) {
  if (argc < 2) return write_output(app_->help()) ? 0 : 1;
  const std::span<char* const> words(argv + 1, static_cast<std::size_t>(argc - 1));
  const bool json =
      std::any_of(words.begin(), words.end(), [](std::string_view word) { return word == "--json"; });
  if (const std::string absent = absent_verb(words); !absent.empty())
    return print_result({absent, 0, json}, tl::make_unexpected(not_built(absent)));
  if (const std::string apart = address_apart(words); !apart.empty())
    return print_result({words[0], 0, json},
                        tl::make_unexpected(hm::Error{hm::ErrorCode::kUsage, apart, {}}));
  try {
    app_->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return usage_error(error, words, json);
  }
  const hm::Stopwatch watch;
  Session session(options_, parts_);
  const auto result = chosen_.body(session);
  return print_result({chosen_.name, watch.seconds(), options_.json, options_.quiet}, result);
}

std::string Program::absent_verb(std::span<char* const> words) const {
  if (has_all_parts) return {};
  const CLI::App* command = app_.get();
  std::string verb;
  for (const std::string_view word : words) {
    const auto known = command->get_subcommands([](const CLI::App*) { return true; });
    if (known.empty() || word.starts_with('-')) return {};
    verb += (verb.empty() ? "" : " ") + std::string(word);
    const auto named = std::find_if(known.begin(), known.end(),
                                    [&](const CLI::App* candidate) { return candidate->get_name() == word; });
    if (named == known.end()) return verb;
    command = *named;
  }
  return {};
}

std::string Program::describe_typo(std::span<char* const> words) const {
  const CLI::App* command = app_.get();
  for (const std::string_view word : words) {
    const auto known = command->get_subcommands([](const CLI::App*) { return true; });
    if (known.empty() || word.starts_with('-')) break;
    const auto named = std::find_if(known.begin(), known.end(),
                                    [&](const CLI::App* candidate) { return candidate->get_name() == word; });
    if (named == known.end()) {
      std::vector<std::string> names;
      for (const CLI::App* candidate : known) names.push_back(candidate->get_name());
      return unknown_word("verb", word, names);
    }
    command = *named;
  }
  std::vector<std::string> names;
  for (const CLI::Option* option : command->get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  for (std::string_view word : words) {
    word = word.substr(0, word.find('='));
    if (word.starts_with("--") && word.size() > 2 &&
        std::find(names.begin(), names.end(), word) == names.end())
      return unknown_word("option", word, names);
  }
  return {};
}

int Program::usage_error(const CLI::ParseError& error, std::span<char* const> words, bool json) {
  if (error.get_exit_code() == 0) {  // --help, --version
    std::ostringstream text;
    app_->exit(error, text, text);
    return write_output(text.str()) ? 0 : 1;
  }
  std::string verb;
  for (const CLI::App* command = app_.get(); !command->get_subcommands().empty();) {
    command = command->get_subcommands().front();
    verb += (verb.empty() ? "" : " ") + command->get_name();
  }
  const std::string typo = describe_typo(words);
  const hm::Error as_error{hm::ErrorCode::kUsage, typo.empty() ? error.what() : typo, {}};
  const int code = print_result({verb, 0, json}, tl::make_unexpected(as_error));
  write_message(fmt::format("Try `hm {}{}--help`.\n", verb, verb.empty() ? "" : " "));
  return code;
}
