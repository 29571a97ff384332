// The man page of `afterglow`, which the build makes of --help (nodes/verbs/man_page.py).
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "nodes/tools/program.hpp"

namespace afterglow::nodes::man_page_test {
namespace {

namespace fs = std::filesystem;

using Words = std::vector<std::string>;

/// The page as it is read: without fonts and escapes.
std::string pageText() {
  const fs::path build = fs::path(AFTERGLOW_TEST_COMMAND).parent_path().parent_path();
  std::ifstream file(build / "share/man/man1/afterglow.1");
  std::stringstream text;
  text << file.rdbuf();
  const std::string plain = std::regex_replace(text.str(), std::regex(R"(\\f[BIR])"), "");
  return std::regex_replace(plain, std::regex(R"(\\-)"), "-");
}

std::string helpOf(Words words) {
  words.insert(words.begin(), AFTERGLOW_TEST_COMMAND);
  words.push_back("--help");
  const ProgramResult result = runProgram(words);
  EXPECT_EQ(result.status, 0) << result.output;
  return result.output;
}

/// What the lines of a text that this matches begin with.
Words found(const std::string& text, const std::string& pattern) {
  const std::regex expression(pattern);
  Words words;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_search(line, match, expression)) words.push_back(match[1]);
  }
  return words;
}

Words verbsOf(const std::string& help) {
  const std::size_t place = help.find("\nSubcommands:\n");
  return place == std::string::npos ? Words() : found(help.substr(place), "^  ([a-z]+) ");
}

/// From its heading to the next one.
std::string sectionOf(const std::string& page, const std::string& heading) {
  const std::size_t begin = page.find("\n" + heading);
  if (begin == std::string::npos) return "";
  return page.substr(begin, page.find("\n.S", begin + 1) - begin);
}

/// "-r,--rate" is two of them.
void expectOptions(const std::string& help, const std::string& section) {
  for (const std::string& names : found(help, "^  (-[^ {]+)")) {
    if (names == "-h,--help") continue;  // of the command alone
    std::istringstream parts(names);
    for (std::string name; std::getline(parts, name, ',');) {
      EXPECT_TRUE(std::regex_search(section, std::regex("(\n|, )" + name + "[ ,\n]"))) << name;
    }
  }
}

void expectPage(const std::string& page, const Words& words) {
  const std::string help = helpOf(words);
  std::string typed = "afterglow";
  for (const std::string& word : words) typed += " " + word;
  if (verbsOf(help).empty()) {
    SCOPED_TRACE(typed);
    const std::string section = sectionOf(page, ".SS " + typed + " [OPTIONS]");
    ASSERT_FALSE(section.empty());
    expectOptions(help, section);
  }
  for (const std::string& verb : verbsOf(help)) {
    Words longer = words;
    longer.push_back(verb);
    expectPage(page, longer);
  }
}

TEST(ManPage, hasEveryVerbAndEveryOptionThatHelpHas) {
  const std::string page = pageText();
  ASSERT_FALSE(page.empty()) << "the target afterglow_man_page makes it";
  expectOptions(helpOf({}), sectionOf(page, ".SH OPTIONS"));
  EXPECT_EQ(verbsOf(helpOf({})).size(), 19u);
  expectPage(page, {});
}

TEST(ManPage, saysWhatAStatusMeansAndWhereFilesAre) {
  const std::string page = pageText();
  for (const char* heading : {"NAME", "SYNOPSIS", "DESCRIPTION", "EXIT STATUS", "ENVIRONMENT",
                              "FILES", "SEE ALSO"}) {
    EXPECT_FALSE(sectionOf(page, std::string(".SH ") + heading + "\n").empty()) << heading;
  }
  EXPECT_NE(page.find("\nafterglow - records what a robot does"), std::string::npos);
  EXPECT_NE(sectionOf(page, ".SH FILES").find("afterglow/afterglow.db"), std::string::npos);
}

TEST(ManPage, leavesNothingOfTheHelpsOwnNotation) {
  const std::string page = pageText();
  for (const char* leftover :
       {"REQUIRED", "Needs: ", "Excludes: ", "TEXT:", "FLOAT", "UINT", "{false}"}) {
    EXPECT_EQ(page.find(leftover), std::string::npos) << leftover;
  }
}

}  // namespace
}  // namespace afterglow::nodes::man_page_test
