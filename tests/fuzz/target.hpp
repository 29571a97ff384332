/// \file
/// A fuzz target takes any bytes and must come back from them: no crash, no hang, no more memory
/// than the bytes pay for. In a fuzzer libFuzzer calls it; in fuzz_corpus_test, which the ordinary
/// compiler builds, each target gets the inputs of tests/fuzz/corpus/NAME.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

namespace afterglow::fuzz {

using Target = void (*)(const std::uint8_t* data, std::size_t size);

/// The targets of this program, by name.
inline std::map<std::string, Target>& targets() {
  static std::map<std::string, Target> all;
  return all;
}

}  // namespace afterglow::fuzz

/// AFTERGLOW_FUZZ_TARGET(name) { ... data, size ... }
#ifdef AFTERGLOW_FUZZER
#define AFTERGLOW_FUZZ_TARGET(name)                                                   \
  static void name(const std::uint8_t* data, std::size_t size);                       \
  extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) { \
    name(data, size);                                                                 \
    return 0;                                                                         \
  }                                                                                   \
  static void name(const std::uint8_t* data, std::size_t size)
#else
#define AFTERGLOW_FUZZ_TARGET(name)                                                        \
  static void name(const std::uint8_t* data, std::size_t size);                            \
  static const bool name##_is_known = afterglow::fuzz::targets().emplace(#name, name).second; \
  static void name(const std::uint8_t* data, std::size_t size)
#endif
