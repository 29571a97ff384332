"""Stored behaviors, read by the command `afterglow` (its --json output)."""
import collections
import json
import os
import shutil
import subprocess
import tempfile

from . import beside

Topic = collections.namedtuple("Topic", "type count")
#: time: seconds since the epoch; text is None for a sound's file, file for a sentence.
Sentence = collections.namedtuple("Sentence", "time text file behavior name")


class StoreError(RuntimeError):
    """What the command refused, in its words."""


def _command():
    for folder in os.environ.get("PATH", "").split(os.pathsep):
        path = os.path.join(folder, "afterglow")
        if os.path.isfile(path) and os.access(path, os.X_OK):
            return path
    try:
        import roslib.packages
        found = roslib.packages.find_node("afterglow", "afterglow")
    except ImportError:  # in a program of ROS 2
        found = None
    if not found:
        raise StoreError("the command afterglow is not installed, nor in this workspace")
    return found[0]


def _run(verb, store, *arguments):
    command = [_command(), verb] + list(arguments) + (["--store", store] if store else [])
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, universal_newlines=True)
    output, errors = process.communicate()
    if process.returncode != 0:
        raise StoreError(errors.strip().splitlines()[-1] if errors.strip() else "afterglow {} failed".format(verb))
    return output


def _options(**given):
    words = []
    for name, value in sorted(given.items()):
        if value is not None:
            words += ["--" + name, value if hasattr(value, "strip") else json.dumps(value)]
    return words


class Behavior(object):
    """One stored behavior, as `afterglow list --json` tells it.

    id, name, tree_path, parent (an id, or None), attempt, outcome, begin and end (seconds since the epoch; end is None
    while it is recorded), robot, parameters (a dict), tags, topics ({name: Topic(type, count)}).
    """

    def __init__(self, told, store=None):
        self._store = store
        self.id, self.name, self.tree_path = told["id"], told["name"], told["tree_path"]
        self.parent, self.attempt, self.outcome = told["parent"] or None, told["attempt"], told["outcome"]
        self.begin, self.end = _seconds(told["begin_ns"]), _seconds(told["end_ns"])
        self.robot, self.tags = told["robot"], told["tags"]
        self.parameters = told["parameters"] or {}
        self.topics = dict((name, Topic(one["type"], one["count"])) for name, one in told["topics"].items())

    def __repr__(self):
        return "<Behavior {} {} {}>".format(self.id, self.name, self.outcome)

    def messages(self, topics=None):
        """Its messages in the order of their times, as rosbag's read_messages: (topic, message, time).

        topics: these instead of its own; context such as "/tf" may be named. They are exported into a bag first, which
        ends with the iterator. Under rospy alone; for ROS 2 there is `afterglow export --ros2`.
        """
        if beside.is_wanted():
            raise StoreError("messages() reads a bag of ROS 1; for ROS 2: afterglow export {} --out FILE.mcap "
                             "--ros2".format(self.id))
        import rosbag
        folder = tempfile.mkdtemp(prefix="afterglow_")
        try:
            path = os.path.join(folder, "behavior.bag")
            chosen = ["--topics", ",".join(topics)] if topics else []
            _run("export", self._store, str(self.id), "--out", path, *chosen)
            with rosbag.Bag(path) as bag:
                for message in bag.read_messages():
                    yield message
        finally:
            shutil.rmtree(folder)

    def play(self, **options):
        """As play()."""
        from .replay import play
        return play(self.id, **options)


def _seconds(nanoseconds):
    return None if nanoseconds is None else int(nanoseconds) * 1e-9


def find(name=None, outcome=None, topic=None, robot=None, tag=None, where=None, since=None, until=None, before=None,
         limit=None, store=None):
    """Behaviors, newest first. What is given narrows them down, as the options of `afterglow list` do.

    where: a filter in MongoDB's language, a dict. since, until: "yesterday 14:00", "10 minutes ago", seconds.
    Raises StoreError.
    """
    told = _run("list", store, "--json", *_options(name=name, outcome=outcome, topic=topic, robot=robot, tag=tag,
                                                   where=where, since=since, until=until, before=before, limit=limit))
    return [Behavior(one, store) for one in json.loads(told)]


def said(before=None, since=None, limit=None, store=None):
    """What the robot said and which sounds it played, newest first: Sentences. Raises StoreError."""
    told = json.loads(_run("said", store, "--json", *_options(before=before, since=since, limit=limit)))
    return [Sentence(_seconds(one["received_ns"]), one["text"], one["file"], one["behavior"], one["name"])
            for one in told]


def ask(question, store=None):
    """Asks what the robot did, in words: "why did you not go straight?"

    A dict, as `afterglow ask --json` tells it: answer ("found", "asked_back" or "unknown"), behavior (an id, or None),
    sentence and others. play() shows the behavior. Raises StoreError.
    """
    return json.loads(_run("ask", store, "--json", "--", question))
