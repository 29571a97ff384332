// turret_tf_node turret.yaml: sends where the projector is on its turret, whenever tf says that the
// turret has turned, with the turret's errors corrected (`afterglow calibrate mount --turret`).
#include <geometry_msgs/TransformStamped.h>
#include <ros/ros.h>
#include <tf2/buffer_core.h>
#include <tf2/exceptions.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>

#include <boost/function.hpp>
#include <string>
#include <utility>
#include <vector>

#include "calib/mount/turret.hpp"
#include "nodes/conversion/geometry_conversion.hpp"
#include "nodes/projector/transform_listener.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace {

using afterglow::calib::Turret;
using afterglow::calib::TurretJoint;

/// Answers each message of tf that moves the turret with the projector's place at that moment. Of
/// a turret that stands by static transforms alone, it is a static transform, too.
class TurretTransform {
 public:
  explicit TurretTransform(Turret turret) : turret_(std::move(turret)) {
    using Message = tf2_msgs::TFMessage;
    const boost::function<void(const Message::ConstPtr&)> moving =
        [this](const Message::ConstPtr& message) { take(*message, false); };
    const boost::function<void(const Message::ConstPtr&)> fixed =
        [this](const Message::ConstPtr& message) { take(*message, true); };
    moving_ = nh_.subscribe<Message>("/tf", 100, moving);
    fixed_ = nh_.subscribe<Message>("/tf_static", 100, fixed);
  }

 private:
  void take(const tf2_msgs::TFMessage& message, bool is_static) {
    using namespace afterglow::nodes;
    const ros::Time now = ros::Time::now();
    if (now < last_time_) buffer_.clear();  // a simulation began anew
    last_time_ = now;
    for (const geometry_msgs::TransformStamped& transform : message.transforms) {
      if (frameName(transform.child_frame_id) == turret_.projector_frame) continue;  // by this node
      const StoredTransform stored = storeTransform(buffer_, transform, "tf", is_static, now);
      if (!stored.is_stored) ROS_WARN_THROTTLE(10, "%s", stored.reason.c_str());
    }
    try {
      send();
    } catch (const tf2::TransformException& error) {
      ROS_WARN_DELAYED_THROTTLE(10, "the turret is not in tf: %s", error.what());
    }
  }

  void send() {
    const std::string &base = turret_.joints.front().parent, &last = turret_.joints.back().link;
    const ros::Time stamp = buffer_.lookupTransform(base, last, ros::Time(0)).header.stamp;
    if (!stamp.isZero() && stamp == sent_) return;
    std::vector<Eigen::Isometry3d> T_parent_link;
    for (const TurretJoint& joint : turret_.joints) {
      T_parent_link.push_back(afterglow::nodes::toIsometry(
          buffer_.lookupTransform(joint.parent, joint.link, stamp).transform));
    }
    const Eigen::Isometry3d T = turret_.T_base_projector(T_parent_link);
    if (stamp.isZero() && T.isApprox(T_sent_)) return;
    geometry_msgs::TransformStamped transform;
    transform.header.stamp = stamp.isZero() ? ros::Time::now() : stamp;
    transform.header.frame_id = base;
    transform.child_frame_id = turret_.projector_frame;
    transform.transform = afterglow::nodes::toTransform(T);
    if (stamp.isZero()) {
      fixed_sender_.sendTransform(transform);
    } else {
      moving_sender_.sendTransform(transform);
    }
    sent_ = stamp;
    T_sent_ = T;
  }

  const Turret turret_;
  tf2::BufferCore buffer_;
  ros::NodeHandle nh_;
  ros::Subscriber moving_, fixed_;
  tf2_ros::TransformBroadcaster moving_sender_;
  tf2_ros::StaticTransformBroadcaster fixed_sender_;
  ros::Time last_time_, sent_;
  Eigen::Isometry3d T_sent_{Eigen::Matrix4d::Zero()};
};

}  // namespace

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"turret_tf_node",
                      "TURRET_YAML: sends where the projector is, as its turret turns.", ""};
  return runNode(argc, argv, text, [](const auto&, const std::vector<std::string>& arguments) {
    if (arguments.size() != 1) {
      throw std::invalid_argument("expected: the turret.yaml of a calibration");
    }
    const TurretTransform transform(afterglow::calib::loadTurret(arguments.front()));
    ros::AsyncSpinner spinner(1);
    spinner.start();
    waitForStop();
  });
}
