// static_transform_node x y z qx qy qz qw parent child: sends one static transform until it is
// stopped, for machines whose tf2_ros comes without a static_transform_publisher (Debian 12).
#include <geometry_msgs/TransformStamped.h>
#include <tf2_ros/static_transform_broadcaster.h>

#include <optional>
#include <string>
#include <vector>

#include "calib/mount/mount.hpp"
#include "calib/number_text.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/tools/mount_poses.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace {

constexpr char kUsage[] = "expected: x y z qx qy qz qw parent_frame child_frame";

geometry_msgs::TransformStamped readTransform(const std::vector<std::string>& arguments) {
  if (arguments.size() != 9) throw std::invalid_argument(kUsage);
  std::vector<double> numbers;
  for (std::size_t i = 0; i < 7; ++i) {
    const std::optional<double> number = afterglow::calib::numberFromText(arguments[i]);
    if (!number) throw std::invalid_argument("'" + arguments[i] + "' is no number; " + kUsage);
    numbers.push_back(*number);
  }
  for (std::size_t i = 7; i < 9; ++i) {
    if (!afterglow::calib::isFrameName(arguments[i])) {
      throw std::invalid_argument("'" + arguments[i] + "' is no tf2 frame name; " + kUsage);
    }
  }
  geometry_msgs::TransformStamped transform;
  transform.header.frame_id = arguments[7];
  transform.child_frame_id = arguments[8];
  transform.transform =
      afterglow::nodes::toTransform(afterglow::nodes::poseFromNumbers(numbers, "the transform"));
  return transform;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"static_transform_node",
                      "X Y Z QX QY QZ QW PARENT_FRAME CHILD_FRAME: sends that static transform.",
                      ""};
  return runNode(argc, argv, text, [](const auto&, const std::vector<std::string>& arguments) {
    geometry_msgs::TransformStamped transform = readTransform(arguments);
    tf2_ros::StaticTransformBroadcaster broadcaster;
    transform.header.stamp = ros::Time::now();
    broadcaster.sendTransform(transform);
    waitForStop();
  });
}
