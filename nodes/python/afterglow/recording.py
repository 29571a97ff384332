"""Recording behaviors by recorder_node's services, in the terms of the C++ BehaviorRecording."""
import functools
import json
import threading
import time

try:
    import queue
except ImportError:  # Python 2
    import Queue as queue

from . import beside

RECORDER = "recorder_node"
_LOOK_EVERY_S = 0.05
_here = threading.local()  # .enclosing: this thread's open recordings, the innermost last


class RecordingFailed(RuntimeError):
    """There is no recording, and it was required."""


class _Recorder(object):
    """Asks one recorder, by a thread of its own: one request after the other, in the order of their making.

    So an attempt never overlaps the one before it, a recording ends after those within it, and a recorder that hangs
    holds up nobody but this thread.
    """

    _all, _lock = {}, threading.Lock()

    @classmethod
    def of(cls, node):
        with cls._lock:
            if node not in cls._all:
                cls._all[node] = cls(node)
            return cls._all[node]

    def __init__(self, node):
        self._node, self._was_absent = node, False
        self._requests = queue.Queue()
        thread = threading.Thread(target=self._run, name="recorder " + node)
        thread.daemon = True
        thread.start()

    def ask(self, request):
        self._requests.put(request)

    def _run(self):
        while True:
            self._requests.get()()

    def start(self, fields, timeout_s):
        if beside.is_wanted():
            return beside.ask("start", node=self._node, fields=fields, timeout_s=timeout_s).value()
        from afterglow.srv import StartRecording
        answer = self._call("start_recording", StartRecording, fields, timeout_s)
        if answer.message:
            beside.warn("recording '{}': {}".format(fields["name"], answer.message))
        return answer.behavior_id

    def stop(self, behavior_id, outcome):
        if beside.is_wanted():
            beside.ask("stop", node=self._node, behavior_id=behavior_id, outcome=outcome).value()
            return
        from afterglow.srv import StopRecording
        self._call("stop_recording", StopRecording, {"behavior_id": behavior_id, "outcome": outcome}, 0)

    def _call(self, service, kind, fields, timeout_s):
        import rospy
        if not rospy.core.is_initialized():
            raise RecordingFailed("no recorder can be asked before rospy.init_node")
        name = self._node + "/" + service
        # A recorder that is not there is waited for once; later recordings only look. Half of the time is left
        # for its answer, and for saying that there is none.
        if not _is_there(name, 0 if self._was_absent else timeout_s / 2.0):
            self._was_absent = True
            raise RecordingFailed("there is no recorder at " + name)
        self._was_absent = False
        try:
            answer = rospy.ServiceProxy(name, kind)(**fields)
        except rospy.ServiceException as error:
            raise RecordingFailed("{} gives no answer: {}".format(name, error))
        if not answer.success:
            raise RecordingFailed(answer.message)
        return answer


def _is_there(service, timeout_s):
    import rosgraph
    import rospy
    master = rosgraph.Master(rospy.get_name())
    end = _now() + timeout_s
    while True:
        try:
            master.lookupService(service)
            return True
        except rosgraph.MasterException:
            pass
        except EnvironmentError as error:
            raise RecordingFailed("no ROS master answers: {}".format(error))
        if _now() >= end or rospy.is_shutdown():
            return False
        time.sleep(_LOOK_EVERY_S)


def _now():
    return getattr(time, "monotonic", time.time)()


