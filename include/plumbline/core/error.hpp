// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Expected failures are values: Result<T> carries an Error whose message a user can act on.
// Broken invariants throw. Libraries never exit, abort or print.
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace plumbline::core {

/// Kind of a failure; the number is the exit code of the command line.
enum class ErrorKind {
  kInternal = 1,       ///< a bug
  kUsage = 2,          ///< command line or configuration
  kInput = 3,          ///< input data missing, unreadable or unusable
  kUntrustworthy = 4,  ///< done, but the result must not be trusted as it is
  kOutput = 5,         ///< output cannot be written, or memory, files or threads are short
  kStopped = 130,  ///< stopped by the user before there was anything to write; 130, as shells say of Ctrl-C
};

struct Error {
  ErrorKind kind = ErrorKind::kInternal;
  std::string message;  ///< one line (several for configuration files): file, place, what is wrong, remedy
  bool listed = false;  ///< the message has a line for each of several problems; names in it are printable
};

template <typename T>
using Result = tl::expected<T, Error>;

inline tl::unexpected<Error> failure(ErrorKind kind, std::string message) {
  return tl::unexpected<Error>(Error{kind, std::move(message)});
}
inline tl::unexpected<Error> usage_error(std::string m) { return failure(ErrorKind::kUsage, std::move(m)); }
inline tl::unexpected<Error> input_error(std::string m) { return failure(ErrorKind::kInput, std::move(m)); }
inline tl::unexpected<Error> output_error(std::string m) { return failure(ErrorKind::kOutput, std::move(m)); }

}  // namespace plumbline::core
