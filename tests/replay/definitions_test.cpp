#include "replay/messages/definitions.hpp"

#include <gtest/gtest.h>

#include <filesystem>

#include "replay/messages/schema.hpp"
#include "tests/support/message_corpus.hpp"
#include "tests/support/message_definitions.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::definitions_test {
namespace {

using namespace afterglow::test;
namespace fs = std::filesystem;

TEST(Definitions, areWhatRosMakesOfEveryInstalledType) {
  const MessageCorpus corpus = makeMessageCorpus(AFTERGLOW_TEST_PYTHON);
  if (corpus.types.empty()) GTEST_SKIP() << AFTERGLOW_TEST_PYTHON " has no ROS messages";
  const DefinitionFolders installed = installedDefinitions();
  for (const auto& type : corpus.types) {
    const auto found = installed.find(type.name);
    ASSERT_TRUE(found) << type.name;
    EXPECT_EQ(found->text, type.definition) << type.name;
    EXPECT_EQ(found->md5, type.md5) << type.name;
  }
}

/// Folders with packages that are written here.
class DefinitionFoldersTest : public testing::Test {
 protected:
  void write(const std::string& path, const std::string& text) const {
    fs::create_directories(fs::path(folder_.path(path)).parent_path());
    writeFile(folder_.path(path), text);
  }
  std::optional<Definition> find(const std::string& type) const {
    return DefinitionFolders({folder_.path("first"), folder_.path("second")}).find(type);
  }

  TempFolder folder_;
};

TEST_F(DefinitionFoldersTest, areSearchedInTheirOrder) {
  write("second/a/msg/B.msg", "int8 x\n");
  EXPECT_EQ(find("a/B")->text, "int8 x\n");
  write("first/a/msg/B.msg", "int8 y\r\n");
  EXPECT_EQ(find("a/B")->text, "int8 y\n");
  EXPECT_FALSE(find("a/C"));
  EXPECT_FALSE(find("a"));
  EXPECT_FALSE(find("../first/a/B"));
  EXPECT_FALSE(find("a/../../a/msg/B"));
}

TEST_F(DefinitionFoldersTest, canBeOfADevelSpaceThatNamesTheSources) {
  write("first/a/cmake/a-msg-paths.cmake",
        "set(a_MSG_INCLUDE_DIRS \"" + folder_.path("src/a/msg") + ";/nowhere\")\n");
  write("src/a/msg/B.msg", "C c\n");
  write("first/a/msg/C.msg", "int8 x\n");
  EXPECT_EQ(find("a/B")->text, "C c\n\n" + std::string(80, '=') + "\nMSG: a/C\nint8 x\n");
}

TEST_F(DefinitionFoldersTest, nameWhatIsMissingAndDoNotFollowCircles) {
  write("first/a/msg/B.msg", "unheard_of/Type t\n");
  EXPECT_THROW(find("a/B"), MessageError);
  write("first/a/msg/B.msg", "C c\n");
  write("first/a/msg/C.msg", "B b\n");
  EXPECT_THROW(find("a/B"), MessageError);
}

TEST(DefinitionMd5, knowsTheTypesOfARobotThatDebianLacks) {
  // The shared design's table, computed from the released packages.
  EXPECT_EQ(definitionMd5("control_msgs/FollowJointTrajectoryActionGoal", kTrajectoryActionGoal),
            "cff5c1d533bf2f82dd0138d57f4304bb");
  EXPECT_EQ(definitionMd5("control_msgs/PointHeadActionGoal", kPointHeadActionGoal),
            "b53a8323d0ba7b310ba17a2d3a82a6b8");
}

TEST(DefinitionMd5, takesConstantsFirstAndStringsWithTheirComments) {
  // By genpy.
  EXPECT_EQ(definitionMd5("a/B", "int8 x  # comment\nstring S = a # b \nint8 N=3 # c\n"),
            "ec7089963900a637076f77351aeeda09");
  EXPECT_EQ(definitionMd5("std_msgs/Empty", ""), "d41d8cd98f00b204e9800998ecf8427e");
}

}  // namespace
}  // namespace afterglow::replay::definitions_test
