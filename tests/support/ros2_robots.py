"""Robots of ROS 2, for programs of rclpy that a test drives (ros2_peer.py): what their drivers take and tell."""
import math
import threading
import time

import numpy
from builtin_interfaces.msg import Duration
from control_msgs.action import FollowJointTrajectory, ParallelGripperCommand
from control_msgs.msg import JointTolerance
from geometry_msgs.msg import TransformStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState, LaserScan
from tf2_msgs.msg import TFMessage
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Loop:
    """Steps at a rate, in a thread of its own; makes up for steps that it was late for, as a robot goes on meanwhile."""
    def __init__(self, node, hz):
        self.node, self.period, self.lock = node, 1 / hz, threading.RLock()
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        self.at, count = time.monotonic(), 0
        while True:
            with self.lock:
                self.step(count)
                self.at, count = self.at + self.period, count + 1
            time.sleep(max(0, self.at - time.monotonic()))

    def now(self):
        return self.node.get_clock().now().to_msg()


class Base(Loop):
    """A TurtleBot3 of Jazzy: obeys TwistStamped for half a second, 40 ms late, and slips; its odometry does not know.

    A localization finds it exactly, ten times a second."""
    SIGHT = numpy.linspace(-math.pi, math.pi, 360, endpoint=False)
    WALL_M = 4
    SLIP = 0.98
    LATE_S = 0.04

    def __init__(self, node):
        self.pose = self.odometry = self.found = (0.0, 0.0, 0.0)
        self.told, self.commands = [], 0
        self.transforms = node.create_publisher(TFMessage, '/tf', 100)
        self.fixed = node.create_publisher(TFMessage, '/tf_static', LATCHED)
        self.odometries = node.create_publisher(Odometry, '/odom', 10)
        self.scans = node.create_publisher(LaserScan, '/scan', qos_profile_sensor_data)
        super().__init__(node, 50)
        self.fixed.publish(TFMessage(transforms=[self.transform('base_footprint', 'base_scan', (0.0, 0.0, 0.0))]))
        node.create_subscription(TwistStamped, '/cmd_vel', self.take, 10)

    def take(self, command, info):
        # rclpy's executor is late by a tenth of a second on a busy machine; a driver is not.
        at = time.monotonic() - time.time() + 1e-9 * info['received_timestamp']
        with self.lock:
            self.commands += 1
            self.told.append((at, command.twist.linear.x, command.twist.angular.z))

    def put(self, x, y, yaw):
        with self.lock:
            self.pose = (x, y, yaw)
            self.told.clear()

    def velocity(self):
        while len(self.told) > 1 and self.told[1][0] + self.LATE_S <= self.at:
            self.told.pop(0)
        if not self.told or not self.told[0][0] + self.LATE_S <= self.at <= self.told[0][0] + 0.5:
            return 0.0, 0.0
        return self.told[0][1:]

    def step(self, count):
        forward, turn = self.velocity()
        self.pose = self.moved(self.pose, forward * self.SLIP, turn * self.SLIP)
        self.odometry = self.moved(self.odometry, forward, turn)
        if count % 5 == 0:
            self.found = self.between(self.odometry, self.pose)
            self.scans.publish(self.scan())
        transforms = [self.transform('odom', 'base_footprint', self.odometry),
                      self.transform('map', 'odom', self.found)]
        self.transforms.publish(TFMessage(transforms=transforms))
        told = Odometry(child_frame_id='base_footprint')
        told.header = transforms[0].header
        told.pose.pose.position.x, told.pose.pose.position.y = self.odometry[:2]
        told.pose.pose.orientation = transforms[0].transform.rotation
        told.twist.twist.linear.x, told.twist.twist.angular.z = float(forward), float(turn)
        self.odometries.publish(told)

    def moved(self, pose, forward, turn):
        x, y, yaw = pose
        yaw += turn * self.period / 2
        gone = forward * self.period
        return x + gone * math.cos(yaw), y + gone * math.sin(yaw), yaw + turn * self.period / 2

    @staticmethod
    def between(odometry, pose):
        yaw = pose[2] - odometry[2]
        cos, sin = math.cos(yaw), math.sin(yaw)
        return (pose[0] - cos * odometry[0] + sin * odometry[1], pose[1] - sin * odometry[0] - cos * odometry[1], yaw)

    def transform(self, parent, child, pose):
        told = TransformStamped(child_frame_id=child)
        told.header.stamp, told.header.frame_id = self.now(), parent
        told.transform.translation.x, told.transform.translation.y = pose[:2]
        told.transform.rotation.z, told.transform.rotation.w = math.sin(pose[2] / 2), math.cos(pose[2] / 2)
        return told

    def scan(self):
        """Of the walls of a square room around the map's origin."""
        x, y, yaw = self.pose
        with numpy.errstate(divide='ignore'):
            cos, sin = numpy.cos(self.SIGHT + yaw), numpy.sin(self.SIGHT + yaw)
            ranges = numpy.minimum((self.WALL_M - numpy.sign(cos) * x) / abs(cos),
                                   (self.WALL_M - numpy.sign(sin) * y) / abs(sin))
        told = LaserScan(angle_min=-math.pi, angle_max=math.pi, angle_increment=2 * math.pi / 360, scan_time=0.1,
                         range_min=0.1, range_max=12.0, ranges=ranges.astype(numpy.float32))
        told.header.stamp, told.header.frame_id = self.now(), 'base_scan'
        return told


