// SPDX-License-Identifier: BSD-3-Clause
#include "bags/bag_parts.hpp"
#include "bags/part/cdr.hpp"
#include "bags/part/formats/mcap_writer.hpp"
#include "bags/part/open_bag.hpp"
#include "bags/part/ros1_messages.hpp"

PLUMBLINE_PART(plumbline::dataset::BagReaders, &plumbline::dataset::open_bag_file,
               &plumbline::dataset::cdr_decoder, &plumbline::dataset::ros1_decoder,
               &plumbline::dataset::cdr_encoder, &plumbline::dataset::create_mcap)
