#include "hm/io/mesh/isolated_call.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>

namespace hm {
namespace {

#ifdef HM_SANITIZED
constexpr bool kLimitsMemory = false;  // sanitizers reserve terabytes of address space
#else
constexpr bool kLimitsMemory = true;
#endif

/// The address space that this process has, in bytes; 0 where the system does not say.
std::uint64_t address_space_bytes() {
  unsigned long pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%lu", &pages) != 1) pages = 0;
    std::fclose(file);
  }
  return std::uint64_t{pages} * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

void set_limit(int resource, std::uint64_t value) {
  const rlimit limit{value, value};
  ::setrlimit(static_cast<__rlimit_resource>(resource), &limit);
}

void limit_this_process(const IsolationLimits& limits) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT})
    ::signal(signal, SIG_DFL);
  set_limit(RLIMIT_CORE, 0);
  set_limit(RLIMIT_CPU, static_cast<std::uint64_t>(limits.cpu_s));
  const std::uint64_t already = address_space_bytes();
  if (kLimitsMemory && already > 0) set_limit(RLIMIT_AS, already + limits.memory_bytes);
  ::alarm(static_cast<unsigned>(4 * limits.cpu_s));
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
}

bool write_all(int fd, const void* bytes, std::size_t count) {
  const char* from = static_cast<const char*>(bytes);
  while (count > 0) {
    const ssize_t written = ::write(fd, from, count);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    from += written;
    count -= static_cast<std::size_t>(written);
  }
  return true;
}

// The answer: a byte (0: a result follows, else an error's code and 1, then its message), and it counts only
// when the process also ends by itself.

[[noreturn]] void answer(int fd, const IsolationLimits& limits,
                         const std::function<Result<std::string>()>& work) {
  limit_this_process(limits);
  Result<std::string> result;
  try {
    result = work();
  } catch (const std::bad_alloc&) {
    result = fail(ErrorCode::kOutOfMemory, {}, "it takes more memory than a file of its size should");
  } catch (const std::exception& error) {
    result = fail(ErrorCode::kCorrupted, {}, "{}", error.what());
  }
  const char kind = result ? '\0' : static_cast<char>(1 + static_cast<int>(result.error().code));
  const std::string& text = result ? *result : result.error().message;
  const bool told = write_all(fd, &kind, 1) && write_all(fd, text.data(), text.size());
  ::_exit(told ? 0 : 1);
}

std::string read_all(int fd) {
  std::string bytes;
  std::array<char, 1 << 16> buffer{};
  for (;;) {
    const ssize_t count = ::read(fd, buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return bytes;
    bytes.append(buffer.data(), static_cast<std::size_t>(count));
  }
}

/// How the process ended; empty: by itself.
std::string failure_of(int status, const IsolationLimits& limits) {
  if (WIFEXITED(status)) return WEXITSTATUS(status) == 0 ? "" : "its reader gave up";
  const int signal = WTERMSIG(status);
  if (signal == SIGXCPU || signal == SIGALRM || signal == SIGKILL)
    return fmt::format("reading it takes longer than {} s", limits.cpu_s);
  return fmt::format("its reader crashed ({})", ::strsignal(signal));
}

}  // namespace

Result<std::string> call_isolated(const std::string& where, const IsolationLimits& limits,
                                  const std::function<Result<std::string>()>& work) {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0)
    return fail(ErrorCode::kInternal, where, "no pipe: {}", std::strerror(errno));
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(pipe[0]);
    answer(pipe[1], limits, work);
  }
  ::close(pipe[1]);
  std::string bytes = child > 0 ? read_all(pipe[0]) : std::string();
  ::close(pipe[0]);
  if (child < 0) return fail(ErrorCode::kInternal, where, "no process: {}", std::strerror(errno));
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (const std::string failure = failure_of(status, limits); !failure.empty())
    return fail(ErrorCode::kCorrupted, where, "{}", failure);
  if (bytes.empty()) return fail(ErrorCode::kInternal, where, "its reader gave no answer");
  const char kind = bytes.front();
  bytes.erase(0, 1);
  if (kind == '\0') return bytes;
  return fail(static_cast<ErrorCode>(kind - 1), where, "{}", bytes);
}

}  // namespace hm
