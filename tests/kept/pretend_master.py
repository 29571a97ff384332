"""A ROS master that a node is started with to see what it asks for: topics, services, parameters."""
import io
import os
import queue
import re
import socket
import subprocess
import threading
import time
import urllib.parse
import xmlrpc.server

import rosgraph.network

SHORT_S, LONG_S = 0.3, 5  # a node stands that asked for nothing new so long: for all that is expected, and otherwise
# What roscpp and actionlib ask for by themselves.
OTHERS = re.compile(r"asks /(enable_statistics|statistics_window_\w+|tcp_keepalive|use_sim_time)$"
                    r"|.* /rosout[ _].*|.* roscpp/.*|asks .*/(actionlib_\w+_queue_size|status_\w+)$")


class Master:
    """Answers as one whose only node this is, and notes down what it is asked."""

    def __init__(self, parameters):
        self.parameters, self.notes, self.news = parameters, set(), queue.Queue()
        self.server = xmlrpc.server.SimpleXMLRPCServer(("localhost", 0), logRequests=False, allow_none=True)
        self.uri = "http://localhost:%d/" % self.server.server_address[1]
        self.server.register_instance(self)
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def note(self, *words):
        if words not in self.notes:
            self.notes.add(words)
            self.news.put(words)

    def _dispatch(self, method, parameters):
        return getattr(self, method, lambda *_: [1, "", 0])(*parameters)

    def getPid(self, _):
        return [1, "", os.getpid()]

    def getUri(self, _):
        return [1, "", self.uri]

    def registerPublisher(self, _, topic, kind, __):
        self.note("publishes", topic, kind)
        return [1, "", []]

    def registerSubscriber(self, _, topic, kind, __):
        self.note("subscribes", topic, kind)
        return [1, "", []]

    def registerService(self, _, service, uri, __):
        self.note("serves", service, uri)
        return [1, "", 1]

    def setParam(self, _, key, value):
        self.parameters[key] = value
        return [1, "", 0]

    def getParam(self, _, key):
        self.note("asks", key)
        return [1, "", self.parameters[key]] if key in self.parameters else [-1, "not set", 0]

    def hasParam(self, _, key):
        self.note("asks", key)
        return [1, "", key in self.parameters]

    def searchParam(self, _, __):
        return [-1, "not set", ""]

    def subscribeParam(self, _, __, key):
        self.note("asks", key)
        return [1, "", self.parameters.get(key, {})]

    def getPublishedTopics(self, *_):
        return [1, "", []]

    getTopicTypes = getPublishedTopics

    def getSystemState(self, _):
        return [1, "", [[], [], []]]

    def wait_until_quiet(self, process, expected):
        """Until the process ends or asks for nothing new; not long if it has asked for what was expected."""
        since = time.monotonic()
        while process.poll() is None:
            missing = expected - {words[:2] for words in self.notes.copy()}
            if time.monotonic() > since + (LONG_S if missing or not expected else SHORT_S):
                return
            try:
                self.news.get(timeout=0.02)
                since = time.monotonic()
            except queue.Empty:
                pass


def service_type(service, uri):
    """As `rosservice type` asks for it."""
    parts = urllib.parse.urlparse(uri)
    with socket.create_connection((parts.hostname, parts.port)) as connection:
        rosgraph.network.write_ros_handshake_header(
            connection, {"probe": "1", "md5sum": "*", "callerid": "/judge", "service": service})
        return rosgraph.network.read_ros_handshake_header(connection, io.BytesIO(), 4096)["type"]


def asked_by(arguments, parameters, expected):
    """Starts a node; what it has asked for by the time it stands, sorted; what it said if it ends before.
    `expected`: lines as they were once."""
    master = Master(parameters)
    process = subprocess.Popen(arguments, env=dict(os.environ, ROS_MASTER_URI=master.uri), text=True,
                               stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    master.wait_until_quiet(process, {tuple(line.split(" ")[:2]) for line in expected})
    if process.poll() is not None:
        return [process.stdout.read().rstrip("\n"), f"ended with status {process.returncode}"]
    lines = []
    for words in master.notes.copy():
        if words[0] == "serves":
            words = words[:2] + (service_type(*words[1:]),)
        lines.append(" ".join(words))
    process.kill()
    process.wait()
    return sorted(line for line in lines if not OTHERS.match(line))
