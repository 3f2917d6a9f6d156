// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Bytes of rows, in the words of stores.
#include "plumbline/core/packing.hpp"

namespace plumbline::maps {

using core::BadBytes;
using core::ByteReader;
using core::Bytes;
using core::ByteWriter;
using core::decode;
using core::decode_page;
using core::encode;
using core::encoded;
using core::pack;
using core::unpack;

}  // namespace plumbline::maps