class Arm(Loop):
    """Six joints behind FollowJointTrajectory; a new goal ends the one before."""
    JOINTS = ['shoulder_pan_joint', 'shoulder_lift_joint', 'elbow_joint', 'wrist_1_joint', 'wrist_2_joint',
              'wrist_3_joint']

    def __init__(self, node, action):
        self.positions = [0.0] * 6
        self.goal, self.goals, self.cancels = None, [], []
        self.states = node.create_publisher(JointState, '/joint_states', 10)
        super().__init__(node, 100)
        self.server = ActionServer(node, FollowJointTrajectory, action, self.execute,
                                   callback_group=ReentrantCallbackGroup(), cancel_callback=self.cancel)

    def put(self, positions):
        with self.lock:
            self.positions = list(positions)

    def cancel(self, goal):
        self.cancels.append(time.monotonic())
        return CancelResponse.ACCEPT

    def step(self, count):
        if self.goal:
            seconds = time.monotonic() - self.begin
            rows = [(0, self.start)] + [(point.time_from_start.sec + point.time_from_start.nanosec * 1e-9,
                                         [point.positions[i] for i in self.order])
                                        for point in self.goal.request.trajectory.points]
            self.positions = [float(numpy.interp(seconds, [at for at, _ in rows], [row[i] for _, row in rows]))
                              for i in range(6)]
            self.is_there = seconds >= rows[-1][0]
        if count % 2 == 0:
            told = JointState(name=self.JOINTS, position=self.positions, velocity=[0.0] * 6)
            told.header.stamp = self.now()
            self.states.publish(told)

    def execute(self, goal):
        with self.lock:
            names = goal.request.trajectory.joint_names
            self.order = [names.index(joint) for joint in self.JOINTS]
            self.start, self.begin, self.is_there = self.positions, time.monotonic(), False
            self.goal = goal
        self.goals.append(bytes(goal.goal_id.uuid).hex())
        feedback = FollowJointTrajectory.Feedback(joint_names=self.JOINTS, index=7, multi_dof_index=8)
        while self.goal is goal and not self.is_there and not goal.is_cancel_requested:
            feedback.actual.positions = self.positions
            goal.publish_feedback(feedback)
            time.sleep(0.05)
        with self.lock:
            is_last = self.goal is goal
            if is_last:
                self.goal = None
        if goal.is_cancel_requested:
            goal.canceled()
        elif is_last:
            goal.succeed()
        else:
            goal.abort()
        return FollowJointTrajectory.Result(error_string='at rest')


class Gripper:
    """Refuses what is wider than it, gives up what is thinner than nothing, and closes in a twentieth of a second."""
    WIDEST_M = 0.1

    def __init__(self, node, action):
        self.server = ActionServer(node, ParallelGripperCommand, action, self.execute,
                                   goal_callback=self.judge, callback_group=ReentrantCallbackGroup())

    def judge(self, goal):
        return GoalResponse.REJECT if goal.command.position[0] > self.WIDEST_M else GoalResponse.ACCEPT

    def execute(self, goal):
        time.sleep(0.05)
        told = ParallelGripperCommand.Result(state=goal.request.command)
        told.reached_goal = goal.request.command.position[0] >= 0
        goal.succeed() if told.reached_goal else goal.abort()
        return told


class Client:
    """Sends goals and waits for their results."""
    def __init__(self, node, kind, action):
        self.kind, self.client = kind, ActionClient(node, kind, action)
        self.client.wait_for_server(30)

    def send(self, **fields):
        return self.wait(self.client.send_goal_async(self.kind.Goal(**fields)))

    @staticmethod
    def wait(future):
        """rclpy gives up an answer after 0.1 s where server and client have not met yet."""
        end = time.monotonic() + 30
        while not future.done():
            if time.monotonic() > end:
                raise TimeoutError('no answer within 30 s')
            time.sleep(0.005)
        return future.result()

    def result(self, goal):
        """Its id and its state in ROS 2; 0 where it was refused."""
        state = self.wait(goal.get_result_async()).status if goal.accepted else 0
        return [bytes(goal.goal_id.uuid).hex(), state]


class ArmClient(Client):
    def __init__(self, node, action):
        super().__init__(node, FollowJointTrajectory, action)

    def go(self, *rows):
        """[seconds from now, positions], in turn."""
        points = [JointTrajectoryPoint(positions=positions, time_from_start=Duration(
            sec=int(seconds), nanosec=int(seconds % 1 * 1e9))) for seconds, positions in rows]
        tolerances = [JointTolerance(name=name, position=0.5) for name in Arm.JOINTS]
        return self.send(trajectory=JointTrajectory(joint_names=Arm.JOINTS, points=points),
                         path_tolerance=tolerances, goal_time_tolerance=Duration(sec=1))


class GripperClient(Client):
    def __init__(self, node, action):
        super().__init__(node, ParallelGripperCommand, action)

    def go(self, width):
        return self.send(command=JointState(name=['finger_joint'], position=[width], effort=[5.0]))
