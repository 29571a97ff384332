// What the fuzzers found, and what they began with: every target comes back from it, compiled as
// everything else is.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "tests/fuzz/target.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::fuzz::fuzz_corpus_test {
namespace {

std::vector<std::string> inputsOf(const std::string& target) {
  std::vector<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator("tests/fuzz/corpus/" + target)) {
    paths.push_back(entry.path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

TEST(FuzzCorpus, everyTargetComesBackFromItsInputs) {
  ASSERT_FALSE(targets().empty());
  for (const auto& [name, target] : targets()) {
    const std::vector<std::string> inputs = inputsOf(name);
    EXPECT_FALSE(inputs.empty()) << name;
    for (const std::string& path : inputs) {
      std::cout << path << std::endl;  // the last one named is the one that crashed
      const std::string input = test::fileBytes(path);
      target(reinterpret_cast<const std::uint8_t*>(input.data()), input.size());
    }
  }
}

}  // namespace
}  // namespace afterglow::fuzz::fuzz_corpus_test
