// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A map in the browser while it grows: reads the stores of a run like any other reader, so that the run never
// waits for it.
#include <filesystem>
#include <memory>
#include <string>

#include "plumbline/geometry/rigid3.hpp"
#include "plumbline/net/page_server.hpp"

namespace plumbline::net {

/// Serves a page and feeds it from every map.db in a folder, beside the run that writes them. Between two
/// looks it sleeps ten times the processor time that a look took, a second at least.
class LiveMap {
 public:
  /// `output`: OUT of the run; OUT.partial is followed while it is there. Errors as PageServer::start.
  static core::Result<std::unique_ptr<LiveMap>> start(const PageServerOptions& options,
                                                      const std::filesystem::path& output);
  ~LiveMap();  ///< tells the page that the run has ended

  [[nodiscard]] std::string address() const;
  /// Shows one line of text under the map. Thread-safe.
  void tell(const std::string& words);
  /// The pose of a robot's map in the frame that it shares with others: of the store robots/NAME/map.db.
  /// Thread-safe.
  void place(const std::string& robot, const geometry::Rigid3& shared_from_robot);

 private:
  struct Impl;
  LiveMap();
  std::unique_ptr<Impl> impl_;
};

}  // namespace plumbline::net
