"""Helper: a page in headless Chromium, driven over DevTools' pipe, with no network of its own."""

import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import time

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
APART = ["unshare", "--user", "--map-root-user", "--net"]
FLAGS = [
    "--headless=new",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--hide-scrollbars",
]
FLAGS += ["--disable-background-networking", "--disable-component-update", "--host-resolver-rules=MAP * ~NOTFOUND"]
FLAGS += ["--remote-debugging-pipe", "--window-size=1280,1100"]
SECONDS = 60.0  # for an answer
KEY_CODES = {"Tab": 9, "Enter": 13, "PageUp": 33, "PageDown": 34, "End": 35, "Home": 36}
KEY_CODES |= {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40}


def apart():
    """Prefix of a command that then has no network; empty if the system has no namespaces."""
    possible = shutil.which("unshare") and subprocess.run([*APART, "true"], capture_output=True).returncode == 0
    return APART if possible else []


def high_pipe():
    """A pipe whose file descriptors are not 3 or 4, which DevTools takes."""
    low = os.pipe()
    high = [fcntl.fcntl(number, fcntl.F_DUPFD_CLOEXEC, 10) for number in low]
    for number in low:
        os.close(number)
    return high


class Page:
    """A page. `requests` lists the addresses that it asked for, `complaints` the errors in its console."""

    def __init__(self, folder, *flags, sees_this_machine=False):
        if sees_this_machine:  # the last rule counts
            flags += ("--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",)
        asked, self._ask = high_pipe()
        self._told, tells = high_pipe()
        words = [
            *(() if sees_this_machine else apart()),
            CHROMIUM,
            f"--user-data-dir={folder}",
            *FLAGS,
            *flags,
            "about:blank",
        ]
        plumbing = f'exec 3<&{asked} 4>&{tells} {asked}<&- {tells}>&-; exec "$@"'  # DevTools' pipe is 3 and 4
        self._process = subprocess.Popen(
            ["bash", "-c", plumbing, "bash", *words],
            pass_fds=(asked, tells),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(asked)
        os.close(tells)
        self._rest, self._count, self._session = b"", 0, None
        self._loaded, self.requests, self.complaints = False, [], []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.ask("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method, **params):
        """Send a command, and return its answer."""
        self._count += 1
        message = {"id": self._count, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._ask, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._count:
                assert "error" not in answer, (method, answer["error"])
                return answer["result"]

    def _next(self):
        """The next message; an event is noted."""
        end = time.monotonic() + SECONDS
        while b"\0" not in self._rest:
            assert select.select([self._told], [], [], max(0.0, end - time.monotonic()))[0], "Chromium does not answer"
            part = os.read(self._told, 1 << 20)
            assert part, "Chromium has ended"
            self._rest += part
        text, self._rest = self._rest.split(b"\0", 1)
        message = json.loads(text)
        self._note(message.get("method"), message.get("params", {}))
        return message

    def _note(self, method, told):
        if method == "Network.requestWillBeSent":
            self.requests.append(told["request"]["url"])
        elif method == "Page.loadEventFired":
            self._loaded = True
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(told["exceptionDetails"].get("exception", told["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning", "assert"):
            self.complaints.append([each.get("value", each.get("description")) for each in told["args"]])
        elif method == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning"):
            self.complaints.append(told["entry"])

    def open(self, url):
        """Load a page, and wait until it is there."""
        self._loaded = False
        failed = self.ask("Page.navigate", url=url).get("errorText")
        assert not failed, (url, failed)
        while not self._loaded:
            self._next()

    def value(self, expression):
        """Value of an expression in the page; a promise is waited for."""
        answer = self.ask("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def drag(self, *places):
        """Press the mouse at the first place, move it over the others, and let it go."""
        kinds = ["mousePressed", *["mouseMoved"] * (len(places) - 1), "mouseReleased"]
        for kind, (x, y) in zip(kinds, [*places, places[-1]], strict=True):
            self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=1, clickCount=1)

    def press(self, keys):
        """Press a key and let it go: its name in the browser or its letter, after Shift or Control, as "Shift Tab"."""
        *held, key = keys.split(" ") if keys != " " else [keys]
        event = {"key": key, "windowsVirtualKeyCode": KEY_CODES.get(key, ord(key[0].upper()))}
        event["modifiers"] = sum({"Control": 2, "Shift": 8}[name] for name in held)
        self.ask("Input.dispatchKeyEvent", type="keyDown", **event, **({"text": key} if len(key) == 1 else {}))
        self.ask("Input.dispatchKeyEvent", type="keyUp", **event)

    def picture(self, path):
        """Write what the window shows as PNG."""
        path.write_bytes(base64.b64decode(self.ask("Page.captureScreenshot", format="png")["data"]))

    def close(self):
        """End Chromium."""
        self._session = None
        self.ask("Browser.close")
        os.close(self._ask)
        os.close(self._told)
        self._process.wait(10)
