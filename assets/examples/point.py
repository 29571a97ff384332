#!/usr/bin/python3
"""Points at a spot on the floor: looks there, lights it and says what it is."""
import actionlib
import rospy
from afterglow import Recording
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal, PointHeadAction, PointHeadGoal
from sound_play.msg import SoundRequest
from trajectory_msgs.msg import JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

X, Y = 1.5, 0.2  # m ahead of the robot, and to its left

rospy.init_node("example_point")
head = actionlib.ActionClient("/head_controller/point_head", PointHeadAction)
turret = actionlib.ActionClient("/projector/follow_joint_trajectory", FollowJointTrajectoryAction)
light = rospy.Publisher("/projector/nav/path", MarkerArray, queue_size=1)
speech = rospy.Publisher("/robotsound", SoundRequest, queue_size=1)
look = PointHeadGoal()
look.min_duration = rospy.Duration(1.5)
look.target.header.frame_id, look.target.point.x, look.target.point.y = "base_link", X, Y
aim = FollowJointTrajectoryGoal()
aim.trajectory.joint_names = ["projector_pan_joint", "projector_tilt_joint"]
aim.trajectory.points = [JointTrajectoryPoint(positions=rad, time_from_start=rospy.Duration(s))
                         for s, rad in ((1.5, [0.36, 0.95]), (5.5, [0.36, 0.95]), (7, [0, 0]))]  # and back
spot = Marker(type=Marker.CYLINDER, lifetime=rospy.Duration(4))
spot.header.frame_id, spot.pose.position.x, spot.pose.position.y = "base_link", X, Y
spot.scale.x, spot.scale.y, spot.scale.z, spot.color.g, spot.color.a = 0.5, 0.5, 0.01, 1, 1

head.wait_for_server(), turret.wait_for_server()
with Recording("point", topics=[head.ns + "/goal", turret.ns + "/goal", light.name, speech.name], tags=["example"]):
    head.send_goal(look)
    turret.send_goal(aim)
    rospy.sleep(1.5)
    light.publish([spot])
    speech.publish(sound=SoundRequest.SAY, command=1, volume=1, arg="There you can put the box.")
    rospy.sleep(4)
    look.target.point.x, look.target.point.y, look.target.point.z = 5, 0, 1.1  # ahead again
    head.send_goal(look)
    rospy.sleep(2)
