// SPDX-License-Identifier: BSD-3-Clause
#include "terminal/silenced_stdio.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

namespace plumbline::cli {
namespace {

void flush_all() {
  std::cout.flush();
  std::cerr.flush();
  std::fflush(nullptr);
}

void restore(int saved, int stream) {
  if (saved < 0) return;
  dup2(saved, stream);
  close(saved);
}

}  // namespace

/// Output of other libraries goes nowhere until the destructor.
SilencedStdio::SilencedStdio() {
  flush_all();
  out_ = dup(STDOUT_FILENO);
  err_ = dup(STDERR_FILENO);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere < 0) return;
  if (out_ >= 0) dup2(nowhere, STDOUT_FILENO);
  if (err_ >= 0) dup2(nowhere, STDERR_FILENO);
  close(nowhere);
}

SilencedStdio::~SilencedStdio() {
  flush_all();
  restore(out_, STDOUT_FILENO);
  restore(err_, STDERR_FILENO);
}

}  // namespace plumbline::cli
