#!/usr/bin/env python3
"""Opens a page in headless Chromium as a user would, on a wide screen and on a telephone, light and dark.

usage: check_page.py PAGE.html [FOLDER]

Fails (exit code 1) where the console has an error or a warning, the page asks for something from the network, it is
wider than the screen, an element has no size that should have one, or a click on a column's title does not sort.
Writes pictures of the whole page into FOLDER. Exit code 77: skipped, Chromium is not installed.
"""
import base64
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

WIDTHS = (1280, 400)


class Browser:
    """Chromium's DevTools protocol over its pipe: JSON messages that end with a NUL."""

    def __init__(self, program, profile):
        to_child, self.out = os.pipe()
        self.input, from_child = os.pipe()

        def as_3_and_4():
            # 3 may be one of the two, so both go out of the way first.
            spare = [os.dup2(to_child, 200), os.dup2(from_child, 201)]
            os.dup2(spare[0], 3)
            os.dup2(spare[1], 4)

        self.process = subprocess.Popen(
            [program, "--headless=new", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe",
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

    def evaluate(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        if "exceptionDetails" in result:
            sys.exit(f"error: {expression}: {result['exceptionDetails']}")
        return result["result"].get("value")

    def close(self):
        self.process.terminate()
        self.process.wait()


def complaints(events):
    found = []
    for event in events:
        method, parameters = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            found.append("exception: " + parameters["exceptionDetails"]["text"])
        elif method == "Runtime.consoleAPICalled":
            found.append("console: " + json.dumps(parameters["args"]))
        elif method == "Log.entryAdded":
            found.append(f"{parameters['entry']['level']}: {parameters['entry']['text']}"
                         f" {parameters['entry'].get('url', '')}")
        elif method == "Network.requestWillBeSent":
            url = parameters["request"]["url"]
            if not url.startswith(("file:", "data:")):
                found.append("asks for " + url)
    return found


# Sorts each table by each column, both ways, and looks whether the cells are in order.
SORT = """
(() => {
  const wrong = [];
  for (const table of document.querySelectorAll("table.sortable")) {
    const rows = table.tBodies[0].rows.length;
    for (const title of table.tHead.rows[0].cells) {
      const button = title.querySelector("button");
      if (!button) continue;
      for (const direction of ["ascending", "descending"]) {
        button.click();
        if (title.getAttribute("aria-sort") !== direction) wrong.push(`${table.id}: ${title.textContent} is not ${direction}`);
        const numbers = [...table.tBodies[0].rows].map((row) => row.cells[title.cellIndex].querySelector("data"))
          .filter((data) => data).map((data) => Number(data.value));
        const sorted = [...numbers].sort((a, b) => direction === "ascending" ? a - b : b - a);
        if (String(numbers) !== String(sorted)) wrong.push(`${table.id}: ${title.textContent} ${direction}: ${numbers}`);
      }
    }
    if (table.tBodies[0].rows.length !== rows) wrong.push(`${table.id}: rows are lost`);
  }
  return wrong;
})()
"""

# Texts of figures that lie outside of their figure, or on each other.
TEXTS = """
(() => {
  const wrong = [];
  for (const figure of document.querySelectorAll("svg.figure")) {
    const frame = figure.getBoundingClientRect();
    if (!frame.width) continue;
    const boxes = [...figure.querySelectorAll("text")].map((text) => [text.textContent, text.getBoundingClientRect()]);
    boxes.forEach(([text, box], i) => {
      if (box.left < frame.left - 10 || box.right > frame.right + 10) wrong.push(`"${text}" sticks out of ${figure.ariaLabel}`);
      for (const [other, b] of boxes.slice(i + 1)) {
        if (box.left < b.right && b.left < box.right && box.top + 2 < b.bottom && b.top + 2 < box.bottom) {
          wrong.push(`"${text}" on "${other}" in ${figure.ariaLabel}`);
        }
      }
    });
  }
  return wrong;
})()
"""


def check(browser, url, width, scheme, folder):
    browser.events.clear()
    browser.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1,
                 mobile=width < 600)
    browser.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
    browser.call("Page.navigate", url=url)
    browser.wait_for("Page.loadEventFired")
    browser.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = false; })")
    found = []
    if browser.evaluate("innerWidth") != width:
        found.append(f"the window is {browser.evaluate('innerWidth')} pixels wide")

    def picture(name):
        if folder:
            image = browser.call("Page.captureScreenshot", captureBeyondViewport=True)["data"]
            (folder / f"{name}.png").write_bytes(base64.b64decode(image))

    picture(f"{width}-{scheme}")
    browser.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    picture(f"{width}-{scheme}-open")
    page_width = browser.evaluate("document.documentElement.scrollWidth")
    if page_width > width:
        found.append(f"{page_width} pixels wide")
    found += browser.evaluate(TEXTS) + browser.evaluate(SORT)
    return [f"{width} {scheme}: {complaint}" for complaint in found + complaints(browser.events)]


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: check_page.py PAGE.html [FOLDER]")
    program = shutil.which("chromium")
    if not program:
        print("skipped: this check needs chromium (apt-get install chromium)")
        sys.exit(77)
    page = pathlib.Path(sys.argv[1]).resolve(strict=True)
    folder = pathlib.Path(sys.argv[2]) if len(sys.argv) == 3 else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(program, profile)
        try:
            for domain in ("Page", "Runtime", "Log", "Network"):
                browser.call(f"{domain}.enable")
            found = [complaint for width in WIDTHS for scheme in ("light", "dark")
                     for complaint in check(browser, page.as_uri(), width, scheme, folder)]
        finally:
            browser.close()
    for complaint in found:
        print(complaint)
    print(f"{page.name}: {len(found)} complaints at widths {' and '.join(map(str, WIDTHS))}, light and dark")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
