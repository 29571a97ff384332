"""Headless Chromium, driven by the W3C WebDriver protocol: what tests of the console's page need of it, with nothing
beyond Python's own library (Debian 11 to 13: chromium, chromium-driver)."""
import base64
import http.client
import json
import shutil
import socket
import subprocess
import time

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
MISSING = "" if CHROMIUM and DRIVER else "there is no chromium with its chromedriver (apt install chromium-driver)"
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # the protocol's name of a reference
KEYS = {"Enter": "\ue007", "Escape": "\ue00c", "Tab": "\ue004", "ArrowLeft": "\ue012", "ArrowUp": "\ue013",
        "ArrowRight": "\ue014", "ArrowDown": "\ue015", "End": "\ue010", "Home": "\ue011", "Space": " ",
        "Shift": "\ue008"}
WAIT_S = 20
SHOWN = "[...document.querySelectorAll(arguments[0])].find(one => one.checkVisibility() && one.getClientRects().length)"


class BrowserError(Exception):
    pass


class Driver:
    """One chromedriver; browsers are sessions of it."""
    def __init__(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.process = subprocess.Popen([DRIVER, f"--port={self.port}"], stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        until(self.is_ready, "chromedriver")

    def is_ready(self):
        try:
            return self.ask("GET", "/status")["ready"]
        except OSError:
            return False

    def ask(self, method, path, body=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        try:
            connection.request(method, path, None if body is None else json.dumps(body),
                               {"Content-Type": "application/json"})
            value = json.loads(connection.getresponse().read())["value"]
        finally:
            connection.close()
        if isinstance(value, dict) and value.get("error"):
            raise BrowserError(f"{value['error']}: {value['message'].splitlines()[0]}")
        return value

    def browser(self, width=1280, height=900, dark=False, reduced_motion=False):
        return Browser(self, width, height, dark, reduced_motion)

    def close(self):
        self.process.terminate()
        self.process.wait(WAIT_S)


class Browser:
    def __init__(self, driver, width, height, dark, reduced_motion):
        arguments = ["--headless=new", "--disable-gpu", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars",
                     "--force-color-profile=srgb", "--no-first-run", "--disable-background-networking"]
        self.driver = driver
        told = driver.ask("POST", "/session", {"capabilities": {"alwaysMatch": {
            "goog:chromeOptions": {"binary": CHROMIUM, "args": arguments},
            "goog:loggingPrefs": {"browser": "ALL"}}}})
        self.session = f"/session/{told['sessionId']}"
        self.look(width, height, dark, reduced_motion)

    def look(self, width, height, dark=False, reduced_motion=False):
        """The size of the page, not of its window, and what the person prefers."""
        self.devtools("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                      mobile=False)
        self.devtools("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"},
            {"name": "prefers-reduced-motion", "value": "reduce" if reduced_motion else "no-preference"}])

    def ask(self, method, path, body=None):
        return self.driver.ask(method, self.session + path, body)

    def devtools(self, command, **parameters):
        return self.ask("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def open(self, url):
        self.ask("POST", "/url", {"url": url})

    def run(self, script, *arguments):
        """What the script returns: run("return document.title")."""
        return self.ask("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def run_async(self, script, *arguments):
        """What it hands to its last argument, a function."""
        return self.ask("POST", "/execute/async", {"script": script, "args": list(arguments)})

    def find(self, css):
        """The first that is shown, as soon as it is there."""
        return until(lambda: self.run(f"return {SHOWN} || null", css), f"'{css}' at {self.url()}")

    def click(self, css):
        """As soon as it can be clicked: the page learns of the robot's state in its own time."""
        until(lambda: not self.run("return arguments[0].disabled", self.find(css)), f"'{css}' to click")
        found = self.find(css)
        self.ask("POST", f"/element/{found[ELEMENT]}/click", {})

    def type(self, css, text):
        found = self.find(css)
        self.ask("POST", f"/element/{found[ELEMENT]}/clear", {})
        self.ask("POST", f"/element/{found[ELEMENT]}/value", {"text": text})

    def press(self, *keys):
        """To what has the focus, each down and up."""
        actions = [{"type": kind, "value": KEYS.get(key, key)} for key in keys for kind in ("keyDown", "keyUp")]
        self.ask("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": actions}]})

    def pointer(self, *actions):
        """("move", x, y), ("down",), ("up",)"""
        told = {"move": lambda x, y: {"type": "pointerMove", "x": int(x), "y": int(y), "duration": 0},
                "down": lambda: {"type": "pointerDown", "button": 0}, "up": lambda: {"type": "pointerUp", "button": 0}}
        self.ask("POST", "/actions", {"actions": [{"type": "pointer", "id": "mouse", "actions": [
            told[kind](*where) for kind, *where in actions]}]})

    def box(self, css):
        """{x, y, width, height} in the window"""
        return self.seen(css, "getBoundingClientRect().toJSON()")

    def text(self, css="body"):
        return self.seen(css, "innerText")

    def seen(self, css, what):
        """Found and looked at in one step: a page may draw the element anew between two."""
        script = f"const one = {SHOWN}; return one ? [one.{what}] : null"
        return until(lambda: self.run(script, css), f"'{css}' at {self.url()}")[0]

    def url(self):
        return self.ask("GET", "/url")

    def wait_for(self, words, css="body"):
        return until(lambda: words in (self.text(css) or ""), f"'{words}' in '{css}'",
                     lambda: self.text(css))

    def wait_for_report(self, *words):
        """What the player's page of the last replay says, once it says that; it is as high as what is in it."""
        inside = "return document.querySelector('.played iframe')?.contentDocument?.body?.innerText || ''"
        told = until(lambda: (text := self.run(inside)) and all(word in text for word in words) and text, words,
                     lambda: self.run(inside))
        until(lambda: self.run("const frame = document.querySelector('.played iframe');"
                               "return frame.offsetHeight >= frame.contentDocument.documentElement.scrollHeight"),
              "the whole report")
        return told

    def problems(self):
        """What the browser complained of: scripts that failed, what the content policy refused. Servers that are
        not there, and their errors, are the tests' own."""
        return [entry["message"] for entry in self.ask("POST", "/se/log", {"type": "browser"})
                if entry["level"] == "SEVERE" and entry["source"] != "network"]

    def screenshot(self, path):
        with open(path, "wb") as file:
            file.write(base64.b64decode(self.ask("GET", "/screenshot")))

    def close(self):
        self.ask("DELETE", "")


def until(look, what, found=lambda: ""):
    """The first that is true; the time of a busy machine is no failure."""
    end = time.monotonic() + WAIT_S
    while True:
        value = look()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError(f"{what} did not come about {found()}")
        time.sleep(0.02)
