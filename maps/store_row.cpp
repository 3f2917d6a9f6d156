// SPDX-License-Identifier: BSD-3-Clause
#include "store_row.hpp"

#include <iterator>

namespace plumbline::maps {
namespace {

constexpr std::uint8_t kRemoved = 0x80;

}  // namespace

void append(const StoreRow& row, ByteWriter& to) {
  ByteWriter bytes;
  bytes.put(static_cast<std::uint8_t>(row.name.place | (row.removed ? kRemoved : 0)));
  if (kRowTables[row.name.place].named) {
    bytes.put(std::string_view(row.name.key));
  } else {
    bytes.put(row.name.robot);
    bytes.put(row.name.number);
  }
  if (!row.removed) {
    bytes.put(static_cast<std::uint8_t>(row.type));
    if (row.type == SQLITE_INTEGER) bytes.put(row.integer);
    if (row.type == SQLITE_TEXT) bytes.put(std::string_view(row.text));
    if (row.type == SQLITE_BLOB) bytes.raw(row.data);
  }
  to.put(static_cast<std::uint32_t>(bytes.bytes().size()));
  to.raw(bytes.bytes());
}

StoreRow parse_row(const Bytes& bytes) {
  ByteReader from(bytes);
  StoreRow row;
  const auto head = from.get<std::uint8_t>();
  row.removed = (head & kRemoved) != 0;
  row.name.place = head & ~std::size_t{kRemoved};
  if (row.name.place >= std::size(kRowTables)) throw BadBytes("there is no such table");
  if (kRowTables[row.name.place].named) {
    from.get(row.name.key);
  } else {
    from.get(row.name.robot);
    from.get(row.name.number);
  }
  if (!row.removed) {
    row.type = from.get<std::uint8_t>();
    if (row.type == SQLITE_INTEGER) {
      from.get(row.integer);
    } else if (row.type == SQLITE_TEXT) {
      from.get(row.text);
    } else if (row.type == SQLITE_BLOB) {
      row.data = from.rest();
    } else {
      throw BadBytes("its content has no known type");
    }
  }
  from.expect_end();
  return row;
}

}  // namespace plumbline::maps
