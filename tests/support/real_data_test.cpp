// The one test that says so where there are no real data; what they are.
#include "tests/support/real_data.hpp"

namespace afterglow::support::real_data_test {
namespace {

namespace fs = std::filesystem;

/// What AFTERGLOW_TEST_DATA holds.
constexpr const char* kFiles[] = {
    "fetch_clusters.pcd",  // 852 points that a Fetch segmented on a table: x y z, ASCII
    "viewsonic_pa503w_camera_info.yaml",  // the paper's projector; K and P disagree
    "turtlesim.bag",                      // 21.7 s of two turtles, 8647 messages on 9 topics
    "table_scene.pcd",  // a depth camera's view of a table, labeled: label x y z rgba, compressed
    "nasa_tags.jpg",    // a photograph full of AprilTags
    "nasa_tags_corners.txt",  // where AprilTag's own detector finds them, unrefined
};

TEST(RealData, isComplete) {
  if (test::realDataFolder().empty()) {
    GTEST_SKIP() << "AFTERGLOW_TEST_DATA names no folder of real data: all tests ran on generated";
  }
  for (const char* file : kFiles) {
    EXPECT_TRUE(fs::exists(test::realData(file))) << test::realData(file) << " is missing";
  }
}

}  // namespace
}  // namespace afterglow::support::real_data_test
