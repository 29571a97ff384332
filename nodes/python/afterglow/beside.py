"""For programs of ROS 2: rospy in a process of its own, since both ROSes call their messages std_msgs.

It is started when it is first needed, and ends with the program. It hears lines of JSON, {"id", "do", ...}, and tells
such lines: {"id", "position"} of a replay, and last {"id", "value"} or {"id", "error", "report"}.
"""
import json
import os
import subprocess
import sys
import threading
import time

_TICK_S = 0.02
_END_S = 5.0  # requests that are under way have so long when the program ends
_PYTHON = "/usr/bin/python3"  # which ROS 1 is installed for


class BesideFailed(RuntimeError):
    """What the other process says. report: a replay's, where there is one."""

    def __init__(self, why, report=None):
        RuntimeError.__init__(self, why)
        self.report = report


def is_wanted():
    """The program is one of ROS 2, and none of ROS 1."""
    rospy = sys.modules.get("rospy")
    return "rclpy" in sys.modules and not (rospy and rospy.core.is_initialized())


def is_ok():
    return sys.modules["rclpy"].ok()


def warn(text):
    if is_wanted():
        import rclpy.logging
        rclpy.logging.get_logger("afterglow").warning(text)
    else:
        import rospy
        rospy.logwarn(text)


def ask(what, **fields):
    """Its Request."""
    return _Beside.running().ask(dict(fields, do=what))


class Request(object):
    def __init__(self, number, beside):
        self.number, self._beside = number, beside
        self.position, self.heard_s, self._last = None, time.time(), None
        self._ended = threading.Event()

    def tell(self, told):
        self.heard_s = time.time()
        if "position" in told:
            self.position = told["position"]
        else:
            self._last = told
            self._ended.set()

    def is_done(self):
        return self._ended.is_set()

    def cancel(self):
        self._beside.write({"id": self.number, "do": "cancel"})

    def value(self):
        """Waits for it. Raises BesideFailed."""
        self._ended.wait()
        if "error" in self._last:
            raise BesideFailed(self._last["error"], self._last.get("report"))
        return self._last["value"]


class _Beside(object):
    """The other process, as the program sees it."""

    _one, _one_lock = None, threading.Lock()

    @classmethod
    def running(cls):
        with cls._one_lock:
            if cls._one is None or cls._one.has_ended():
                cls._one = cls()
            return cls._one

    def __init__(self):
        here = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
        others = [path for path in sys.path if os.path.isdir(os.path.join(path, "rospy"))]
        environment = dict(os.environ, PYTHONPATH=os.pathsep.join([here] + others))
        environment.pop("PYTHONHOME", None)
        # A session of its own: Ctrl-C is the program's, which still ends its recordings.
        self._process = subprocess.Popen([_PYTHON, "-c", "from afterglow.beside import main; main()"],
                                         stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, cwd="/",
                                         universal_newlines=True, start_new_session=True)
        self._lock, self._requests, self._count, self._has_ended = threading.Lock(), {}, 0, False
        thread = threading.Thread(target=self._read, name="afterglow beside")
        thread.daemon = True
        thread.start()

    def has_ended(self):
        with self._lock:
            return self._has_ended

    def ask(self, fields):
        with self._lock:
            self._count += 1
            request = Request(self._count, self)
            self._requests[request.number] = request
        self.write(dict(fields, id=request.number))
        if self.has_ended():
            self._fail_all()
        return request

    def write(self, told):
        try:
            with self._lock:
                self._process.stdin.write(json.dumps(told) + "\n")
                self._process.stdin.flush()
        except EnvironmentError:
            pass  # it has ended, which _read sees

    def _read(self):
        for line in self._process.stdout:
            told = json.loads(line)
            with self._lock:
                request = self._requests.get(told["id"])
                if "position" not in told:
                    self._requests.pop(told["id"], None)
            if request:
                request.tell(told)
        with self._lock:
            self._has_ended = True
        self._fail_all()
        self._process.wait()

    def _fail_all(self):
        with self._lock:
            requests, self._requests = list(self._requests.values()), {}
        for request in requests:
            request.tell({"error": "the process beside this one, {} with rospy, has ended".format(_PYTHON)})


