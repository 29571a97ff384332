/// \file
/// Innermost loops for more than one kind of processor.
#pragma once

/// Marks a function that is compiled for AVX2, too; which of the two runs is decided when the
/// program is loaded. Without FMA, so that both give the same picture. Sanitizers run before
/// decisions of that kind can be made.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__) && !defined(__clang__)
#define AFTERGLOW_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define AFTERGLOW_VECTOR_CLONES
#endif

/// Marks what such a function calls with vectors, which each kind of processor would pass in
/// another way.
#define AFTERGLOW_ALWAYS_INLINE inline __attribute__((always_inline))
