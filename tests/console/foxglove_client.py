"""The Foxglove WebSocket protocol's own client (npm), as foxglove_client.js runs it."""
import json
import os
import shutil
import subprocess
import threading

HERE = os.path.dirname(os.path.abspath(__file__))


def modules(build):
    return os.path.join(build, "foxglove_client")


def why_not(build):
    """It cannot run; empty: it can."""
    if os.path.isdir(os.path.join(modules(build), "node_modules")) and shutil.which("node"):
        return ""
    return "the protocol's client is not here: nodes/setup --tests gets it from npm"


class Client:
    """Until close(). All that the server says is in `events`, or goes where a subclass's take() puts it."""
    def __init__(self, build, url, *protocols):
        self.events = []
        program = os.path.join(HERE, "foxglove_client.js")
        self.process = subprocess.Popen(["node", program, modules(build), url, *protocols], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, universal_newlines=True)
        self.thread = threading.Thread(target=self.listen, daemon=True)
        self.thread.start()

    def listen(self):
        for line in self.process.stdout:
            self.take(json.loads(line))

    def take(self, event):
        self.events.append(event)

    def do(self, command, **what):
        self.process.stdin.write(json.dumps(dict(what, do=command)) + "\n")
        self.process.stdin.flush()

    def topics(self):
        topics = {}
        for one in list(self.events):
            if one["event"] == "advertise":
                topics.update({channel["topic"]: channel for channel in one["channels"]})
            if one["event"] == "unadvertise":
                topics = {name: channel for name, channel in topics.items() if channel["id"] not in one["ids"]}
        return topics

    def close(self):
        self.process.stdin.close()
        self.process.wait(20)
        self.thread.join()
        self.process.stdout.close()
