// SPDX-License-Identifier: BSD-3-Clause
#include "bag_part/cdr.hpp"
#include "bag_part/mcap_writer.hpp"
#include "bag_part/open_bag.hpp"
#include "bag_part/ros1_messages.hpp"
#include "bags/bag_parts.hpp"

PLUMBLINE_PART(plumbline::dataset::BagReaders, &plumbline::dataset::open_bag_file,
               &plumbline::dataset::cdr_decoder, &plumbline::dataset::ros1_decoder,
               &plumbline::dataset::cdr_encoder, &plumbline::dataset::create_mcap)
