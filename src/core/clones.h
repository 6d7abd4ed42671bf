// SPDX-License-Identifier: Apache-2.0
// core/clones: plain loops over columns, compiled for several instruction sets; the program chooses at start. Without fused
// multiply-add (cmake/numerics.cmake) every one of them gives the same bits.
#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define CATGUT_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define CATGUT_CLONES
#endif
