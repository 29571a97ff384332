// The robot as a bystander and as its own projector sees it. With AFTERGLOW_TEST_PICTURES naming a
// folder the pictures are kept there.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "nodes/fetch/fetch_facts.hpp"
#include "render/gl/observer_renderer.hpp"
#include "tests/support/fetch_poses.hpp"
#include "tests/support/gl_context.hpp"

namespace afterglow::nodes::robot_view_gl_test {
namespace {

using render::Drawable;
using render::ObserverView;

const RobotModel& fetch() {
  static const RobotModel model = RobotModel::fromFile("assets/fetch.urdf");
  return model;
}

Drawable box(const Eigen::Vector3d& center, const Eigen::Vector3f& size, render::Color color) {
  return {Rigid<World, World>(Eigen::Isometry3d(Eigen::Translation3d(center))), render::Cube{size},
          color};
}

/// An eye at `from` that looks along `direction`, upright.
Rigid<World, Observer> looking(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d z = direction.normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << x, z.cross(x), z;
  T.translation() = from;
  return Rigid<World, Observer>(T);
}

std::vector<Drawable> robot(const JointPositions& positions) {
  return fetch().drawables(test::linkPoses(fetch(), positions));
}

void keepPicture(const render::Image& image, const std::string& name) {
  const char* folder = std::getenv("AFTERGLOW_TEST_PICTURES");
  if (folder == nullptr) return;
  cv::Mat rgb(image.height, image.width, CV_8UC3);
  std::copy(image.rgb.begin(), image.rgb.end(), rgb.data);
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  cv::imwrite(std::string(folder) + "/" + name + ".png", bgr);
}

const Eigen::Vector3d kThroughCenter(-0.5 / 1900, (399.5 - 817) / 1900, 1);  // ViewSonic PA503W

JointPositions aimedAt(JointPositions positions, const Eigen::Vector3d& p_base) {
  const auto angles = fetch().aim(kProjectorTurret, kThroughCenter, p_base, positions);
  EXPECT_TRUE(angles);
  for (const auto& [name, position] : *angles) positions[name] = position;
  return positions;
}

/// How many pixels the robot covers of its own projector's picture (one in sixteen are looked at).
int pixelsInItsLight(render::GlContext& context, const JointPositions& positions) {
  const Eigen::Isometry3d T = fetch().linkPose(kProjectorTurret.frame, positions);
  ObserverView view;
  view.width = 320, view.height = 200;
  view.vertical_fov = 2 * std::atan(400.0 / 1900) * 1.05;
  view.T_world_observer = looking(T.translation(), T.linear() * kThroughCenter);
  render::ObserverRenderer renderer(context);
  // Its own lens is in its eye.
  std::vector<Drawable> solids;
  const LinkPoses poses = test::linkPoses(fetch(), positions);
  for (const LinkVisual& visual : fetch().visuals())
    if (visual.link != "projector_link")
      solids.push_back({Rigid<World, World>(poses.at(visual.link) * visual.T_link_shape),
                        visual.shape, visual.color});
  const render::Image with = renderer.render(solids, nullptr, view);
  const render::Image without = renderer.render({}, nullptr, view);
  int covered = 0;
  for (std::size_t i = 0; i < with.rgb.size(); i += 3)
    covered += !std::equal(&with.rgb[i], &with.rgb[i] + 3, &without.rgb[i]);
  return covered;
}

using RobotView = test::GlTest;

TEST_F(RobotView, keepsItsHeadAndMastOutOfItsLight) {
  for (const double lift : {0.0, 0.15, 0.38})
    for (const Eigen::Vector3d& target :
         {Eigen::Vector3d(0.85, 0, 0.72), Eigen::Vector3d(0.85, 0.25, 0.72),
          Eigen::Vector3d(0.85, -0.25, 0.72), Eigen::Vector3d(1.2, 0, 0),
          Eigen::Vector3d(1.8, 0.5, 0), Eigen::Vector3d(1.8, -0.5, 0)}) {
      JointPositions positions = tuckedArm();
      positions["torso_lift_joint"] = lift;
      EXPECT_EQ(pixelsInItsLight(context(), aimedAt(positions, target)), 0)
          << "torso at " << lift << ", aimed at " << target.transpose();
    }
}

TEST_F(RobotView, showsARobotInItsColors) {
  render::ObserverRenderer renderer(context());
  std::vector<Drawable> room = {box({0, 0, -0.01}, {8, 8, 0.02f}, {0.75f, 0.73f, 0.70f}),
                                box({0.95, 0, 0.70}, {0.7f, 1.2f, 0.04f}, {0.72f, 0.58f, 0.42f})};
  const auto picture = [&](const JointPositions& positions, const Eigen::Vector3d& from,
                           const Eigen::Vector3d& to, const std::string& name) {
    std::vector<Drawable> solids = robot(aimedAt(positions, {0.85, 0, 0.72}));
    solids.insert(solids.end(), room.begin(), room.end());
    ObserverView view;
    view.vertical_fov = 0.8;
    view.T_world_observer = looking(from, to - from);
    render::Image image = renderer.render(solids, nullptr, view);
    keepPicture(image, name);
    return image;
  };
  picture(test::armOverTable(), {2.6, -1.6, 1.7}, {0.3, 0, 0.75}, "arm_over_table");
  picture(test::armOverTable(), {0.6, 2.8, 1.4}, {0.4, 0, 0.75}, "arm_from_left");
  room.pop_back();
  picture(tuckedArm(), {1.8, -1.8, 1.4}, {0, 0, 0.65}, "tucked_right");
  picture(tuckedArm(), {2.2, 1.3, 1.5}, {0, 0, 0.65}, "tucked_left");
  picture(tuckedArm(), {-2.0, -1.2, 1.6}, {0, 0, 0.65}, "tucked_back");
  const render::Image image = picture(tuckedArm(), {2.5, 0, 1.1}, {0, 0, 0.65}, "tucked_front");
  int blue = 0;
  for (std::size_t i = 0; i < image.rgb.size(); i += 3)
    blue += image.rgb[i + 2] > 30 && image.rgb[i + 2] > 2 * image.rgb[i];
  EXPECT_GT(blue, 1000);
}

}  // namespace
}  // namespace afterglow::nodes::robot_view_gl_test
