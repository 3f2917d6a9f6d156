// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// A copy of a growing map store on another machine. Transactions of a store are numbered from 1 on; every row
// knows the one that last wrote it, and a row that was removed leaves a note with the number. So a copy that
// has all rows up to a number asks for those above, whatever it missed, and holds the same rows as the store
// in the end (docs/reference/store.md, docs/method/network.md).
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "plumbline/core/error.hpp"
#include "plumbline/maps/store.hpp"

namespace plumbline::maps {

/// Clouds are most of the bytes and may come later than the rest; each share is copied in its own order.
enum class StoreShare : std::uint8_t { kMap, kClouds };
constexpr StoreShare kStoreShares[] = {StoreShare::kMap, StoreShare::kClouds};

/// Numbers of the last transactions that touched each share; 0: none did.
struct StoreHeads {
  std::int64_t map = 0;
  std::int64_t clouds = 0;
  std::int64_t& operator[](StoreShare share) { return share == StoreShare::kMap ? map : clouds; }
  std::int64_t operator[](StoreShare share) const { return share == StoreShare::kMap ? map : clouds; }
  [[nodiscard]] std::int64_t last() const { return std::max(map, clouds); }
};

/// Rows that a transaction wrote and no later one wrote again, as bytes for StoreReplica::take.
struct StoreTransaction {
  std::int64_t number = 0;
  std::vector<std::uint8_t> rows;
  template <typename Io>
  friend void fields(Io& io, StoreTransaction& transaction) {
    io(transaction.number, transaction.rows);
  }
};

/// What a store holds at this moment, while it may be written; opens and closes the file. Errors (kInput) as
/// StoreReader::open.
core::Result<StoreHeads> store_heads(const std::filesystem::path& file);
/// The first transaction above `after` that left rows in `share`: keyframes before landmarks, surfaces before
/// clouds. None: `after` is all there is. Errors as store_heads.
core::Result<std::optional<StoreTransaction>> next_transaction(const std::filesystem::path& file,
                                                               StoreShare share, std::int64_t after);

/// Bytes that were taken, by what they are for.
struct ReplicaBytes {
  std::uint64_t place = 0;  ///< keyframes with features and poses: what recognises places
  std::uint64_t map = 0;    ///< landmarks, edges, frames and everything else
  std::uint64_t cloud = 0;  ///< clouds and their surfaces
};

/// The copy. Rows come from others and are looked at before they are stored: known tables, keys in range,
/// bytes that unpack to no more than their kind can need and that decode, finite numbers. One writer; not
/// thread-safe.
class StoreReplica {
 public:
  /// Goes on in the copy that is there, or makes an empty one. What was not committed is forgotten. Errors
  /// (kOutput): cannot be made; (kInput): it is no copy.
  static core::Result<StoreReplica> open(const std::filesystem::path& file);
  StoreReplica(StoreReplica&& other) noexcept;
  StoreReplica& operator=(StoreReplica&& other) noexcept;
  /// Leaves one file.
  ~StoreReplica();

  /// Up to where the copy is the store's.
  [[nodiscard]] const StoreHeads& heads() const;
  /// Keyframes in it.
  [[nodiscard]] std::size_t keyframes() const;
  /// Whether the run came to its end (StoredMap::complete); true only for the last transaction's.
  [[nodiscard]] bool complete() const;

  /// Begins to take transaction `number`, which must be above heads()[share]; what was begun before and not
  /// committed is forgotten.
  core::Result<void> begin(StoreShare share, std::int64_t number);
  /// Its bytes, in parts of any size. An error ends the transaction: (kInput) they are not what a store
  /// sends, (kOutput) they cannot be written.
  core::Result<void> take(const std::uint8_t* bytes, std::size_t size);
  /// All bytes were taken; from now on they are kept whatever happens. Errors as take().
  core::Result<void> commit();
  /// Forgets what was begun.
  void forget();
  /// Everything goes.
  core::Result<void> clear();
  [[nodiscard]] const ReplicaBytes& bytes() const;  ///< since open(), of committed transactions

 private:
  struct Impl;
  explicit StoreReplica(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The map in a store of one robot as it grows: what was taken once stays decoded.
class MapFollower {
 public:
  MapFollower();
  MapFollower(MapFollower&& other) noexcept;
  MapFollower& operator=(MapFollower&& other) noexcept;
  ~MapFollower();
  /// The next one, of the share kMap. Errors (kInput): it is not what a store sends.
  core::Result<void> take(const StoreTransaction& transaction);
  [[nodiscard]] std::int64_t head() const;  ///< number of the last one
  /// With the robots' cameras as header. Errors (kInput): rows that belong together are not all here yet, or
  /// are of several robots whose maps are not one.
  [[nodiscard]] core::Result<StoredMap> map() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A few texts by name in a file of their own, which survive the process and a power cut: who is who on the
/// network. The file is open only while a call lasts, so that its folder may be renamed between calls.
class Ledger {
 public:
  explicit Ledger(std::filesystem::path file) : file_(std::move(file)) {}
  /// Several at once: all or none. Makes the file when it is not there. Errors (kOutput): disk full, I/O.
  [[nodiscard]] core::Result<void> put(const std::map<std::string, std::string>& texts) const;
  /// All of them by name; none when the file is not there. Errors (kInput): damaged.
  [[nodiscard]] core::Result<std::map<std::string, std::string>> all() const;

 private:
  std::filesystem::path file_;
};

}  // namespace plumbline::maps
