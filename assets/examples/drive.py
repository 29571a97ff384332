#!/usr/bin/python3
"""Drives a circle that it lights on the floor, and says why it does not go straight."""
import math

import actionlib
import rospy
from afterglow import Recording
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal
from geometry_msgs.msg import Point, Twist, Vector3
from sound_play.msg import SoundRequest
from trajectory_msgs.msg import JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

RADIUS, TURN = 0.8, 0.5  # m, rad/s
SECONDS = 2 * math.pi / TURN + 1  # with a second to start and to stop

rospy.init_node("example_drive")
wheels = rospy.Publisher("/cmd_vel", Twist, queue_size=1)
light = rospy.Publisher("/projector/nav/path", MarkerArray, queue_size=1)
turret = actionlib.ActionClient("/projector/follow_joint_trajectory", FollowJointTrajectoryAction)
speech = rospy.Publisher("/robotsound", SoundRequest, queue_size=1)
aim = FollowJointTrajectoryGoal()
aim.trajectory.joint_names = ["projector_pan_joint", "projector_tilt_joint"]
aim.trajectory.points = [JointTrajectoryPoint(positions=rad, time_from_start=rospy.Duration(s))
                         for s, rad in ((2, [0.85, 0.95]), (SECONDS - 2, [0.85, 0.95]), (SECONDS, [0, 0]))]  # and back
circle = Marker(type=Marker.LINE_STRIP, lifetime=rospy.Duration(SECONDS))
circle.header.frame_id, circle.scale.x, circle.color.g, circle.color.a = "map", 0.15, 1, 1
circle.points = [Point(RADIUS * math.sin(i / 10.0), RADIUS * (1 - math.cos(i / 10.0)), 0) for i in range(64)]

turret.wait_for_server()
with Recording("drive", topics=[turret.ns + "/goal", wheels.name, light.name, speech.name], tags=["example"]):
    turret.send_goal(aim)
    light.publish([circle])
    speech.publish(sound=SoundRequest.SAY, command=1, volume=1, arg="I do not go straight: a circle takes me home.")
    end = rospy.get_time() + SECONDS
    while rospy.get_time() < end:
        speed = TURN * min(1, rospy.get_time() - end + SECONDS, end - rospy.get_time())
        wheels.publish(Vector3(RADIUS * speed, 0, 0), Vector3(0, 0, speed))
        rospy.sleep(0.05)
