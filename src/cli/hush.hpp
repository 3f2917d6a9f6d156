// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace plumbline::cli {

/// While it lives, nothing reaches stdout or stderr: for libraries that print lines of their own.
class Hush {
 public:
  Hush();
  ~Hush();
  Hush(const Hush&) = delete;
  Hush& operator=(const Hush&) = delete;

 private:
  int out_;
  int err_;
};

}  // namespace plumbline::cli
