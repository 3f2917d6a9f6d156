// SPDX-License-Identifier: BSD-3-Clause
#include "store/store_row.hpp"

#include <iterator>

namespace plumbline::maps {
namespace {

template <typename Io>
void row_fields(Io& io, StoreRow& row) {
  // Table and removal share a byte
  constexpr std::uint8_t kRemoved = 0x80;
  auto head = static_cast<std::uint8_t>(row.name.table | (row.removed ? kRemoved : 0));
  io(head);
  if constexpr (Io::kReads) {
    row.removed = (head & kRemoved) != 0;
    row.name.table = head & ~std::size_t{kRemoved};
  }

  // Named rows have a text key, others two numbers
  io.check(row.name.table < std::size(kRowTables), "there is no such table");
  if (kRowTables[row.name.table].named) {
    io(row.name.key);
  } else {
    io(row.name.robot, row.name.number);
  }
  if (row.removed) return;

  // Type and content; a removed row has none
  auto type = static_cast<std::uint8_t>(row.type);
  io(type);
  row.type = type;

  // Only bytes may be long
  if (type == SQLITE_INTEGER) {
    io(row.integer);
  } else if (type == SQLITE_TEXT) {
    io(row.text);
  } else {
    io.check(type == SQLITE_BLOB, "its content has no known type");
    io.rest(row.data);
  }
}

}  // namespace

void append(StoreRow row, ByteWriter& to) {
  ByteWriter bytes;
  row_fields(bytes, row);
  to.number(static_cast<std::uint32_t>(bytes.bytes().size()));
  to.raw(bytes.bytes());
}

void consume_rows(Bytes& bytes, const std::function<void(const StoreRow&, std::size_t)>& row) {
  // Each row begins with its length
  constexpr std::size_t kLength = sizeof(std::uint32_t);  // in front of each
  const auto at = [&](std::size_t offset) { return bytes.begin() + static_cast<std::ptrdiff_t>(offset); };
  std::size_t done = 0;
  while (bytes.size() - done >= kLength) {
    const auto length = decode<std::uint32_t>(Bytes(at(done), at(done + kLength)));

    // The limit guards against damaged lengths
    if (length > kMostRowBytes) throw BadBytes("a row is too large");
    const std::size_t end = done + kLength + length;
    if (bytes.size() < end) break;

    // The row without its length
    const Bytes content(at(done + kLength), at(end));
    ByteReader from(content);
    StoreRow next;
    row_fields(from, next);
    from.expect_end();
    row(next, end - done);
    done = end;
  }

  // The next chunk continues the incomplete row
  bytes.erase(bytes.begin(), at(done));
}

}  // namespace plumbline::maps
