// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// Connected changes. Private to the module.
#include <vector>

#include "plumbline/changes/changes.hpp"

namespace plumbline::changes {

/// Indices of places that are one piece.
using Piece = std::vector<std::uint32_t>;

/// Connected places of one kind that has changed, largest first; of what shifted, those of one direction.
/// Seams and specks that noise makes are left out, and what is smaller than the options ask.
std::vector<Piece> pieces_of(const std::vector<Place>& places, PlaceKind kind, const ChangeOptions& options);

/// A thing that went from one place to another: pieces of both, and how it went.
struct Move {
  std::vector<std::size_t> vanished, appeared;  ///< indices of pieces; one of the two may be empty
  geometry::Rigid3 after_from_before;
  double turn_rad = 0.0;
  double rms_m = 0.0;  ///< of the fit
};

/// Pieces that are the same thing before and after: turned about `up` and shifted, the surface of the one
/// lies on the other day's, and the other way round.
std::vector<Move> find_moves(const std::vector<Place>& places, const std::vector<Piece>& vanished,
                             const std::vector<Piece>& appeared, const SurfacePair& surfaces,
                             const Eigen::Vector3d& up, const core::Executor& executor);

}  // namespace plumbline::changes
