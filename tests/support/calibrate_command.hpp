/// \file
/// `afterglow calibrate` as a user meets it, in a folder of its own. The test's target defines
/// AFTERGLOW_TEST_COMMAND.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "nodes/tools/program.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

class CalibrateCommand : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_.path(name); }
  void write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories(std::filesystem::path(path(name)).parent_path());
    std::ofstream(path(name)) << text;
  }
  nodes::ProgramResult calibrate(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), {AFTERGLOW_TEST_COMMAND, "calibrate"});
    return nodes::runProgram(arguments);
  }
  /// Status 2.
  void expectWrongUsage(const std::vector<std::string>& arguments) const {
    const nodes::ProgramResult result = calibrate(arguments);
    EXPECT_EQ(result.status, 2) << result.output;
  }
  /// Status 1 and one line that holds this.
  void expectRefused(const std::vector<std::string>& arguments, const std::string& text) const {
    const nodes::ProgramResult result = calibrate(arguments);
    EXPECT_EQ(result.status, 1) << result.output;
    EXPECT_NE(result.output.find(text), std::string::npos) << result.output;
    EXPECT_EQ(result.output.find('\n'), result.output.size() - 1) << result.output;
  }
  TempFolder folder_;
};

}  // namespace afterglow::test
