// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Messages of ROS 2 as bytes (CDR), read and written by CycloneDDS's streams, which accept untrusted bytes.
// Types are those of ros.idl.
#include "bags/messages.hpp"

namespace plumbline::dataset {

/// Reads CDR and XCDR2 of either byte order, which the 4 bytes in front name.
const MessageDecoder& cdr_decoder();

/// The same messages as CDR, little endian, with the 4 bytes in front.
Bytes encode_cdr(const ImageMessage& message);
Bytes encode_cdr(const CompressedImageMessage& message);
Bytes encode_cdr(const CameraInfoMessage& message);
/// tf2_msgs/TFMessage with all transforms at `stamp_ns`.
Bytes encode_cdr(const std::vector<TransformMessage>& transforms, std::int64_t stamp_ns);
Bytes encode_cdr(const PathMessage& message);
Bytes encode_cdr(const CloudMessage& message);
const MessageEncoder& cdr_encoder();

}  // namespace plumbline::dataset
