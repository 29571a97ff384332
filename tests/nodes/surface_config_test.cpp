#include "nodes/projector/surface_config.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <stdexcept>
#include <string>

#include "tests/support/temp_folder.hpp"

namespace afterglow::nodes::surface_config_test {
namespace {

class SurfaceConfigTest : public ::testing::Test {
 protected:
  /// One surface, on line 2.
  std::vector<SurfaceConfig> read(const std::string& table) {
    std::ofstream(path_) << "surfaces:\n  table: {" + table + "}\n";
    return readSurfaceConfigs(YamlMap(path_, loadYaml(path_), "the configuration", {"surfaces"}));
  }
  std::string fault(const std::string& table) {
    try {
      read(table);
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).substr(path_.size());
    }
    return "no fault";
  }

  test::TempFolder folder_;
  std::string path_ = folder_.path("projector.yaml");
};

TEST_F(SurfaceConfigTest, readsGivenAndFoundSurfacesAndReliefs) {
  const SurfaceConfig given = read("frame: map, polygon: [[0, 0], [1, 0], [0, 1]]")[0];
  EXPECT_EQ(given.polygon.size(), 3u);
  EXPECT_FALSE(given.isMeasured());

  const SurfaceConfig found = read(
      "frame: map, find_in: /cloud, height: [0.5, 1.0], within: [[-2, -2], [2, -2], [2, 2]],"
      " tilt_deg: 5, relief: {from: /depth, cell: 0.02, height: [-0.1, 0.3]}")[0];
  ASSERT_TRUE(found.search && found.relief && found.isMeasured());
  EXPECT_EQ(found.name, "table");
  EXPECT_EQ(found.search->topic, "/cloud");
  EXPECT_EQ(found.search->least_height, 0.5);
  EXPECT_EQ(found.search->greatest_height, 1.0);
  EXPECT_EQ(found.search->within.size(), 3u);
  EXPECT_NEAR(found.search->max_tilt, 5 * M_PI / 180, 1e-12);
  EXPECT_EQ(found.relief->topic, "/depth");
  EXPECT_EQ(found.relief->options.cell, 0.02);
  EXPECT_EQ(found.relief->options.least, -0.1);

  const SurfaceConfig plain = read("frame: map, find_in: /cloud, height: [0.5, 1.0]")[0];
  EXPECT_NEAR(plain.search->max_tilt, 10 * M_PI / 180, 1e-12);
  EXPECT_TRUE(plain.search->within.empty());
  EXPECT_FALSE(plain.relief);
  EXPECT_TRUE(read("frame: map, relief: {from: /depth}")[0].isMeasured());
}

TEST_F(SurfaceConfigTest, refusesWhatItDoesNotUnderstandAndNamesTheLine) {
  EXPECT_EQ(fault("frame: map, find_im: /cloud"),
            ":2: unknown key 'find_im' in surface 'table'; did you mean 'find_in'?");
  EXPECT_EQ(fault("frame: map, find_in: cloud, height: [0, 1]"),
            ":2: topic 'cloud' should begin with '/'");
  EXPECT_EQ(fault("frame: map, find_in: /cloud"), ":2: no 'height' in surface 'table'");
  EXPECT_EQ(fault("frame: map, find_in: /cloud, height: [1, 0.5]"),
            ":2: 'height' of surface 'table' should be [least, greatest] in meters, the first one "
            "less");
  EXPECT_EQ(fault("frame: map, find_in: /cloud, height: [0, 1], polygon: [[0, 0], [1, 0], [0, 1]]"),
            ":2: surface 'table' is either given ('polygon') or found ('find_in')");
  EXPECT_EQ(fault("frame: map, height: [0, 1]"),
            ":2: 'height' in surface 'table' has no meaning without 'find_in'");
  EXPECT_EQ(fault("frame: map, polygon: [[0, 0], [1, 0], [2, 0]]"),
            ":2: the polygon of surface 'table' has no area");
  EXPECT_EQ(fault("frame: map, relief: {form: /depth}"),
            ":2: unknown key 'form' in the relief of surface 'table'; did you mean 'from'?");
  EXPECT_EQ(fault("frame: map, relief: {from: /depth, cell: 0}").substr(0, 3), ":2:");
}

}  // namespace
}  // namespace afterglow::nodes::surface_config_test
