#pragma once
#include <exception>
#include <string>
#include <string_view>

#include "program.hpp"

/// Facts about a finished run.
struct RunFacts {
  std::string verb;  ///< "info", "evaluate mesh"
  double wall_s = 0;
  bool json = false, quiet = false;
};

/// Prints the outcome of a verb (text or one JSON object on standard output, errors and warnings on standard
/// error) and returns the exit code. Where a report was written, the text ends with `open .../report.html`. A
/// quiet run prints nothing but its error, and the object of --json.
int print_result(const RunFacts& run, const hm::Result<Outcome>& result);

/// Writes to standard output; false, with a message on standard error, when the system refuses any of it.
bool write_output(std::string_view text);
/// Writes to standard error; what cannot be written there cannot be said anywhere.
void write_message(const std::string& text);

/// Describes an exception that reached the top of the program.
hm::Error error_of(const std::exception_ptr& exception);
/// From here on an exception that leaves any thread is reported like an error of the run, with exit code 1.
void report_uncaught(const RunFacts& run);
