// SPDX-License-Identifier: BSD-3-Clause
#include "terminal/signals.hpp"

#include <unistd.h>

#include <csignal>
#include <cstring>

namespace plumbline::cli {
namespace {

// A signal handler can only reach static objects.
const core::StopToken* stop_token = nullptr;

/// The first signal asks to stop, the second ends the program.
void on_signal(int signal) {
  if (stop_token->stop_requested()) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
    return;
  }
  stop_token->request_stop();
  const char* const text =
      "\nplumbline: stopping; what is done so far will be written (once more: give up without writing)\n";
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text, std::strlen(text));
}

}  // namespace

const core::StopToken& stop_on_signals() {
  static const core::StopToken stop;
  stop_token = &stop;
  struct sigaction action = {};
  action.sa_handler = on_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);

  // The terminal was closed; nohup has the program ignore that.
  struct sigaction before = {};
  sigaction(SIGHUP, nullptr, &before);
  if (before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
  return stop;
}

void ignore_write_signals() {
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
}

}  // namespace plumbline::cli
