/// \file
/// Innermost loops for more than one kind of processor.
#pragma once

#include <cstdint>
#include <utility>

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
/// The same of a lambda, or of a template, which has to say so where it is declared.
#define AFTERGLOW_INLINED __attribute__((always_inline))

namespace afterglow::render {

#if defined(__x86_64__)
#define AFTERGLOW_AVX2 __attribute__((target("avx2")))
inline bool hasAvx2() { return __builtin_cpu_supports("avx2"); }
#else
#define AFTERGLOW_AVX2
constexpr bool hasAvx2() { return false; }
#endif

/// Counts the lanes that work() is to fill: eight of 32 bits with AVX2, else four.
template <int kCount>
using Lanes = std::make_integer_sequence<int, kCount>;

template <typename Work>
AFTERGLOW_AVX2 auto withEightLanes(const Work& work) {
  return work(Lanes<8>{});
}
/// Calls work(lanes), a lambda that is AFTERGLOW_INLINED. To write vectors for either is needed
/// where they are compared, chosen or shuffled: what the compiler takes apart for clones is slow.
template <typename Work>
auto withLanes(bool are_eight, const Work& work) {
  return are_eight ? withEightLanes(work) : work(Lanes<4>{});
}

/// Takes lanes of `a` and, from its number of lanes on, of `b`; each has 32 bits. GCC before 12 has
/// a way of its own alone.
template <int... kLanes, typename Vector>
AFTERGLOW_ALWAYS_INLINE void shuffle(const Vector& a, const Vector& b, Vector& out) {
#if defined(__clang__) || __GNUC__ >= 12
  out = __builtin_shufflevector(a, b, kLanes...);
#else
  typedef std::int32_t Numbers __attribute__((vector_size(sizeof(Vector))));
  out = __builtin_shuffle(a, b, Numbers{kLanes...});
#endif
}

}  // namespace afterglow::render
