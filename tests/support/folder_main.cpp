// The main program of a folder's tests where they are one program: `nodes_tests media_test ...`
// runs the cases of media_test.cpp, and names a report of theirs media_test.xml.
#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>
#include <set>
#include <string>

namespace {

/// A filter that lets the cases of these files pass; empty if there are none.
std::string casesOf(const std::set<std::string>& files) {
  const auto& tests = *testing::UnitTest::GetInstance();
  std::string filter;
  for (int i = 0; i < tests.total_test_suite_count(); ++i) {
    const auto& suite = *tests.GetTestSuite(i);
    for (int k = 0; k < suite.total_test_count(); ++k) {
      const auto& test = *suite.GetTestInfo(k);
      if (files.count(std::filesystem::path(test.file()).stem()) == 0) continue;
      filter += std::string(suite.name()) + "." + test.name() + ":";
    }
  }
  return filter;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string folder = testing::GTEST_FLAG(output);  // from the environment: "xml:a/folder/"
  if (argc > 1 && argv[1][0] != '-' && !folder.empty() && folder.back() == '/') {
    testing::GTEST_FLAG(output) = folder + argv[1] + ".xml";
  }
  testing::InitGoogleTest(&argc, argv);
  if (argc > 1) {
    const std::string filter = casesOf({argv + 1, argv + argc});
    if (filter.empty()) {
      std::cerr << argv[0] << ": no cases of " << argv[1] << " in here\n";
      return 2;
    }
    testing::GTEST_FLAG(filter) = filter;
  }
  return RUN_ALL_TESTS();
}
