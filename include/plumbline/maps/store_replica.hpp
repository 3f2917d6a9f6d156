// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A copy of a growing map store on another machine. Transactions of a store are numbered from 1 on; every row
// carries the number of the one that last wrote it, and a removed row leaves a tombstone with that number. So
// a copy that has all rows up to a number requests those above, and finally holds the same rows as the store
// (docs/reference/store.md, docs/method/network.md).
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::maps {

/// Clouds are most of the bytes and may follow later; each stream is copied in its own order.
enum class StoreStream : std::uint8_t { kMap, kClouds };
constexpr StoreStream kStoreStreams[] = {StoreStream::kMap, StoreStream::kClouds};

/// Number of the last transaction that changed each stream; 0: none did.
struct StoreHeads {
  std::int64_t map = 0;
  std::int64_t clouds = 0;
  std::int64_t& operator[](StoreStream stream) { return stream == StoreStream::kMap ? map : clouds; }
  std::int64_t operator[](StoreStream stream) const { return stream == StoreStream::kMap ? map : clouds; }
  [[nodiscard]] std::int64_t last() const { return std::max(map, clouds); }
};

/// Rows that a transaction wrote and no later one wrote again, as bytes for StoreReplica::append.
struct StoreTransaction {
  std::int64_t number = 0;
  std::vector<std::uint8_t> rows;
  template <typename Io>
  friend void fields(Io& io, StoreTransaction& transaction) {
    io(transaction.number, transaction.rows);
  }
};

/// Heads of a store at this moment; it may be written meanwhile. Opens and closes the file. Errors (kInput):
/// as StoreReader::open.
core::Result<StoreHeads> store_heads(const std::filesystem::path& file);
/// The first transaction above `after` that left rows in `stream`: keyframes before landmarks, surfaces
/// before clouds. None: `after` is all there is. Errors as store_heads.
core::Result<std::optional<StoreTransaction>> next_transaction(const std::filesystem::path& file,
                                                               StoreStream stream, std::int64_t after);

/// Received bytes by purpose.
struct ReplicaBytes {
  std::uint64_t place = 0;  ///< keyframes with features and poses, for recognising places
  std::uint64_t map = 0;    ///< landmarks, edges, frames and everything else
  std::uint64_t cloud = 0;  ///< clouds and their surfaces
};

struct GrowingMap;  // rows of a map, decoded

/// The map of one robot as its store grows; each row is decoded once.
class MapFollower {
 public:
  MapFollower();
  /// Applies the next transaction of the stream kMap. Errors (kInput): a store does not send such bytes.
  core::Result<void> apply(const StoreTransaction& transaction);
  [[nodiscard]] std::int64_t head() const;  ///< number of the last transaction applied
  /// With the robots' cameras as header. `number`: that the robot gets in map and frames, if it is the only
  /// one. Errors (kInput): rows that belong together are not all here yet, or are of several robots whose
  /// maps are not one, or with a `number`.
  [[nodiscard]] core::Result<StoredMap> map(std::optional<std::int32_t> number = {}) const;

 private:
  friend class StoreReplica;
  explicit MapFollower(std::shared_ptr<GrowingMap> map) : map_(std::move(map)) {}
  std::shared_ptr<GrowingMap> map_;  ///< copied before it changes, while others hold it
};

/// The copy. Rows come from others and are checked before they are stored: known tables, keys in range, bytes
/// that decode and unpack to no more than their kind can need, finite numbers. One writer; not thread-safe.
class StoreReplica {
 public:
  /// Continues an existing copy, or makes an empty one. What was not committed is lost. Errors (kOutput): it
  /// cannot be made; (kInput): the file is not a copy.
  static core::Result<StoreReplica> open(const std::filesystem::path& file);
  StoreReplica(StoreReplica&& other) noexcept;
  StoreReplica& operator=(StoreReplica&& other) noexcept;
  /// Closes the copy as a single file.
  ~StoreReplica();

  /// The copy equals the store up to these transactions.
  [[nodiscard]] const StoreHeads& heads() const;
  /// Number of keyframes in it.
  [[nodiscard]] std::size_t keyframes() const;
  /// The map that it holds now, decoded as its rows came. It stays as it is, so that other threads may make
  /// maps of it. Rows in the file that cannot be decoded are an error of its map().
  [[nodiscard]] MapFollower map() const;
  /// True if the run came to its end (StoredMap::complete); true only with the last transaction.
  [[nodiscard]] bool complete() const;

  /// Begins transaction `number`, which must be above heads()[stream]; one that was not committed is rolled
  /// back.
  core::Result<void> begin(StoreStream stream, std::int64_t number);
  /// Appends its bytes, in parts of any size. An error ends the transaction: (kInput) a store does not send
  /// such bytes, (kOutput) they cannot be written.
  core::Result<void> append(const std::uint8_t* bytes, std::size_t size);
  /// Commits after the last byte; from then on the rows survive a power cut. Errors as append().
  core::Result<void> commit();
  /// Drops the transaction that was begun.
  void roll_back();
  /// Removes all rows.
  core::Result<void> clear();
  [[nodiscard]] const ReplicaBytes& bytes() const;  ///< since open(), of committed transactions

 private:
  struct Impl;
  explicit StoreReplica(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A few named texts in their own file, which survive the process and a power cut: identities on the network.
/// The file is open only during a call, so that its folder may be renamed between calls.
class Ledger {
 public:
  explicit Ledger(std::filesystem::path file) : file_(std::move(file)) {}
  /// Stores several texts, all or none. Makes the file if it does not exist. Errors (kOutput): disk full,
  /// I/O.
  [[nodiscard]] core::Result<void> put(const std::map<std::string, std::string>& texts) const;
  /// All texts by name; none if the file does not exist. Errors (kInput): it is damaged.
  [[nodiscard]] core::Result<std::map<std::string, std::string>> all() const;

 private:
  std::filesystem::path file_;
};

}  // namespace plumbline::maps
