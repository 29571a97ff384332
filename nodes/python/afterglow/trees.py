"""Recording behaviors of a tree of py_trees (0.7 of ROS Melodic and Noetic, or 2)."""
import re

import py_trees

from .recording import RECORDER, Recording

_Status = py_trees.common.Status
_NAMES = {_Status.INVALID: "IDLE", _Status.RUNNING: "RUNNING", _Status.SUCCESS: "SUCCESS", _Status.FAILURE: "FAILURE"}
_OUTCOMES = {_Status.INVALID: "halted", _Status.SUCCESS: "success", _Status.FAILURE: "failure"}


class RecordBehavior(py_trees.decorators.Decorator):
    """Records its child as a behavior: RecordBehavior(child, "pick", topics=["/tf"]), options as Recording's.

    It is RUNNING, without blocking, until the recording stands; then it is what its child is. The recording ends as
    "success" or "failure", as "halted" where the tree interrupts it, as "exception" if the child raises one. With
    required=True it is a FAILURE, the child not ticked, where there can be no recording.
    """

    def __init__(self, child, name=None, required=False, **options):
        super(RecordBehavior, self).__init__(name=name or child.name, child=child)
        self._options, self._is_required = dict(options, wait=False), required
        self._recording = None

    def tick(self):
        if self._recording is None:
            self._recording = Recording(self.name, **self._options).start()
        recording = self._recording
        if not recording.is_settled():
            self.status = _Status.RUNNING
            yield self
            return
        if self._is_required and recording.id == 0:
            self.logger.warning("{} cannot be recorded: {}".format(self.name, recording.problem))
            self.stop(_Status.FAILURE)
            yield self
            return
        recording.push()
        try:
            for node in super(RecordBehavior, self).tick():
                yield node
        except Exception:
            self._end("exception")
            raise
        finally:
            recording.pop()

    def update(self):
        return self.decorated.status

    def terminate(self, new_status):
        self._end(_OUTCOMES.get(new_status, "halted"))

    def _end(self, outcome):
        if self._recording is not None:
            self._recording.end(outcome)
            self._recording = None


class TreeObserver(object):
    """Observes, under rospy, an unmodified tree: every change of a status is published, chosen nodes are recorded.

        observer = TreeObserver(tree, {"**/pick": dict(topics=["/tf"], pre_roll=0.5)})

    tree: a py_trees.trees.BehaviourTree, looked at after each tick; or its root, with look() called by whoever ticks
    it. record: globs of paths ("*" any but "/", "**" any, "**/" any number of names) with options of Recording; of
    several that match, the first of a list of pairs. A node is recorded from RUNNING to "success", "failure" or
    "halted"; since that is seen after its first tick, give it a pre_roll. topic: of afterglow/TreeTransition.
    Raises ValueError for a glob that no node matches.
    """

    def __init__(self, tree, record=(), name="", topic="~tree_transitions", recorder=RECORDER):
        import rospy
        from afterglow.msg import TreeTransition
        root = getattr(tree, "root", tree)
        self._tree = name or root.name
        self._publisher = rospy.Publisher(topic, TreeTransition, queue_size=1000)
        self._nodes = _watched(root, root.name, None)
        rules = [(_glob(path), path, options) for path, options in getattr(record, "items", lambda: record)()]
        for pattern, path, options in rules:
            matched = [node for node in self._nodes if pattern.match(node.path)]
            if not matched:
                raise ValueError("no node of the tree matches " + path)
            for node in matched:
                node.options = node.options or dict(options, wait=False, recorder=recorder)
        if hasattr(tree, "add_post_tick_handler"):
            tree.add_post_tick_handler(self.look)

    def paths(self):
        """Of every node, the root first: what globs are matched with."""
        return [node.path for node in self._nodes]

    def look(self, *_):
        for node in self._nodes:
            if node.node.status != node.status:
                self._on_change(node, node.status, node.node.status)

    def _on_change(self, node, before, now):
        import rospy
        from afterglow.msg import TreeTransition
        stamp = rospy.Time.now()
        if now == _Status.RUNNING and node.options:
            name = node.options.get("name", node.node.name)
            options = dict({"tree_path": node.path, "attempt": node.failures + 1}, **node.options)
            options.pop("name", None)
            node.recording = Recording(name, **options).start()
        transition = TreeTransition(
            stamp=stamp, tree=self._tree, path=node.path, type=type(node.node).__name__, from_status=_NAMES[before],
            to_status=_NAMES[now], duration=(stamp - node.since).to_sec() if node.since else 0,
            attempt=node.failures + 1, behavior_id=node.behavior_id())
        if now != _Status.RUNNING and node.recording:
            node.recording.end(_OUTCOMES[now])
            node.recording = None
        node.failures = node.failures + 1 if now == _Status.FAILURE else 0 if now in _OUTCOMES else node.failures
        node.status, node.since = now, stamp
        self._publisher.publish(transition)


class _Watched(object):
    def __init__(self, node, path, above):
        self.node, self.path, self.above = node, path, above
        self.status, self.since, self.failures = node.status, None, 0
        self.options, self.recording = None, None

    def behavior_id(self):
        if self.recording:
            return self.recording.id
        return self.above.behavior_id() if self.above else 0


def _watched(node, path, above):
    """The node and all below it, the root first; "#2" at a second sibling of one name."""
    watched = _Watched(node, path, above)
    everything, names = [watched], {}
    for child in node.children:
        names[child.name] = names.get(child.name, 0) + 1
        number = "#{}".format(names[child.name]) if names[child.name] > 1 else ""
        everything += _watched(child, path + "/" + child.name + number, watched)
    return everything


def _glob(text):
    pattern = ""
    for part in re.findall(r"\*\*/|\*\*|\*|\?|[^*?]+", text):
        pattern += {"**/": "(?:.*/)?", "**": ".*", "*": "[^/]*", "?": "[^/]"}.get(part, re.escape(part))
    return re.compile(pattern + r"\Z")
