// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace plumbline::core {

/// Empties a container and frees its memory, which a vector keeps when {} is assigned to it or clear() is
/// called.
template <typename Container>
void release(Container& container) {
  Container().swap(container);
}

}  // namespace plumbline::core
