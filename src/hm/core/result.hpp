#pragma once
#include <fmt/core.h>

#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <utility>

namespace hm {

/// Why an operation on outside input (file, folder, configuration) failed.
enum class ErrorCode {
  kNotFound,      ///< a file, folder, stream or key is not there
  kUnreadable,    ///< the operating system refused to open, read or write it
  kTruncated,     ///< it ends too early
  kCorrupted,     ///< its contents contradict its format
  kUnsupported,   ///< a valid variant that this program does not handle
  kInvalidValue,  ///< a value is outside of its allowed range, or not a number
  kUsage,         ///< the user asked for something impossible
  kOutOfMemory,   ///< a memory cap was reached
  kCancelled,     ///< the user asked to stop
  kInternal,      ///< an external library failed in a way that it should not
};
std::string_view to_string(ErrorCode code);

/// Bad input, described for the person who has to mend it: what is wrong, and where (path, with line
/// or byte offset where there is one).
struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;
  std::string where;
};

/// "where: message", or just the message.
std::string to_string(const Error& error);

/// A value, or the reason why there is none. Used for input, files and configuration; a broken
/// precondition is an HM_CHECK, an estimate that was not found is a status in a result struct.
template <class T>
using Result = tl::expected<T, Error>;

/// Makes the error branch of a Result: `return fail(ErrorCode::kTruncated, path, "ends at byte {}", n);`
template <class... Args>
[[nodiscard]] tl::unexpected<Error> fail(ErrorCode code, std::string where,
                                         fmt::format_string<Args...> format, Args&&... args) {
  return tl::make_unexpected(Error{code, fmt::format(format, std::forward<Args>(args)...), std::move(where)});
}

/// Passes an error on with the same contents, whatever the Result's type.
template <class T>
[[nodiscard]] tl::unexpected<Error> forward_error(const Result<T>& result) {
  return tl::make_unexpected(result.error());
}

}  // namespace hm