class Replay(object):
    """As afterglow.replay.Replay, which is in the other process."""

    def __init__(self, behavior, action, timeout_s, options):
        self._was_ok, self._silence_s = is_ok(), timeout_s + _END_S
        self._request = ask("play", behavior=str(behavior), action=action, timeout_s=timeout_s, options=options)
        self._wait_until(lambda: self._request.position is not None)
        if self._request.position is None:
            self.result()

    @property
    def position(self):
        return self._request.position or 0.0

    def stop(self):
        self._request.cancel()

    def is_done(self):
        return self._request.is_done()

    def result(self):
        from .replay import ReplayFailed
        self._wait_until(lambda: False)
        try:
            return self._request.value()
        except BesideFailed as error:
            raise ReplayFailed(str(error), error.report)

    def _wait_until(self, is_there):
        """Or until it is done."""
        from .replay import ReplayFailed
        while not self._request.is_done() and not is_there():
            time.sleep(_TICK_S)
            if self._was_ok and not is_ok():
                raise ReplayFailed("this node was shut down")
            if time.time() - self._request.heard_s > self._silence_s:
                raise ReplayFailed("the process beside this one is silent")


class _Worker(object):
    """The other process, by itself."""

    def __init__(self, output):
        self._output, self._lock = output, threading.Lock()
        self._node_lock = threading.Lock()
        self._replays = {}

    def tell(self, number, **told):
        try:
            with self._lock:
                self._output.write(json.dumps(dict(told, id=number)) + "\n")
                self._output.flush()
        except EnvironmentError:
            pass  # the program has ended

    def do(self, number, what, asked):
        try:
            self._be_a_node()
            self.tell(number, value=getattr(self, what)(number, **asked))
        except Exception as error:
            self.tell(number, error=str(error), report=getattr(error, "report", None))

    def cancel(self, number):
        replay = self._replays.get(number)
        if replay:
            replay.stop()

    def _be_a_node(self):
        import rosgraph
        import rospy
        with self._node_lock:
            if rospy.core.is_initialized():
                return
            if not rosgraph.is_master_online():
                raise RuntimeError("no ROS master answers at " + rosgraph.get_master_uri())
            rospy.init_node("afterglow", anonymous=True, disable_signals=True)

    def start(self, _, node, fields, timeout_s):
        from .recording import _Recorder
        return _Recorder.of(node).start(fields, timeout_s)

    def stop(self, _, node, behavior_id, outcome):
        from .recording import _Recorder
        _Recorder.of(node).stop(behavior_id, outcome)

    def play(self, number, behavior, action, timeout_s, options):
        from .replay import Replay
        replay = self._replays[number] = Replay(behavior, action, timeout_s, options)
        ended = threading.Event()
        teller = threading.Thread(target=self._tell_position, args=(number, replay, ended))
        teller.start()
        try:
            return replay.result()
        finally:
            ended.set()
            teller.join()
            del self._replays[number]

    def _tell_position(self, number, replay, ended):
        while True:
            self.tell(number, position=replay.position)
            if ended.wait(_TICK_S):
                return


def main():
    """Until the program has ended."""
    output = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # rospy logs there
    worker, threads = _Worker(output), []
    while True:
        line = sys.stdin.readline()
        if not line:
            break
        asked = json.loads(line)
        number, what = asked.pop("id"), asked.pop("do")
        if what == "cancel":
            worker.cancel(number)
            continue
        thread = threading.Thread(target=worker.do, args=(number, what, asked))
        thread.daemon = True
        thread.start()
        if what != "play":
            threads = [one for one in threads if one.is_alive()] + [thread]
    end = time.time() + _END_S
    for thread in threads:
        thread.join(max(0.0, end - time.time()))
    if "rospy" in sys.modules:
        sys.modules["rospy"].signal_shutdown("the program has ended")
