// Light that was recorded on a robot which has moved since: world-anchored, it lands where it was.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "nodes/projector/projector_scene.hpp"
#include "tests/support/anchored_world.hpp"
#include "tests/support/gl_context.hpp"
#include "tests/support/referee.hpp"

namespace afterglow::nodes::world_anchor_gl_test {
namespace {

using test::rosBytes;
using test::rosChannel;

/// With a projector, and a judge of where its light lands.
struct WorldAnchorLightTest : test::AnchoredWorld {
  void SetUp() override {
    try {
      context = std::make_unique<render::GlContext>();
      context->makeCurrent();
    } catch (const std::runtime_error& error) {
      if (std::getenv("AFTERGLOW_REQUIRE_GL")) FAIL() << error.what();
      GTEST_SKIP() << error.what();
    }
    const std::string absence = test::refereeAbsence();
    if (!absence.empty()) GTEST_SKIP() << absence;
  }
  std::unique_ptr<render::GlContext> context;
};

TEST_F(WorldAnchorLightTest, landsWhereItWasThoughTheRobotHasMovedByHalfAMeterAndTurned) {
  test::Referee referee("standard", 2);
  // The referee's world is today's map. Its projector is on the robot, in a place of today; then
  // the robot stood 0.5 m from there, turned by 40 degrees.
  const Eigen::Isometry3d T_map_projector = referee.T_world_projector.matrix();
  const Eigen::Isometry3d T_map_base_today = planar(0.3, -0.2, 15);
  const Eigen::Isometry3d T_map_base_then = T_map_base_today * planar(0.3, 0.4, 40);
  // A spot that the projector reaches today, where its ray meets the floor.
  const Eigen::Vector3d eye = T_map_projector.translation();
  const Eigen::Vector2d pixel(0.6 * referee.lens.width, 0.6 * referee.lens.height);
  const Eigen::Vector3d way = T_map_projector * *calib::unproject(referee.lens, pixel) - eye;
  const Eigen::Vector3d spot = eye - way * (eye.z() / way.z());
  const Eigen::Vector3d p_base = T_map_base_then.inverse() * spot;

  tf2_msgs::TFMessage then;
  for (const int ms : {0, 1000, 2000}) {
    then.transforms = {stamped("map", "base_link", T_map_base_then, recordedAt(ms))};
    record(rosChannel<tf2_msgs::TFMessage>("/tf"), ms, rosBytes(then));
  }
  topics.clear();
  recordMarker(500, disk("base_link", p_base.x(), p_base.y(), recordedAt(480)));
  EXPECT_TRUE(playAnchored(1500).is_complete);

  const auto light = sent<Marker>("/marker");
  const Eigen::Isometry3d T_base_projector = T_map_base_today.inverse() * T_map_projector;
  const replay::Stamp now = toStamp(light.header.stamp);
  today.setTransform(stamped("map", "base_link", T_map_base_today, now), "robot");
  today.setTransform(
      stamped("base_link", "projector", T_base_projector, replay::Stamp::fromParts(1, 0)), "robot",
      true);
  ProjectorConfig config;
  config.fixed_frame = "map";
  config.projectors.resize(1);
  config.projectors[0].frame = "projector";
  config.layers.resize(1);
  config.layers[0].topic = "/marker";
  config.layers[0].type = LayerType::Marker;
  ProjectorScene scene(config, today);
  scene.add(0, light, light.header.stamp);
  const SceneSnapshot snapshot = scene.snapshot(light.header.stamp);
  ASSERT_TRUE(snapshot.T_projector_world);
  ASSERT_EQ(snapshot.scene.layers.at(0).drawables.size(), 1u);

  const render::Image image = render::ProjectorRenderer(*context, referee.lens)
                                  .render(snapshot.scene, *snapshot.T_projector_world);
  test::RefereeSurface floor{"floor", Eigen::Isometry3d::Identity(), 0.4, 0.4};
  floor.T_world_surface.translation() = spot;
  const cv::Mat top = referee.topView(image, {floor}, "floor");
  const cv::Moments moments = cv::moments(top);
  const double step = test::Referee::kStep;
  const Eigen::Vector2d off((moments.m10 / moments.m00 - (top.cols - 1) / 2.0) * step,
                            -(moments.m01 / moments.m00 - (top.rows - 1) / 2.0) * step);
  std::printf("world-anchored light is off by %.2f mm; %.0f mm2 are lit\n", 1e3 * off.norm(),
              1e6 * moments.m00 * step * step);
  EXPECT_LT(off.norm(), 0.002);
  EXPECT_NEAR(moments.m00 * step * step, 3.14159 * 0.03 * 0.03, 0.0003);
}

}  // namespace
}  // namespace afterglow::nodes::world_anchor_gl_test
