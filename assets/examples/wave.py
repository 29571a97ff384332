#!/usr/bin/python3
"""Waves in front of a word of light, and says why."""
import actionlib
import rospy
from afterglow import Recording
from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal
from sound_play.msg import SoundRequest
from trajectory_msgs.msg import JointTrajectoryPoint
from visualization_msgs.msg import Marker, MarkerArray

JOINTS = ["shoulder_pan_joint", "shoulder_lift_joint", "upperarm_roll_joint", "elbow_flex_joint", "forearm_roll_joint",
          "wrist_flex_joint", "wrist_roll_joint"]
ROLLS = [(3, -3.0), (4, -2.6), (5, -3.4), (6, -2.6), (7, -3.4), (8, -3.0)]  # s, rad: the raised arm's
PATH = [(when, [1.0, 0, roll, 1.4, 0, 0.2, 0]) for when, roll in ROLLS] + [(11, [1.32, 1.4, -0.2, 1.72, 0, 1.66, 0])]

rospy.init_node("example_wave")
arm, turret = [actionlib.ActionClient(name + "/follow_joint_trajectory", FollowJointTrajectoryAction)
               for name in ("/arm_controller", "/projector")]
light = rospy.Publisher("/projector/nav/path", MarkerArray, queue_size=1)
speech = rospy.Publisher("/robotsound", SoundRequest, queue_size=1)

wave, aim = FollowJointTrajectoryGoal(), FollowJointTrajectoryGoal()
wave.trajectory.joint_names, aim.trajectory.joint_names = JOINTS, ["projector_pan_joint", "projector_tilt_joint"]
for goal, path in ((wave, PATH), (aim, [(1.5, [0.26, 0.95]), (9.5, [0.26, 0.95]), (11, [0, 0])])):  # and back
    goal.trajectory.points = [JointTrajectoryPoint(positions=rad, time_from_start=rospy.Duration(s)) for s, rad in path]
hello = Marker(type=Marker.TEXT_VIEW_FACING, text="HI", lifetime=rospy.Duration(8))
hello.header.frame_id, hello.scale.z, hello.pose.position.x = "base_link", 0.5, 1.5
hello.color.r, hello.color.g, hello.color.a = 1, 0.8, 1

arm.wait_for_server(), turret.wait_for_server()
topics = [arm.ns + "/goal", turret.ns + "/goal", light.name, speech.name]
with Recording("wave", topics=topics, tags=["example"]) as recording:
    aimed, waved = turret.send_goal(aim), arm.send_goal(wave)
    speech.publish(sound=SoundRequest.SAY, command=1, volume=1, arg="Hello! I wave because I am glad to see you.")
    rospy.sleep(1.5)
    light.publish([hello])
    rospy.sleep(10)
    if {aimed.get_goal_status(), waved.get_goal_status()} != {3}:  # SUCCEEDED
        recording.fail()
