# SPDX-License-Identifier: GPL-3.0-or-later
"""A headless Chromium that a test talks to, by Chrome's DevTools Protocol over a pipe: tests that
wait for the page, or give it files, need it."""

import base64
import html
import itertools
import json
import os
import re
import select
import subprocess
import time

_FLAGS = (
    "--headless=new --no-sandbox --disable-dev-shm-usage --no-first-run "
    "--use-angle=swiftshader --enable-unsafe-swiftshader"
).split()


def found_by_page(program, profile, address):
    """The JSON that a page leaves in <pre id="found"> when it has loaded, and what the browser
    reported, by lines."""
    command = [program, *_FLAGS, "--enable-logging=stderr", "--dump-dom"]
    command += [f"--user-data-dir={profile}", address]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    found = re.search(r'<pre id="found">(.+?)</pre>', done.stdout, re.S)
    assert found, done.stderr[-2000:]
    return json.loads(html.unescape(found[1])), done.stderr.splitlines()


class Browser:
    """One page. `console` has what it reported: errors, warnings and exceptions; `events` the names
    of all events."""

    def __init__(self, program, profile):
        to_browser, self._write = os.pipe()
        self._read, from_browser = os.pipe()
        # Chromium reads from descriptor 3 and writes to 4.
        shell = f'exec "$@" 3<&{to_browser} 4>&{from_browser}'
        command = ["bash", "-c", shell, "browser", program, *_FLAGS, "--hide-scrollbars"]
        command += ["--remote-debugging-pipe", f"--user-data-dir={profile}"]
        self._process = subprocess.Popen(
            [*command, "about:blank"],
            pass_fds=(to_browser, from_browser),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_browser)
        os.close(from_browser)
        self._numbers, self._bytes, self._session = itertools.count(1), b"", None
        self.console, self.events = [], []
        pages = self.call("Target.getTargets")["targetInfos"]
        target = next(p["targetId"] for p in pages if p["type"] == "page")
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "DOM"):
            self.call(f"{domain}.enable")

    def close(self):
        self._process.terminate()
        self._process.wait(timeout=30)
        os.close(self._write)
        os.close(self._read)

    def _message(self, until):
        while b"\0" not in self._bytes:
            left = until - time.monotonic()
            if left <= 0 or not select.select([self._read], [], [], left)[0]:
                raise TimeoutError("the browser did not answer")
            part = os.read(self._read, 1 << 20)
            if not part:
                raise EOFError("the browser ended")
            self._bytes += part
        first, self._bytes = self._bytes.split(b"\0", 1)
        return json.loads(first)

    def _note(self, message):
        method, given = message.get("method"), message.get("params")
        self.events.append(method)
        if method == "Runtime.exceptionThrown":
            self.console.append(given["exceptionDetails"])
        elif method == "Runtime.consoleAPICalled" or (
            method == "Log.entryAdded" and given["entry"]["level"] in ("error", "warning")
        ):
            self.console.append(given)

    def call(self, method, timeout=60, **parameters):
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._write, json.dumps(message).encode() + b"\0")
        until = time.monotonic() + timeout
        while True:
            found = self._message(until)
            if found.get("id") == number:
                assert "error" not in found, (method, found["error"])
                return found["result"]
            self._note(found)

    def open(self, address):
        self.call("Page.navigate", url=address)
        self.wait_for("document.readyState === 'complete'")

    def run(self, script, timeout=60):
        """The value of an expression, or of the promise that it is."""
        found = self.call(
            "Runtime.evaluate",
            timeout,
            expression=script,
            awaitPromise=True,
            returnByValue=True,
        )
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def wait_for(self, condition, timeout=60):
        until = time.monotonic() + timeout
        while not self.run(condition):
            assert time.monotonic() < until, f"never true: {condition}"
            time.sleep(0.05)

    def choose(self, field, *files):
        """Puts files into a field for files, as its dialog does."""
        root = self.call("DOM.getDocument")["root"]["nodeId"]
        node = self.call("DOM.querySelector", nodeId=root, selector=field)["nodeId"]
        self.call("DOM.setFileInputFiles", nodeId=node, files=[str(f) for f in files])

    def press_enter(self):
        key = {"key": "Enter", "code": "Enter", "windowsVirtualKeyCode": 13, "text": "\r"}
        self.call("Input.dispatchKeyEvent", type="keyDown", **key)
        self.call("Input.dispatchKeyEvent", type="keyUp", **key)

    def drop(self, *files, x=200, y=200):
        """Drops files on the page, as a file manager does."""
        data = {"items": [], "files": [str(f) for f in files], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.call("Input.dispatchDragEvent", type=kind, x=x, y=y, data=data)

    def resize(self, width, height):
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )

    def screenshot(self, file):
        """The whole page, also what is below the window's end."""
        found = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        file.write_bytes(base64.b64decode(found["data"]))
