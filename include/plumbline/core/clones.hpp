// SPDX-License-Identifier: BSD-3-Clause
#pragma once

// PLUMBLINE_CLONES compiles a function twice, for AVX2 and for any x86-64; the version is chosen when the
// program starts. Both give the same bits, because AVX2 does not include fused multiply-add.
#if defined(__x86_64__)
#define PLUMBLINE_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define PLUMBLINE_CLONES
#endif
