#include "nodes/kitting/kitting_plan.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::kitting_plan_test {
namespace {

/// A copy of a demo file with one passage replaced.
class Edited {
 public:
  Edited(const std::string& path, const std::string& old_text, const std::string& new_text)
      : path_(testing::TempDir() + "kitting_plan_test.yaml") {
    std::string text = test::fileBytes(path);
    text.replace(text.find(old_text), old_text.size(), new_text);
    std::ofstream(path_) << text;
  }
  ~Edited() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

template <typename Load>
std::string complaint(Load load, const std::string& path) {
  try {
    load(path);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no complaint";
}

TEST(KittingPlan, demoFilesLoad) {
  const KittingPlan plan = loadKittingPlan("assets/demo/task.yaml");
  EXPECT_EQ(plan.pick.says, "Ok. I picked up a gearbox bottom from here.");
  EXPECT_NEAR(plan.drive.aim_widest, 0.61, 0.01);  // degrees in the file
  EXPECT_EQ(loadRoom("assets/demo/room.yaml").thing("wood_chip").parts.size(), 2u);
}

TEST(KittingPlan, namesFileLineAndKeyOfAnError) {
  const Edited typo("assets/demo/task.yaml", "clearance:", "clearence:");
  const std::string text = complaint(loadKittingPlan, typo.path());
  EXPECT_NE(text.find(typo.path() + ":"), std::string::npos) << text;
  EXPECT_NE(text.find("'clearence'"), std::string::npos) << text;
  const Edited missing("assets/demo/task.yaml", "  turn_speed:", "  # turn_speed:");
  EXPECT_NE(complaint(loadKittingPlan, missing.path()).find("'turn_speed'"), std::string::npos);
  const Edited color("assets/demo/room.yaml", "\"#b5803f\"", "brown");
  EXPECT_NE(complaint(loadRoom, color.path()).find("brown"), std::string::npos);
  EXPECT_NE(complaint(loadRoom, "nowhere.yaml").find("nowhere.yaml"), std::string::npos);
}

TEST(KittingPlan, recordsThePapersTopics) { EXPECT_EQ(kittingTopics().size(), 13u); }

}  // namespace
}  // namespace afterglow::nodes::kitting_plan_test
