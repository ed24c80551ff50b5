"""Headless Chromium, operated as a user would do it. Needs no Python package."""
import base64
import contextlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile


# The processor renders WebGL, for pages with 3D images.
SOFTWARE_GL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist")


class Browser:
    """Chromium's DevTools protocol over its pipe: JSON messages that end with a NUL."""

    def __init__(self, program, profile, flags=("--disable-gpu",)):
        to_child, self.out = os.pipe()
        self.input, from_child = os.pipe()

        def as_3_and_4():
            # One of the two descriptors may be 3, so both are moved first.
            spare = [os.dup2(to_child, 200), os.dup2(from_child, 201)]
            os.dup2(spare[0], 3)
            os.dup2(spare[1], 4)

        self.process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", *flags, "--remote-debugging-pipe",
             "--hide-scrollbars", "--no-first-run", f"--user-data-dir={profile}", "about:blank"],
            preexec_fn=as_3_and_4, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_child)
        os.close(from_child)
        self.buffer = b""
        self.count = 0
        self.events = []
        targets = self.call("Target.getTargets")["targetInfos"]
        page = next(target for target in targets if target["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]

    session = None

    def receive(self):
        while b"\0" not in self.buffer:
            data = os.read(self.input, 1 << 16)
            if not data:
                sys.exit("error: Chromium ended")
            self.buffer += data
        message, self.buffer = self.buffer.split(b"\0", 1)
        return json.loads(message)

    def call(self, method, **parameters):
        self.count += 1
        message = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self.receive()
            if answer.get("id") == self.count:
                if "error" in answer:
                    sys.exit(f"error: {method}: {answer['error']['message']}")
                return answer["result"]
            self.events.append(answer)

    def wait_for(self, method):
        while not any(event.get("method") == method for event in self.events):
            self.events.append(self.receive())

    # Evaluates the expression and awaits a promise.
    def evaluate(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in result:
            sys.exit(f"error: {expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    # Writes the visible part of the page, or the `whole` page, as PNG into the file.
    def image(self, file, whole=False):
        image = self.call("Page.captureScreenshot", captureBeyondViewport=whole)["data"]
        pathlib.Path(file).write_bytes(base64.b64decode(image))

    def screen(self, width, height, scheme):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                  mobile=width < 600)
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def close(self):
        self.process.terminate()
        self.process.wait()


def find_chromium():
    """Returns Chromium's program; exits with code 77 (skipped) if there is none."""
    program = shutil.which("chromium")
    if not program:
        print("skipped: this check needs chromium (apt-get install chromium)")
        sys.exit(77)
    return program


@contextlib.contextmanager
def opened(program):
    """Yields a browser with 3D images, which reports the events of page, scripts, log and network."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(program, profile, SOFTWARE_GL)
        try:
            for domain in ("Page", "Runtime", "Log", "Network"):
                browser.call(f"{domain}.enable")
            yield browser
        finally:
            browser.close()


# Returns the page's errors and warnings, and its requests outside itself and its `own` addresses.
def complaints(events, own=("file:", "data:", "blob:")):
    found = []
    for event in events:
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            found.append("exception: " + parameters["exceptionDetails"]["text"])
        elif method == "Runtime.consoleAPICalled":
            found.append("console: " + json.dumps(parameters["args"]))
        elif method == "Log.entryAdded":
            # The driver warns that reading back software-rendered images is slow.
            if "GL Driver Message (OpenGL, Performance" in parameters["entry"]["text"]:
                continue
            found.append(f"{parameters['entry']['level']}: {parameters['entry']['text']}"
                         f" {parameters['entry'].get('url', '')}")
        elif method == "Network.requestWillBeSent":
            url = parameters["request"]["url"]
            if not url.startswith(own):
                found.append("asks for " + url)
    return found
