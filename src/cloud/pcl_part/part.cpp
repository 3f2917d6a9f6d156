// SPDX-License-Identifier: BSD-3-Clause
#include <pcl/io/lzf.h>

#include "functions.hpp"

namespace pc = plumbline::cloud;

PLUMBLINE_PART(pc::PclFunctions, &pc::voxel_grid, &pc::approximate_voxel_grid, &pc::uniform_sampling,
               &pc::random_sample, &pc::crop_box, &pc::pass_through, &pc::packed_rgb_within,
               &pc::field_within, &pc::normal_estimation, &pc::plane, &pc::euclidean_clusters,
               &pc::moving_least_squares, &pc::poisson, &pcl::lzfDecompress)
