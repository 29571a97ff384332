#include "nodes/projector/found_surfaces.hpp"

#include <gtest/gtest.h>

#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/projector/projector_scene.hpp"
#include "render/scene/triangulate.hpp"
#include "tests/support/table_cloud.hpp"

namespace afterglow::nodes::found_surfaces_test {
namespace {

const ros::Time kNow(1000);

ProjectorConfig config() {
  ProjectorConfig config;
  config.fixed_frame = "map";
  SurfaceConfig floor, table;
  floor.name = "floor";
  floor.frame = "map";
  floor.polygon = {{-5, -5}, {5, -5}, {5, 5}, {-5, 5}};
  table.name = "table";
  table.frame = "odom";
  table.search = SurfaceSearch{"/depth", 0.5, 1.0, {}, 0.17};
  table.relief = ReliefConfig{"/depth", {}};
  config.surfaces = {floor, table};
  config.layers.resize(1);
  config.layers[0].topic = "/marker";
  config.layers[0].placement = render::Placement::Drape;
  config.layers[0].surface = 1;
  return config;
}

class FoundSurfaces : public ::testing::Test {
 protected:
  void transform(const std::string& parent, const std::string& child, const Eigen::Isometry3d& T) {
    geometry_msgs::TransformStamped message;
    message.header.frame_id = parent;
    message.child_frame_id = child;
    message.transform = toTransform(T);
    buffer_.setTransform(message, "test", true);
  }
  void allTransforms() {
    // odom stands half a meter from the map's origin.
    transform("map", "odom", Eigen::Isometry3d(Eigen::Translation3d(0.5, 0, 0)));
    transform("map", "camera", cloud_.T_map_camera);
  }
  std::vector<Finding> find(double lifted = 0) {
    SurfaceFinder finder(config_.surfaces, buffer_);
    EXPECT_EQ(finder.topics(), std::vector<std::string>{"/depth"});
    EXPECT_TRUE(finder.take("/depth", cloud_.message("camera", lifted)));
    EXPECT_TRUE(finder.topics().empty());
    return finder.find();
  }

  test::TableCloud cloud_;
  tf2::BufferCore buffer_;
  ProjectorConfig config_ = config();
};

TEST_F(FoundSurfaces, tableAndReliefAreFoundInTheirFrame) {
  allTransforms();
  const auto findings = find();
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_FALSE(findings[0].surface);
  EXPECT_EQ(findings[0].text, "");
  ASSERT_TRUE(findings[1].surface) << findings[1].text;
  const FoundSurface& table = *findings[1].surface;
  const Eigen::Vector3d middle = table.T_frame_surface.translation();
  EXPECT_LT((middle - Eigen::Vector3d(0.4, 0.1, 0.7)).norm(), 0.02) << middle.transpose();
  EXPECT_NEAR(render::signedArea(table.polygon), 0.6, 0.03);
  ASSERT_TRUE(table.relief);
  EXPECT_NEAR(*table.relief->height({0, 0}), test::TableCloud::kBox, 0.004);
  EXPECT_NEAR(*table.relief->height({0.3, 0.2}), 0, 0.004);
  EXPECT_EQ(findings[1].text.find("surface 'table': 0.99 x 0.59 m at height 0.700 m, tilted 0."),
            0u)
      << findings[1].text;
  EXPECT_NE(findings[1].text.find(" mm; relief of "), std::string::npos) << findings[1].text;
}

TEST_F(FoundSurfaces, whatIsMissingIsNamed) {
  transform("map", "odom", Eigen::Isometry3d::Identity());
  SurfaceFinder finder(config_.surfaces, buffer_);
  EXPECT_EQ(finder.find()[1].text, "surface 'table': no cloud on /depth");
  EXPECT_FALSE(finder.take("/depth", cloud_.message("camera")));
  EXPECT_EQ(finder.find()[1].text,
            "surface 'table': no transform from 'camera' to 'odom' at the time of the cloud on "
            "/depth");
  allTransforms();
  auto broken = cloud_.message("camera");
  broken.data.pop_back();
  EXPECT_TRUE(finder.take("/depth", broken));
  EXPECT_EQ(finder.find()[1].text,
            "surface 'table': the cloud on /depth cannot be read: data is shorter than declared");
  SurfaceFinder other(config_.surfaces, buffer_);
  EXPECT_TRUE(other.take("/depth", test::cloudMessage("camera", {{0, 0, 1}})));
  EXPECT_EQ(other.find()[1].text,
            "surface 'table': too few points to find a plane in: 1 a centimeter apart");
}

TEST_F(FoundSurfaces, sceneIsDarkUntilFoundAndThenFrozen) {
  allTransforms();
  ProjectorScene scene(config_, buffer_);
  std::vector<std::string> problems;
  render::Scene drawn = scene.scene(kNow, problems);
  EXPECT_TRUE(drawn.layers.empty());
  ASSERT_EQ(drawn.surfaces.size(), 1u);  // the floor, which is given
  EXPECT_EQ(problems,
            std::vector<std::string>{"surface 'table': is to be found; call find_surfaces"});

  scene.takeSurface(1, {nullptr, "surface 'table': no plane"});
  problems.clear();
  scene.scene(kNow, problems);
  EXPECT_EQ(problems, std::vector<std::string>{"surface 'table': no plane"});

  scene.takeSurface(1, find()[1]);
  problems.clear();
  drawn = scene.scene(kNow, problems);
  EXPECT_TRUE(problems.empty());
  ASSERT_EQ(drawn.layers.size(), 1u);
  ASSERT_EQ(drawn.surfaces.size(), 2u);
  const render::SurfacePatch& table = *drawn.layers[0].surface;
  EXPECT_TRUE(table.relief);
  const Eigen::Vector3d middle = table.T_world_surface * Eigen::Vector3d::Zero();
  EXPECT_LT((middle - Eigen::Vector3d(0.9, 0.1, 0.7)).norm(), 0.02);

  // A search in vain changes nothing; another one that finds it does.
  scene.takeSurface(1, {nullptr, "surface 'table': no plane"});
  EXPECT_EQ(scene.scene(kNow, problems).layers.size(), 1u);
  scene.takeSurface(1, find(0.1)[1]);
  const render::Scene lifted = scene.scene(kNow, problems);
  EXPECT_NEAR((lifted.layers[0].surface->T_world_surface * Eigen::Vector3d::Zero()).z(), 0.8,
              0.005);
}

}  // namespace
}  // namespace afterglow::nodes::found_surfaces_test
