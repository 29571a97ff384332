#!/usr/bin/python3
"""Lights three spots on the floor, one after the other."""
import actionlib
import rospy
from afterglow import Recording
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal
from std_msgs.msg import ColorRGBA
from trajectory_msgs.msg import JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

SPOTS = [(0.3, ColorRGBA(1, 0, 0, 1)), (0.0, ColorRGBA(1, 0.8, 0, 1)), (-0.3, ColorRGBA(0, 1, 0, 1))]  # m to the left

rospy.init_node("example_light")
turret = actionlib.ActionClient("/projector/follow_joint_trajectory", FollowJointTrajectoryAction)
light = rospy.Publisher("/projector/nav/path", MarkerArray, queue_size=1)

aim = FollowJointTrajectoryGoal()
aim.trajectory.joint_names = ["projector_pan_joint", "projector_tilt_joint"]
aim.trajectory.points = [JointTrajectoryPoint(positions=rad, time_from_start=rospy.Duration(s))
                         for s, rad in ((1.5, [0.26, 0.95]), (6.5, [0.26, 0.95]), (8, [0, 0]))]  # and back

turret.wait_for_server()
with Recording("light", topics=[turret.ns + "/goal", light.name], tags=["example"]):
    turret.send_goal(aim)
    rospy.sleep(1.5)
    for number, (left, color) in enumerate(SPOTS):
        spot = Marker(id=number, type=Marker.CYLINDER, color=color, lifetime=rospy.Duration(5 - number))
        spot.header.frame_id, spot.pose.position.x, spot.pose.position.y = "base_link", 1.5, left
        spot.scale.x, spot.scale.y, spot.scale.z = 0.25, 0.25, 0.01
        light.publish([spot])
        rospy.sleep(1)
    rospy.sleep(4)
