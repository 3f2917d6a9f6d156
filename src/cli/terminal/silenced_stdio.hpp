// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace plumbline::cli {

/// While it lives, nothing reaches stdout or stderr: for libraries that print lines of their own.
class SilencedStdio {
 public:
  SilencedStdio();
  ~SilencedStdio();
  SilencedStdio(const SilencedStdio&) = delete;
  SilencedStdio& operator=(const SilencedStdio&) = delete;

 private:
  int out_;
  int err_;
};

}  // namespace plumbline::cli
