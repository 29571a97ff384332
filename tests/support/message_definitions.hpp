/// \file
/// Definition texts as connection headers carry them, for tests without an installed message
/// package. Comments are left out.
#pragma once

#include <string>

namespace afterglow::test {

inline const std::string kSeparator = "\n" + std::string(80, '=') + "\n";

inline std::string withTypes(std::string text) { return text; }

/// A definition with those of the contained types behind it.
template <typename... Rest>
std::string withTypes(std::string text, const std::string& type, const std::string& fields,
                      const Rest&... rest) {
  return withTypes(text + kSeparator + "MSG: " + type + "\n" + fields, rest...);
}

inline const std::string kHeader = "uint32 seq\ntime stamp\nstring frame_id\n";
inline const std::string kGoalId = "time stamp\nstring id\n";
inline const std::string kPoint = "float64 x\nfloat64 y\nfloat64 z\n";
inline const std::string kJointTrajectory =
    "Header header\nstring[] joint_names\nJointTrajectoryPoint[] points\n";
inline const std::string kJointTrajectoryPoint =
    "float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\nfloat64[] effort\n"
    "duration time_from_start\n";

/// tf2_msgs/TFMessage
inline const std::string kTfMessage =
    withTypes("geometry_msgs/TransformStamped[] transforms\n", "geometry_msgs/TransformStamped",
              "Header header\nstring child_frame_id\nTransform transform\n", "std_msgs/Header",
              kHeader, "geometry_msgs/Transform", "Vector3 translation\nQuaternion rotation\n",
              "geometry_msgs/Vector3", kPoint, "geometry_msgs/Quaternion", kPoint + "float64 w\n");

/// sensor_msgs/PointCloud2
inline const std::string kPointCloud2 = withTypes(
    "Header header\nuint32 height\nuint32 width\nPointField[] fields\nbool is_bigendian\n"
    "uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n",
    "std_msgs/Header", kHeader, "sensor_msgs/PointField",
    "uint8 INT8=1\nuint8 FLOAT32 = 7\nstring name\nuint32 offset\nuint8 datatype\nuint32 count\n");

/// trajectory_msgs/JointTrajectory
inline const std::string kBareTrajectory =
    withTypes(kJointTrajectory, "std_msgs/Header", kHeader, "trajectory_msgs/JointTrajectoryPoint",
              kJointTrajectoryPoint);

/// control_msgs/FollowJointTrajectoryActionGoal
inline const std::string kTrajectoryActionGoal = withTypes(
    "Header header\nactionlib_msgs/GoalID goal_id\nFollowJointTrajectoryGoal goal\n",
    "std_msgs/Header", kHeader, "actionlib_msgs/GoalID", kGoalId,
    "control_msgs/FollowJointTrajectoryGoal",
    "trajectory_msgs/JointTrajectory trajectory\nJointTolerance[] path_tolerance\n"
    "JointTolerance[] goal_tolerance\nduration goal_time_tolerance\n",
    "trajectory_msgs/JointTrajectory", kJointTrajectory, "trajectory_msgs/JointTrajectoryPoint",
    kJointTrajectoryPoint, "control_msgs/JointTolerance",
    "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n");

/// An action's result without any content of its own
inline const std::string kAnyActionResult =
    withTypes("Header header\nactionlib_msgs/GoalStatus status\n", "std_msgs/Header", kHeader,
              "actionlib_msgs/GoalStatus", "GoalID goal_id\nuint8 status\nstring text\n",
              "actionlib_msgs/GoalID", kGoalId);

/// control_msgs/PointHeadActionGoal
inline const std::string kPointHeadActionGoal = withTypes(
    "Header header\nactionlib_msgs/GoalID goal_id\nPointHeadGoal goal\n", "std_msgs/Header",
    kHeader, "actionlib_msgs/GoalID", kGoalId, "control_msgs/PointHeadGoal",
    "geometry_msgs/PointStamped target\ngeometry_msgs/Vector3 pointing_axis\nstring "
    "pointing_frame\nduration min_duration\nfloat64 max_velocity\n",
    "geometry_msgs/PointStamped", "Header header\nPoint point\n", "geometry_msgs/Point", kPoint,
    "geometry_msgs/Vector3", kPoint);

}  // namespace afterglow::test
