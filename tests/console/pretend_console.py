"""A console's server with made-up behaviors and a made-up robot, for what the page does with a robot: the real one
needs a ROS installation, a robot that moves and minutes. Its answers are those that nodes/console/README.md describes.

  pretend_console.py [PORT [BEHAVIORS]]   serves assets/console on loopback, to look at the page by hand
"""
import json
import random
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

ASSETS = Path(__file__).resolve().parents[2] / "assets" / "console"
TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
POLICY = ("default-src 'self'; img-src 'self' data: blob:; style-src 'self'; script-src 'self'; "
          "frame-ancestors 'none'")
FIRST_NS = 1_790_000_000 * 10 ** 9
HOSTILE = "<img src=x onerror=\"document.title='broken in'\">"
WORDS = {"pick": ["I pick the gearbox bottom.", "I have it."], "place": ["I place it into the caddy."],
         "drive": ["I drive round the box.", "There is something in my way."], "unfold": [], "search": ["Where is it?"]}
HOLD_S = 0.3  # the robot stops after so long without a heartbeat


def behaviors(many):
    """Newest first; always the same."""
    dice = random.Random(1)
    begin, made = FIRST_NS, []
    for at in range(1, many + 1):
        name = HOSTILE if at == many - 4 else dice.choice(list(WORDS))
        outcome = dice.choices(["success", "failure", "halted"], [8, 2, 1])[0]
        length = round(dice.uniform(2, 40), 2)
        begin += int((length + dice.choice([20, 90, 600, 20000])) * 10 ** 9)
        made.append({"id": at, "name": name, "outcome": outcome,
                     "look": {"success": "good", "failure": "bad"}.get(outcome, "other"), "begin": str(begin),
                     "end": str(begin + int(length * 10 ** 9)), "duration": length,
                     "local": time.strftime("%Y-%m-%d %H:%M:%S", time.gmtime(begin // 10 ** 9)),
                     "said": WORDS.get(name, []), "tags": ["monday"] if at % 7 == 0 else [],
                     "tree_path": "kitting/" + name, "attempt": 1 + at % 3 // 2, "parent": at - 1 if at % 9 == 0 else None,
                     "messages": dice.randint(100, 5000), "parameters": {"part": dice.choice(["gear", "screw"])}})
    return made[::-1]


def details(one, all_of_them):
    length = one["duration"]
    said = [{"t": round(length * (at + 1) / 4, 2), "text": text} for at, text in enumerate(one["said"])]
    how = "succeeded" if one["outcome"] == "success" else "aborted"
    story = [{"t": 0, "kind": "began", "text": f"began {one['name']}"},
             {"t": 0.4, "kind": "goal", "text": f"arm: goal {how} after {length / 2:.1f} s"},
             *({"t": line["t"], "kind": "said", "text": line["text"]} for line in said),
             {"t": length, "kind": "ended", "text": f"ended: {one['outcome']}"}]
    for line in story:
        line["bad"] = "aborted" in line["text"] or "failure" in line["text"]
        line["clock"] = time.strftime("%H:%M:%S", time.gmtime(int(one["begin"]) // 10 ** 9 + line["t"]))

    def lane(topic, kind, role, hz, spans=()):
        count = int(length * hz)
        return {"topic": topic, "type": kind, "role": role, "count": count, "hz": hz, "context": role == "state", "why_not": "", "first": 0.1, "last": length,
                "marks": [0.1 + at * length / min(count, 400) for at in range(min(count, 400))] if count else [],
                "spans": list(spans)}
    goals = [{"from": 0.4, "to": length / 2, "outcome": how, "look": "good" if how == "succeeded" else "bad",
              "text": f"goal 1: {how}"},
             {"from": length * 0.6, "to": length, "outcome": "succeeded", "look": "good", "text": "goal 2: succeeded"}]
    turret = [{"from": at * length / 24, "to": (at + 0.8) * length / 24, "outcome": "succeeded", "look": "good",
               "text": f"goal {at + 1}: succeeded"} for at in range(one.get("turret_goals", 0))]
    story[1:1] = [{"t": span["to"], "kind": "goal", "text": f"turret succeeded after {1 + at / 100:.2f} s", "bad": False,
                   "clock": "12:00:00"} for at, span in enumerate(turret)]
    lanes = [lane("/projector/green_points", "sensor_msgs/PointCloud2", "ar", 2),
             lane("/robotsound", "sound_play/SoundRequest", "speech", 0.2),
             lane("/arm_controller/follow_joint_trajectory/goal", "control_msgs/FollowJointTrajectoryActionGoal",
                  "body", 0.2, goals),
             lane("/cmd_vel", "geometry_msgs/Twist", "body", 20),
             *([lane("/turret/goal", "control_msgs/FollowJointTrajectoryActionGoal", "body", 1, turret)] if turret else []),
             lane("/joint_states", "sensor_msgs/JointState", "state", 50),
             lane("/tf", "tf2_msgs/TFMessage", "state", 100)]
    return dict(one, story=story, said=said, lanes=lanes, key_moments=[0.0, length / 2, length], remarks=[],
                children=[other for other in all_of_them if other["parent"] == one["id"]][:3],
                attempts=[other for other in all_of_them if other["name"] == one["name"]][:3])


def picture(view, t):
    color = "#2c6" if view == "projector" else "#c93"
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="640" height="400"><rect width="640" height="400" '
            f'fill="{"#000" if view == "projector" else "#8a8f95"}"/><circle cx="{100 + 12 * t}" cy="200" r="60" '
            f'fill="{color}"/></svg>').encode()


class Robot:
    """A player that pretends to move; every request of the page is kept in `heard`."""
    def __init__(self):
        self.lock = threading.RLock()
        self.heard, self.tokens, self.beat = [], set(), None
        self.player = {"state": "idle", "behavior": None, "position": 0, "duration": 0, "rate": 1, "words": "Nothing is replayed.",
                       "lateness_ms": 0, "skew_ms": 0, "moved": False, "robot": "fetch"}
        self.last, self.is_held, self.session = time.monotonic(), False, None
        self.calibrator, self.report = None, None
        self.is_late = False  # tells what was, not what is
        self.image = {"topic": "/projector/image", "published": True}
        self.projector = {"level": 0, "words": "Shows 1 of 2 layers."}
        self.states = 0  # that have been told

    def step(self):
        with self.lock:
            now, player = time.monotonic(), self.player
            self.states += 1
            if player["state"] in ("playing", "waiting"):
                held = not self.is_held or (self.beat is not None and now - self.beat < HOLD_S)
                player["state"] = "playing" if held else "waiting"
                player["words"] = ("Replays pick on fetch." if held else "Waits: nobody holds the button.")
                if held:
                    player["position"] += (now - self.last) * player["rate"]
                    player.update(moved=True, lateness_ms=1.4, skew_ms=3.0)
                if player["position"] >= player["duration"]:
                    self.end("completed", "Done: nothing was late by more than 2 ms.")
            self.last = now
            return {"player": dict(player), "calibrator": self.calibrator, "recorder": {"words": "Records nothing; 41 GB are free; nothing was lost."},
                    "projector": {**self.projector, "image": dict(self.image), "layers": [
                        {"topic": "/projector/green_points", "hz": 2.0, "shown": True, "words": ""},
                        {"topic": "/projector/nav/path", "hz": 0, "shown": False, "words": "no message yet"}]},
                    "diagnostics": [{"name": "projector", "level": 0, "words": "draws 30 images a second"},
                                    {"name": "recorder", "level": 1, "words": "the disk has 41 GB left"}]}

    def end(self, ended, words):
        """With its report, as the player measures it."""
        player = self.player
        if player["state"] == "idle":
            return
        self.report = {"behavior": player["behavior"], "ended": ended}
        player.update(state="idle", words=words, reports=player.get("reports", 0) + 1)

    def left(self, session):
        """Whose events have ended: the page that started a replay, or another."""
        with self.lock:
            if session == self.session and self.player["state"] != "idle":
                self.end("the page that started it is gone", "Stopped: the page that started it is gone.")

    def ask(self, path, body, many):
        with self.lock:
            self.heard.append(path)
            player = self.player
            if path == "/api/dry-run":
                token, moves = f"token {len(self.heard)}", "body" in body["only"].split(",")
                self.tokens.add(token)
                topics = [("/projector/green_points", "ar"), ("/robotsound", "speech"), ("/cmd_vel", "body"),
                          ("/joint_states", "")]
                return 200, {"token": token, "moves": moves, "robot": "fetch", "speed": "peak 0.45 rad/s, 0.2 m/s",
                             "refusal": "", "topics": [
                                 {"topic": topic, "type": "a/Type", "published": kind in body["only"].split(","),
                                  "reason": "" if kind else "a live sensor's"} for topic, kind in topics]}
            if path == "/api/play":
                if body.get("confirmed") not in self.tokens:
                    return 409, {"error": "motion needs the token of a dry run"}
                self.tokens.clear()
                self.is_held, self.last = bool(body.get("hold")), time.monotonic()
                self.session = body["session"]
                length = next(one["duration"] for one in many if one["id"] == body["behavior"])
                player.update(state="waiting" if self.is_held else "playing", behavior=body["behavior"],
                              position=body.get("start", 0), duration=length, rate=body.get("rate", 1))
            elif path == "/api/hold":
                self.beat = time.monotonic()
            elif path == "/api/stop":
                self.end("stopped", "Stopped by a person.")
            elif path in ("/api/pause", "/api/resume"):
                player["state"] = "paused" if path == "/api/pause" else "playing"
            elif path == "/api/seek":
                player["position"] = body["t"]
            elif path == "/api/rate":
                player["rate"] = body["rate"]
            elif path.startswith("/api/calibrate/"):
                if self.calibrator["phase"] == "done":
                    return 409, {"error": "there is nothing to stop"}
                return 200, {"words": "started"}
            return 200, {}


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def answer(self, status, body, kind="application/json", more=()):
        data = json.dumps(body).encode() if kind == "application/json" else body
        self.send_response(status)
        headers = {"Content-Type": kind, "Content-Length": len(data), "Content-Security-Policy": POLICY,
                   "X-Content-Type-Options": "nosniff", **dict(more)}
        for name, value in headers.items():
            self.send_header(name, str(value))
        self.end_headers()
        self.wfile.write(data)

    def do_POST(self):
        body = json.loads(self.rfile.read(int(self.headers.get("Content-Length", 0))) or b"{}")
        self.answer(*self.server.robot.ask(self.path, body, self.server.behaviors))

    def do_GET(self):
        address = urlsplit(self.path)
        query = {key: values[0] for key, values in parse_qs(address.query).items()}
        parts = address.path.strip("/").split("/")
        if parts[0] in ("", "console"):
            name = ASSETS / (parts[1] if len(parts) > 1 else "index.html")
            if name.parent == ASSETS and name.is_file():
                return self.answer(200, name.read_bytes(), TYPES[name.suffix])
            return self.answer(404, {"error": "there is no such file"})
        if address.path == "/api/events":
            return self.events(query.get("session"))
        self.answer(*self.look(parts[1:], query))

    def look(self, parts, query):
        every = self.server.behaviors
        asked = parts[-1]
        counted = "thumbnail" if query.get("t") == "lit" else asked
        self.server.asked[counted] = self.server.asked.get(counted, 0) + 1
        if asked in self.server.failing:
            return 503, {"error": self.server.failing[asked]}
        if parts == ["about"]:
            names = {}
            for one in every:
                names[one["name"]] = names.get(one["name"], 0) + 1
            return 200, {"version": "1.0", "store": "sqlite:kitting.db", "has_robot": True, "needs_token": False, "can_render": not self.server.why_no_render,
                         "why_no_render": self.server.why_no_render, "names": names}
        if parts == ["report"]:
            report = self.server.robot.report
            return (200, report) if report else (404, {"error": "no replay has ended yet"})
        if parts == ["report", "page"]:
            page = "<!doctype html><html><title>Report</title><h1>Replay</h1>" + "<p>/tf was 3 s old</p>" * 40 + "</html>"
            more = [("Content-Security-Policy", POLICY.replace("'none'", "'self'"))]
            return 200, page.encode(), "text/html", more
        if parts in (["projected"], ["camera"]):
            return 200, picture(parts[0], 10), "image/svg+xml"
        if parts == ["calendar"]:
            days = {}
            for one in every:
                day = days.setdefault(one["local"][:10], {"day": one["local"][:10], "zone": "+00:00", "count": 0, "failed": 0})
                day["count"] += 1
                day["failed"] += one["outcome"] == "failure"
            return 200, list(days.values())
        if parts == ["behaviors"]:
            return self.find(every, query)
        if parts == ["compare"]:
            return self.compare(every, query)
        one = next((one for one in every if str(one["id"]) == parts[1]), None)
        if one is None:
            return 404, {"error": f"there is no behavior {parts[1]}"}
        if parts[2:] == ["picture"]:
            more = [("Afterglow-Dark", json.dumps(self.server.dark))]
            if query["t"] == "lit":
                self.server.thumbnails.append(one["id"])
                lit = self.server.first_light
                return 200, picture(query["view"], lit or 0), "image/svg+xml", [*more, ("Afterglow-Moment", lit or "")]
            self.server.pictures.append((query["view"], float(query["t"])))
            return 200, picture(*self.server.pictures[-1]), "image/svg+xml", more
        if parts[2:] == ["values"]:
            begin, end = float(query["from"]), min(float(query["to"]), one["duration"])
            times = [begin + at * (end - begin) / 100 for at in range(101)]
            return 200, {"t": times, "whole": True, "fields": {
                "angular.z": [-0.1] * 101, "linear.x": [0.2 + t for t in times]}}
        if parts[2:] == ["sound"]:
            return 200, b"RIFF", "audio/wav"
        if parts[2:] == ["message"]:
            return 200, {"t": float(query["t"]), "type": "geometry_msgs/Twist", "value": {
                "linear": {"x": 0.2 + float(query["t"]), "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": -0.1},
                "names": ["a", "b"]}}
        return 200, details(one, every)

    def find(self, every, query):
        words = query.get("q", "").lower().split()
        found = [one for one in every if all(word in json.dumps(one).lower() for word in words)
                 and query.get("name", one["name"]) == one["name"]
                 and query.get("outcome", one["outcome"]) == one["outcome"]
                 and int(query.get("from", 0)) <= int(one["begin"]) < int(query.get("to", 10 ** 20))]
        after = [one for one in found if one["id"] < int(query.get("before", 10 ** 9))]
        return 200, {"total": len(every), "matching": len(found),
                     "behaviors": after[:int(query.get("limit", 100))]}

    def compare(self, every, query):
        a, b = (details(next(one for one in every if str(one["id"]) == query[key]), every) for key in "ab")
        texts = list(dict.fromkeys(line["text"] for side in (a, b) for line in side["story"]))
        lines = [{line["text"]: line for line in side["story"]} for side in (a, b)]
        parts = [side["parameters"]["part"] for side in (a, b)]
        return 200, {"story": [{"a": lines[0].get(text), "b": lines[1].get(text),
                                "differs": (text in lines[0]) != (text in lines[1])} for text in texts],
                     "topics": [{"topic": one["topic"], "a": one["count"], "b": other["count"], "differs": False}
                                for one, other in zip(a["lanes"], b["lanes"])],
                     "parameters": [{"key": "part", "a": parts[0], "b": parts[1], "differs": parts[0] != parts[1]}],
                     "duration": {"a": a["duration"], "b": b["duration"]}}

    def events(self, session):
        self.send_response(200)
        self.send_header("Content-Type", "text/event-stream")
        self.end_headers()
        self.close_connection = True
        try:
            told = ""
            while not self.server.closing.wait(0.1):
                now = json.dumps(self.server.robot.step())
                if told == now or (told and self.server.robot.is_late):
                    self.wfile.write(b":\n\n")  # that somebody still hears shows by writing
                    continue
                told = now
                self.wfile.write(f"event: state\ndata: {told}\n\n".encode())
        except OSError:
            self.server.robot.left(session)


class PretendConsole(ThreadingHTTPServer):
    daemon_threads = True

    def __init__(self, port=0, many=40):
        super().__init__(("127.0.0.1", port), Handler)
        self.behaviors, self.robot, self.closing = behaviors(many), Robot(), threading.Event()
        self.why_no_render, self.pictures = "", []  # what was asked for: (view, t)
        self.thumbnails, self.first_light = [], None  # whose first lit moment was asked for, and when it is
        self.dark = []  # what no picture shows, and why
        self.asked, self.failing = {}, {}  # by the last word of an address: how often it was asked for; the answer 503
        self.url = f"http://127.0.0.1:{self.server_port}/"

    def start(self):
        threading.Thread(target=self.serve_forever, daemon=True).start()
        return self

    def stop(self):
        self.closing.set()
        self.shutdown()
        self.server_close()


if __name__ == "__main__":
    console = PretendConsole(*(int(word) for word in sys.argv[1:]))
    print(console.url)
    console.serve_forever()
