"""Headless Firefox, driven by the WebDriver BiDi protocol that it speaks itself."""

import asyncio
import base64
import json
import re
import shutil
import subprocess
import threading
import time

from tornado.websocket import websocket_connect

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
LISTENS = re.compile(r"WebDriver BiDi listening on (ws://\S+)")
# Open shadow roots too, as the widgets have them.
FIND = """(selector) => {
  const found = []
  const roots = [document]
  while (roots.length > 0) {
    const root = roots.pop()
    found.push(...root.querySelectorAll(selector))
    for (const each of root.querySelectorAll("*")) {
      if (each.shadowRoot) roots.push(each.shadowRoot)
    }
  }
  return found
}"""


class Firefox:
    """One window, and all that it asked for and complained about.

    Parameters
    ----------
    profile : Path
        Empty folder of its own.
    """

    def __init__(self, profile):
        command = [FIREFOX, "--headless", "--no-remote", "--profile", str(profile)]
        command += ["--remote-debugging-port", "0", "about:blank"]
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        address = next(m[1] for line in self._process.stdout if (m := LISTENS.search(line)))
        self._loop = asyncio.new_event_loop()
        threading.Thread(target=self._loop.run_forever, daemon=True).start()
        self._number = 0
        self.requests, self.errors = [], []
        self._socket = self._wait(
            lambda: websocket_connect(f"{address}/session", max_message_size=2**26)
        )
        self._command("session.new", capabilities={})
        self._command("session.subscribe", events=["log.entryAdded", "network.beforeRequestSent"])
        (window,) = self._command("browsingContext.getTree")["contexts"]
        self._window = {"context": window["context"]}

    def open(self, url, width=1400, height=900):
        """Show a page; return when it has loaded."""
        viewport = {"width": width, "height": height}
        self._command("browsingContext.setViewport", **self._window, viewport=viewport)
        self._command("browsingContext.navigate", **self._window, url=url, wait="complete")

    def evaluate(self, expression):
        """Value of an expression, in which `find` looks for a selector in shadow roots too."""
        code = f"(() => {{ const find = {FIND}; return JSON.stringify({expression}) }})()"
        answer = self._command(
            "script.evaluate", expression=code, target=self._window, awaitPromise=True
        )
        assert answer["type"] == "success", answer
        return json.loads(answer["result"].get("value", "null"))

    def until(self, expression, patience_s=90.0):
        """Wait until an expression is true."""
        deadline = time.monotonic() + patience_s
        while not self.evaluate(expression):
            assert time.monotonic() < deadline, f"waited in vain until {expression}"
            time.sleep(0.1)

    def picture(self):
        """Return the window as PNG."""
        answer = self._command("browsingContext.captureScreenshot", **self._window)
        return base64.b64decode(answer["data"])

    def close(self):
        self._process.terminate()
        self._process.communicate(timeout=20)
        self._loop.call_soon_threadsafe(self._loop.stop)

    def _wait(self, begin):
        async def result():
            return await begin()

        return asyncio.run_coroutine_threadsafe(result(), self._loop).result(120)

    def _command(self, method, **parameters):
        self._number += 1
        message = {"id": self._number, "method": method, "params": parameters}
        self._wait(lambda: self._socket.write_message(json.dumps(message)))
        while True:
            answer = json.loads(self._wait(self._socket.read_message))
            if answer.get("id") == self._number:
                assert answer["type"] == "success", answer
                return answer["result"]
            self._note(answer)

    def _note(self, event):
        what = event.get("params", {})
        if event.get("method") == "network.beforeRequestSent":
            self.requests.append(what["request"]["url"])
        elif event.get("method") == "log.entryAdded" and what["level"] == "error":
            self.errors.append(what["text"])
