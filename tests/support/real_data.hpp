/// \file
/// Data of real robots and cameras are not ours to pass on. A test on them looks in the folder that
/// the environment variable AFTERGLOW_TEST_DATA names, and asserts the same of data that it
/// generates, always: TEST_P, instantiated with sources().
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

namespace afterglow::test {

enum class Source { Generated, Real };

/// Empty if there are no real data.
inline std::string realDataFolder() {
  const char* folder = std::getenv("AFTERGLOW_TEST_DATA");
  return folder ? folder : "";
}

/// The path of a file of real data; RealData.isComplete says which there are.
inline std::string realData(const std::string& file) {
  return (std::filesystem::path(realDataFolder()) / file).string();
}

/// What a test runs on. Without real data nothing of theirs is registered, and so nothing skipped.
inline auto sources() {
  std::vector<Source> all = {Source::Generated};
  if (!realDataFolder().empty()) all.push_back(Source::Real);
  return testing::ValuesIn(all);
}

inline std::string sourceName(const testing::TestParamInfo<Source>& info) {
  return info.param == Source::Real ? "Real" : "Generated";
}

}  // namespace afterglow::test
