#include <pthread.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <memory>
#include <thread>

#include "hm/core/parallel.hpp"
#include "program.hpp"
#include "terminal.hpp"
#include "version.hpp"

using hm::fail;

Session::Session(CommonOptions options, std::vector<MakeParameterPart> parts)
    : options_(std::move(options)), parts_(std::move(parts)) {
  if (options_.quiet) return;
  auto terminal = std::make_shared<Terminal>();
  progress_ = [terminal](const hm::Progress& progress) { terminal->show(progress); };
  log_ = [terminal](hm::LogLevel level, const std::string& message) {
    terminal->line(level == hm::LogLevel::kWarning ? "warning: " + message : message);
  };
}

int Session::threads() const { return options_.threads > 0 ? options_.threads : hm::available_threads(); }

hm::Result<void> AllParameters::read(const std::string& path) {
  auto result = list.read_toml_file(path);
  for (const hm::ParameterPart& part : parts)
    if (result && part.check) result = part.check();
  if (!result) result.error().code = hm::ErrorCode::kUsage;
  return result;
}

AllParameters Session::all_parameters() const {
  AllParameters all;
  for (const MakeParameterPart& make : parts_) {
    all.parts.push_back(make());
    all.list.add_missing(all.parts.back().list);
  }
  return all;
}

hm::Result<void> Session::apply(const hm::ParamList& own) const {
  const auto as_usage = [](const hm::Result<void>& result) {
    const bool is_unknown =
        !has_all_parts && result.error().message.find("unknown parameter") != std::string::npos;
    return tl::make_unexpected(hm::Error{
        hm::ErrorCode::kUsage,
        result.error().message +
            (is_unknown ? "; this program has no parameters of the other verbs: ./hm build all" : ""),
        result.error().where});
  };
  const AllParameters all = all_parameters();  // holds the values of the other parts
  hm::ParamList params = own;
  params.add_missing(all.list);
  if (!options_.params_file.empty())
    if (const auto read = params.read_toml_file(options_.params_file); !read) return as_usage(read);
  for (const std::string& assignment : options_.assignments)
    if (const auto set = params.set(assignment); !set) return as_usage(set);
  if (const auto checked = params.check(); !checked) return as_usage(checked);
  return {};
}

hm::RunContext Session::context() const { return {threads(), kVersion, progress_, log_}; }

hm::RunContext Session::interruptible_context(const std::string& consequence) {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // threads made later inherit it
  std::thread([signals, consequence, stop = stop_, log = log_]() mutable {
    int number = 0;
    sigwait(&signals, &number);
    if (log) log(hm::LogLevel::kInfo, fmt::format("stopping: {} (Ctrl-C again: stop at once)", consequence));
    stop.request_stop();
    sigwait(&signals, &number);
    _exit(1);
  }).detach();
  hm::RunContext run = context();
  run.stop = stop_.get_token();
  return run;
}
