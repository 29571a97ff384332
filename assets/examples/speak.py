#!/usr/bin/python3
"""Says two sentences."""
import rospy
from afterglow import Recording
from sound_play.msg import SoundRequest

rospy.init_node("example_speak")
speech = rospy.Publisher("/robotsound", SoundRequest, queue_size=5)

with Recording("speak", topics=[speech.name], tags=["example"]):
    for sentence in ("I am a robot that remembers.", "Ask me why I did something, and I show you."):
        speech.publish(sound=SoundRequest.SAY, command=1, volume=1, arg=sentence)
        rospy.sleep(3)