class Recording(object):
    """Records as one behavior what happens between start() and end(), or in a `with` block.

    name, topics, tree_path, parameters (a dict), tags, attempt (0: counted by the recorder), regexes, all, exclude,
    limits, pre_roll, keep_if are those of action/RecordBehavior. Without tree_path it lies below this thread's
    enclosing `with` block. wait: start() returns when every subscription stands. timeout_s: neither start nor end
    holds anybody up for longer. required: start() raises RecordingFailed where there would be no recording; else the
    behavior goes on unrecorded, with a warning.

    A `with` block ends as "success", as "exception" if one leaves it, or as end() or fail() said within it; only the
    first end counts.
    """

    def __init__(self, name, topics=(), tree_path="", parameters=None, tags=(), attempt=0, regexes=(), all=False,
                 exclude=(), limits=(), pre_roll=0.0, keep_if="", wait=True, timeout_s=5.0, required=False,
                 recorder=RECORDER):
        if not name:
            raise ValueError("a recording needs a name")
        for key, value in (("topics", topics), ("tags", tags), ("regexes", regexes), ("exclude", exclude),
                           ("limits", limits)):
            if hasattr(value, "strip"):  # a text would be a list of its letters
                raise ValueError("{} is a list: [{!r}]".format(key, value))
        self._fields = dict(
            name=name, topics=list(topics), tree_path=tree_path, tags=list(tags), attempt=attempt,
            parameters=json.dumps(parameters) if parameters else "", regexes=list(regexes), all=all,
            exclude=list(exclude), limits=list(limits), pre_roll=float(pre_roll), keep_if=keep_if)
        self._waits, self._timeout_s, self._is_required = wait, timeout_s, required
        self._recorder = _Recorder.of(recorder)
        self._settled, self._done = threading.Event(), threading.Event()
        self._has_begun = False
        self.outcome = None  #: the word that it ended with
        self.id = 0  #: in the store; 0 until the recording stands
        self.problem = ""  #: why there is no recording (yet)

    @property
    def tree_path(self):
        return self._fields["tree_path"]

    def start(self):
        if self._has_begun:
            raise RuntimeError("a recording starts once: make another for another attempt")
        self._has_begun = True
        outer = getattr(_here, "enclosing", [])
        if not self._fields["tree_path"]:
            above = outer[-1].tree_path + "/" if outer else ""
            self._fields["tree_path"] = above + self._fields["name"]
        self._recorder.ask(self._start)
        if self._waits and not self._settled.wait(self._timeout_s):
            self.problem = "no answer within {} s".format(self._timeout_s)
            self._warn()
        if self._waits and self._is_required and self.id == 0:
            self.end("unrecorded")
            raise RecordingFailed("'{}' cannot be recorded: {}".format(self._fields["name"], self.problem))
        return self

    def is_settled(self):
        """It stands, or there is none."""
        return self._settled.is_set()

    def fail(self, outcome="failure"):
        """Ends it with a word that says why, e.g. "dropped"."""
        self.end(outcome)

    def end(self, outcome="success"):
        """Does not wait."""
        if self.outcome is not None or not self._has_begun:
            return
        self.outcome = outcome
        self._recorder.ask(self._stop)

    def __enter__(self):
        self.start()
        self.push()
        return self

    def __exit__(self, kind, error, trace):
        self.pop()
        self.end("exception" if kind else "success")
        self._done.wait(self._timeout_s)
        return False

    def push(self):
        """Until pop(), this thread's recordings without a tree path lie below this one."""
        if not hasattr(_here, "enclosing"):
            _here.enclosing = []
        _here.enclosing.append(self)

    def pop(self):
        _here.enclosing.remove(self)

    def _start(self):
        try:
            self.id = self._recorder.start(self._fields, self._timeout_s)
            self.problem = ""
        except Exception as error:  # whatever it is, the behavior goes on
            self.problem = str(error)
            self._warn()
        self._settled.set()

    def _stop(self):
        try:
            if self.id:
                self._recorder.stop(self.id, self.outcome)
        except Exception as error:
            self.problem = str(error)
            self._warn()
        self._done.set()

    def _warn(self):
        beside.warn("'{}' is not recorded: {}".format(self._fields["name"], self.problem))


def recorded(name, **options):
    """Decorates a function: each call is a behavior. One that returns False has failed.

        @recorded("pick", topics=["/tf"])
        def pick(part):
            ...
    """
    def decorate(function):
        @functools.wraps(function)
        def call(*arguments, **named):
            with Recording(name, **options) as recording:
                result = function(*arguments, **named)
                if result is False:
                    recording.fail()
                return result
        return call
    return decorate
