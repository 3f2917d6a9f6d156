// SPDX-License-Identifier: BSD-3-Clause
// plumbline keys create|add|revoke DIR --robots r0,r1
#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "app.hpp"
#include "plumbline/net/keys.hpp"
#include "terminal/print.hpp"

namespace plumbline::cli {
namespace {

struct KeysRequest {
  std::filesystem::path folder;
  std::vector<std::string> robots;
};
using Action = core::Result<void> (*)(const std::filesystem::path&, const std::vector<std::string>&);

/// A command that changes a folder of keys.
void add_action(CLI::App& group, Session& session, const char* name, const char* help, Action action,
                const char* then) {
  const auto request = std::make_shared<KeysRequest>();
  CLI::App* command = add_command(group, session, name, help, [&session, request, action, then] {
    const auto done = action(request->folder, request->robots);
    if (!done) return session.fail(done.error());
    if (!session.quiet) print("{}: {}\n", request->folder.string(), then);
    return 0;
  });
  command->add_option("DIR", request->folder, "Folder of the keys")->required();
  command->add_option("--robots", request->robots, "Robot names, separated by commas")
      ->required()
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("NAME,...");
}

}  // namespace

/// Commands of keys.
void add_keys(CLI::App& app, Session& session) {
  CLI::App* group = add_group(app, "keys", "Make and revoke keys for hub and robots (--security)");
  add_action(*group, session, "create", "Make an authority, and keys for a hub and robots", &net::create_keys,
             "give hub/ to the hub and each robot its own folder; keep ca/ here");
  add_action(*group, session, "add", "Make keys for more robots", &net::add_keys,
             "give each new robot its folder; the others need nothing new");
  add_action(*group, session, "revoke", "Revoke robots' keys", &net::revoke_keys,
             "give the new hub/crl.pem to the hub and restart it");
}

}  // namespace plumbline::cli
