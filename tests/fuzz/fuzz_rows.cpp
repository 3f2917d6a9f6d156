// SPDX-License-Identifier: BSD-3-Clause
// Rows of a map as a robot sends them. Inputs hold the rows' contents unpacked, so that changes reach what
// lies inside the packing and its checksum; they are packed again on their way into a copy.
#include "fuzz_target.hpp"
#include "plumbline/maps/store.hpp"
#include "plumbline/maps/store_replica.hpp"
#include "store/store_row.hpp"

using namespace plumbline;

namespace {

maps::Bytes packed(maps::Bytes plain) {
  maps::ByteWriter rows;
  try {
    maps::consume_rows(plain, [&](const maps::StoreRow& row, std::size_t) {
      maps::StoreRow again = row;
      if (row.type == SQLITE_BLOB && !row.removed) again.data = maps::pack(row.data);
      maps::append(again, rows);
    });
  } catch (const maps::BadBytes&) {  // as far as they are rows
  }
  rows.raw(plain);
  return rows.bytes();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::InputFile file(nullptr, 0, ".db");
  static maps::StoreReplica copy = [] {
    std::filesystem::remove(file.path());
    return maps::StoreReplica::open(file.path()).value();
  }();
  const maps::StoreTransaction rows{1, packed({data, data + size})};
  fuzz::require(copy.clear().has_value(), "a copy can be emptied");
  const fuzz::MemoryWatch watch;
  core::Result<void> taken = copy.begin(maps::StoreStream::kMap, rows.number);
  if (taken) taken = copy.append(rows.rows.data(), rows.rows.size());
  if (taken) taken = copy.commit();
  if (!taken) {
    fuzz::require_message(taken.error().message, file.path().string());
    fuzz::require(taken.error().kind == core::ErrorKind::kInput, "the rows are to blame");
    fuzz::require(copy.heads().last() == 0, "nothing of what was refused is kept");
  } else if (copy.heads().last() > 0) {
    const auto stored = maps::load_map(file.path());
    maps::MapFollower follower;
    const bool followed = follower.apply(rows) && follower.map();
    // A map may be of several robots, or a file without header: then who follows has none of it or more of
    // it.
    if (stored) fuzz::require(followed, "who follows rows has the map that the copy has");
    if (!stored) fuzz::require_message(stored.error().message, file.path().string());
  }
  fuzz::check_memory(watch, size);
  return 0;
}
