"""Records a robot's behaviors, finds them again and replays them: nodes/README.md, "From C++, Python and behavior trees".

    from afterglow import Recording, find

    with Recording("pick", topics=["/tf", "/gripper/command"]) as recording:
        if not grasp():
            recording.fail("dropped")

    last = find(name="pick", outcome="dropped", limit=1)[0]
    for topic, message, stamp in last.messages():
        ...

For Python 2.7 and 3, with rospy; in a program of ROS 2 with rclpy, where rospy is in a process beside it (beside.py).
Imported by themselves: trees.py, for py_trees; reader.py, which reads stores without ROS and without the command.
The package's messages live here, too: afterglow.msg, afterglow.srv.
"""
from pkgutil import extend_path

from .recording import Recording, RecordingFailed, recorded
from .replay import Replay, ReplayFailed, play
from .store import Behavior, StoreError, ask, find, said

__path__ = extend_path(__path__, __name__)  # installed by pip, the messages lie elsewhere

__all__ = ["Behavior", "Recording", "RecordingFailed", "Replay", "ReplayFailed", "StoreError", "ask", "find",
           "play", "recorded", "said"]
