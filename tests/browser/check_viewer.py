#!/usr/bin/env python3
"""Opens a page with the viewer (a report, or a server's address) in headless Chromium and reads back what it
shows.

usage: check_viewer.py PAGE.html|URL RUN [FOLDER]

RUN is the folder of the run that the page shows first. Fails (exit code 1) if, according to the scene graph,
a body is not at its pose in the log's STATE; if a metric differs from the summary's; if a click on the
timeline leads to another tick; if an external name becomes markup; if the page is wider than the screen; if the
console is not empty; or if a packed page requests anything from outside itself. Writes images into FOLDER.
Exit code 77: skipped, Chromium is not installed.
"""
import base64
import json
import math
import pathlib
import re
import struct
import sys
import tempfile
import time
import zlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "python"))

from chromium import Browser, complaints, find_chromium, opened  # noqa: E402
from evalbus.log import read_log  # noqa: E402

SIZES = ((1280, 900), (400, 850), (2500, 1300))
# Half of the position resolution of 0.02 mm, plus the error of single precision.
POSITION_M, QUATERNION = 2e-5, 2e-4
# Factor from the unit of the summary to the unit that a curve shows.
SHOWN = {"mm": 1e3, "%": 1e2}
# Metrics that are computed at the end of an episode, so their curves have no value.
AT_THE_END = ("extended.spectral_arc_length", "extended.p95_object_force_N", "extended.p95_scene_force_N",
              "extended.p95_self_force_N")
HOSTILE = "<img src=x onerror=alert(1)><b>&amp;\u202e\u0007" + "long " * 40


def wait_until(browser, expression, what, limit_s=300):
    end = time.monotonic() + limit_s
    while not browser.evaluate(expression):
        if time.monotonic() > end:
            sys.exit(f"error: after {limit_s} s: {what}: {browser.evaluate('JSON.stringify(window.evalbusViewer && evalbusViewer.summary())')[:2000]}")
        # The page continues to render frames meanwhile. A headless page sends no event to wait for.
        browser.evaluate("new Promise((done) => requestAnimationFrame(() => done()))")


def open_page(browser, url, width, height, scheme, is_looked_at):
    browser.screen(width, height, scheme)
    browser.events.clear()
    browser.call("Page.navigate", url="about:blank")
    browser.wait_for("Page.loadEventFired")
    browser.events.clear()
    browser.call("Page.navigate", url=url)
    browser.wait_for("Page.loadEventFired")
    browser.evaluate("document.querySelector('[data-from]').scrollIntoView()")
    wait_until(browser, "Boolean(window.evalbusViewer && evalbusViewer.summary().hasImage)", "there is no image")
    if not is_looked_at:
        # The resolution does not matter here, and the processor has to render it.
        browser.evaluate("evalbusViewer.setLayer('shadows', false); evalbusViewer.scene.ratio = 0.3;"
                         " evalbusViewer.scene.resize()")


def shown(browser):
    return browser.evaluate("evalbusViewer.summary()")


def frame(browser):
    browser.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done())))")


def compare_poses(browser, log, tick, found):
    """Compares the pose of every body of MODEL. Returns how many were compared."""
    browser.evaluate(f"evalbusViewer.seek({tick})")
    frame(browser)
    return compare_drawn_poses(browser, "evalbusViewer.pose", log, tick, found)


def compare_drawn_poses(browser, pose_of, log, tick, found):
    state, model = log["EVALBUS_STATE"], log["EVALBUS_MODEL"]
    row = list(state["header"]["tick"]).index(tick)
    for body, name in enumerate(model["body_name"][0]):
        pose = browser.evaluate(f"{pose_of}({json.dumps(name)})")
        position = state["body"]["position_m"][row][body]
        quat = state["body"]["quat_wxyz"][row][body]
        away = max(abs(a - b) for a, b in zip(pose["position_m"], position))
        turned = 1 - abs(sum(a * b for a, b in zip(pose["quat_wxyz"], quat)))
        if not (away < POSITION_M and turned < QUATERNION):
            found.append(f"tick {tick}: {name} is at {pose}, not at {list(position)} {list(quat)}")
    return len(model["body_name"][0])


def numbers(value):
    """Returns a metric of a summary as a list of one number, or of one for each arm. Booleans become integers."""
    values = list(value.values()) if isinstance(value, dict) else [value]
    return [math.nan if one is None else float(one) for one in values]


def compare_values(browser, head, summary, found):
    """Checks that the curves have the summary's values at the last tick. Returns how many metrics were compared."""
    browser.evaluate("evalbusViewer.seek(1e9)")
    values = browser.evaluate(
        "JSON.stringify(Object.fromEntries(Object.entries(evalbusViewer.values()).map(([name, list]) =>"
        " [name, list.map((one) => Number.isNaN(one) ? null : one)])))")
    values = json.loads(values)
    compared = 0
    for curve in head["curves"]:
        metric, table = curve["name"], summary["metrics"]
        if metric.startswith("extended."):
            metric, table = metric[len("extended."):], summary["extended"]
        if metric not in table or curve["name"] in AT_THE_END:
            continue
        expected = [one * SHOWN.get(curve["unit"], 1) for one in numbers(table[metric])]
        got = [math.nan if one is None else one for one in values[curve["name"]]]
        same = len(got) == len(expected) and all(
            (math.isnan(a) and math.isnan(b)) or math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-9)
            for a, b in zip(got, expected))
        if not same:
            found.append(f"{curve['name']}: the page has {got}, the summary {expected}")
        compared += 1
    return compared


def press_time_line(browser, part):
    """Clicks the timeline at a fraction `part` of the episode."""
    place = browser.evaluate("""(() => {
      const t = evalbusViewer.timeline, box = t.slider.getBoundingClientRect(), track = evalbusViewer.tracks[0];
      t.slider.scrollIntoView({block: 'center'});
      const now = t.slider.getBoundingClientRect();
      return {x: now.left + t.xOf(%r * track.last * track.tickSeconds), y: now.top + 12, last: track.last};
    })()""" % part)
    for kind in ("mousePressed", "mouseReleased"):
        browser.call("Input.dispatchMouseEvent", type=kind, x=place["x"], y=place["y"], button="left", clickCount=1)
    return browser.evaluate("evalbusViewer.tick"), place["last"]


def check_percent(browser, found):
    """Compares the page's rounding of all rates with the integers that Percent.IsExactForAllRates expects of C++."""
    texts = browser.evaluate("Array.from({length: 200}, (_, i) => Array.from({length: i + 2}, (_, k) => Evalbus.percent(k / (i + 1))))")
    for n, row in enumerate(texts, 1):
        expected = [f"{(200 * k + n) // (2 * n)} %" for k in range(n + 1)]
        if row != expected:
            found.append(f"rates of {n} episodes are {row}, not {expected}")


def check_outline(browser, found):
    """Checks that the object of the current stage has an outline unless outlines are disabled, and keeps its color."""
    browser.evaluate("evalbusViewer.seek(0)")
    frame(browser)
    outlined = "[...evalbusViewer.scene.views[0].world.outlines.values()].flat().filter((mesh) => mesh.visible).length"
    shown = browser.evaluate(outlined)
    browser.evaluate("evalbusViewer.setLayer('highlight', false)")
    frame(browser)
    hidden = browser.evaluate(outlined)
    browser.evaluate("evalbusViewer.setLayer('highlight', true)")
    if not shown or hidden:
        found.append(f"{shown} meshes are outlined, and {hidden} without the highlight")


def check_conditions(browser, found):
    """Checks that conditions are unknown at tick 0, which is not evaluated, and known at the end."""
    for tick, is_known in ((0, False), (1e9, True)):
        browser.evaluate(f"evalbusViewer.seek({tick})")
        texts = browser.evaluate("[...document.querySelectorAll('.ev-holds')].map((one) => one.textContent)")
        if not texts or any((text != "–") != is_known for text in texts):
            found.append(f"the conditions at tick {tick} are {texts}")


def check_time(browser, log, found):
    tick, last = press_time_line(browser, 0.5)
    if abs(tick - last / 2) > 1 + last / 300:
        found.append(f"a press in the middle of {last} ticks leads to tick {tick}")
    compare_poses(browser, log, tick, found)
    # Tests the keys, which must not depend on the focused element.
    browser.evaluate("evalbusViewer.parts.app.tabIndex = -1; evalbusViewer.parts.app.focus()")
    for key, expected in (("ArrowRight", tick + 1), ("ArrowLeft", tick), ("Home", 0), ("End", last)):
        for kind in ("keyDown", "keyUp"):
            browser.call("Input.dispatchKeyEvent", type=kind, key=key, code=key)
        if browser.evaluate("evalbusViewer.tick") != expected:
            found.append(f"{key} leads to tick {browser.evaluate('evalbusViewer.tick')}, not {expected}")


def check_zoom(browser, found):
    """Zooms with a key and the wheel, resets with the button, and pins a curve."""
    browser.evaluate("evalbusViewer.seek(10); evalbusViewer.parts.app.focus()")
    end = browser.evaluate("evalbusViewer.timeline.end")
    for kind in ("keyDown", "keyUp"):
        browser.call("Input.dispatchKeyEvent", type=kind, key="+", code="Equal")
    frame(browser)
    span = browser.evaluate("evalbusViewer.timeline.to - evalbusViewer.timeline.from")
    if not math.isclose(span, end / 2):
        found.append(f"the key + shows {span} of {end} s")
    place = browser.evaluate("(() => { const b = evalbusViewer.timeline.slider.getBoundingClientRect();"
                             " return {x: b.left + b.width / 2, y: b.top + 12}; })()")
    # modifiers 2: Ctrl, because a report scrolls.
    browser.call("Input.dispatchMouseEvent", type="mouseWheel", deltaX=0, deltaY=-100, modifiers=2, **place)
    wait_until(browser, f"evalbusViewer.timeline.to - evalbusViewer.timeline.from < {span * 0.9}", "the wheel does not zoom", 20)
    tick, _ = press_time_line(browser, 0.25)
    browser.evaluate("evalbusViewer.timeline.whole.click()")
    frame(browser)
    if browser.evaluate("evalbusViewer.timeline.view") is not None or browser.evaluate("evalbusViewer.timeline.whole.hidden") is not True:
        found.append("the button does not show the whole episode")
    lanes = "evalbusViewer.timeline.lanes.length"
    before = browser.evaluate(lanes)
    browser.evaluate("evalbusViewer.curves.cards[0].pin.click()")
    if browser.evaluate(lanes) != before + 1:
        found.append("a pinned curve is not on the timeline")
    browser.evaluate("evalbusViewer.curves.cards[0].pin.click()")


def check_pointed(browser, log, found):
    """Checks that the timeline shows the scene at the pointer's time until the pointer leaves or drags."""
    pose_of = "evalbusViewer.pose.bind({scene: evalbusViewer.thumbnails.scene})"
    is_ready = "Boolean(document.querySelector('.ev-time-image:not([hidden]) .ev-ready'))"
    is_over = "document.querySelector('.ev-time-image').hidden && !evalbusViewer.thumbnails.isPlaying"
    requests = len(browser.events)
    browser.evaluate("evalbusViewer.seek(0)")

    def move(part):
        place = browser.evaluate("""(() => {
          const t = evalbusViewer.timeline, box = t.slider.getBoundingClientRect();
          return {x: box.left + t.xOf(%r * t.end), y: box.top + 12};
        })()""" % part)
        browser.call("Input.dispatchMouseEvent", type="mouseMoved", **place)
        return place

    for part in (0.25, 0.7):
        move(part)
        wait_until(browser, is_ready, "the timeline shows no image")
        frame(browser)
        tick = browser.evaluate("Math.round(evalbusViewer.timeline.pointed / evalbusViewer.tracks[0].tickSeconds)")
        compare_drawn_poses(browser, pose_of, log, tick, found)
        if browser.evaluate("evalbusViewer.tick") != 0:
            found.append("the pointer above the timeline moves the scene")
    place = move(0.5)
    browser.call("Input.dispatchMouseEvent", type="mousePressed", button="left", clickCount=1, **place)
    if not browser.evaluate(is_over):
        found.append("the timeline shows an image while it is dragged")
    browser.call("Input.dispatchMouseEvent", type="mouseReleased", button="left", clickCount=1, **place)
    move(0.6)
    wait_until(browser, is_ready, "the timeline shows no image after a click")
    browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=2, y=2)
    if not browser.evaluate(is_over):
        found.append("the image stays when the pointer has left the timeline")
    asked = [one["params"]["request"]["url"] for one in browser.events[requests:] if one.get("method") == "Network.requestWillBeSent"]
    if any("/episode/" in url for url in asked):
        found.append(f"the image of an open episode requests {asked}")


def check_metrics(browser, found):
    """Checks that the filter keeps matching metrics, that constant ones are folded, and that none is repeated."""
    names = browser.evaluate("""(() => {
      const curves = evalbusViewer.curves;
      curves.filter.value = 'slip';
      curves.applyFilter();
      const left = curves.cards.filter((card) => !card.node.hidden).map((card) => card.name);
      curves.filter.value = '';
      curves.applyFilter();
      return {left, constant: [...curves.constantGrid.children].length, changing: [...curves.grid.children].length,
              all: curves.cards.length};
    })()""")
    if not names["left"] or any("slip" not in name for name in names["left"]):
        found.append(f"the filter 'slip' leaves {names['left']}")
    if not names["constant"] or names["constant"] + names["changing"] != names["all"]:
        found.append(f"of {names['all']} metrics, {names['constant']} are folded and {names['changing']} are not")


def check_tab_stops(browser, found):
    """Checks that a metric is one stop of the Tab key, and that shift Enter pins it."""
    stops = browser.evaluate("evalbusViewer.curves.cards.map((card) => [...card.node.querySelectorAll('*')].filter((one) => one.tabIndex >= 0).length)")
    if set(stops) != {1}:
        found.append(f"the metrics have {stops} stops of the Tab key")
    browser.call("Emulation.setFocusEmulationEnabled", enabled=True)
    pins = "evalbusViewer.curves.pins.map((card) => card.name)"
    name = browser.evaluate("evalbusViewer.curves.cards[1].label.focus(), evalbusViewer.curves.cards[1].name")
    for expected in ([name], []):
        browser.call("Input.dispatchKeyEvent", type="keyDown", key="Enter", code="Enter", text="\r", modifiers=8)
        browser.call("Input.dispatchKeyEvent", type="keyUp", key="Enter", code="Enter", modifiers=8)
        if browser.evaluate(pins) != expected or browser.evaluate("evalbusViewer.curves.cards[1].isLarge"):
            found.append(f"shift Enter pins {browser.evaluate(pins)}, not {expected}, or enlarges the metric")
    browser.evaluate("document.activeElement.blur()")
    browser.call("Emulation.setFocusEmulationEnabled", enabled=False)


def check_address(browser, found):
    """Checks that dragging writes the address at a rate that browsers allow, and that the last time is in it."""
    written = browser.evaluate("""(async () => {
      const old = history.replaceState;
      let count = 0;
      history.replaceState = function (...all) { ++count; return old.apply(this, all); };
      for (let tick = 1; tick <= 40; ++tick) evalbusViewer.seek(tick);
      const early = count;
      await new Promise((done) => setTimeout(done, 2 * Evalbus.FragmentWriter.PAUSE_MS));
      history.replaceState = old;
      const time = (40 * evalbusViewer.tracks[0].tickSeconds).toFixed(3);
      return {early, count, isLast: location.hash.includes(`t=${time}`)};
    })()""")
    if written["early"] > 1 or written["count"] > 2 or not written["isLast"]:
        found.append(f"40 moves of the time write the address as {written}")


def check_graphics_memory(browser, found):
    """Checks that a scene that replaces another one leaves no graphics objects behind."""
    kept = browser.evaluate("""(async () => {
      const gl = WebGL2RenderingContext.prototype, kept = {}, old = {};
      for (const kind of ["Buffer", "Texture", "Framebuffer", "Renderbuffer", "Program", "Shader"]) {
        kept[kind] = 0;
        for (const [what, sign] of [["create", 1], ["delete", -1]]) {
          const name = what + kind, before = old[name] = gl[name];
          gl[name] = function (...all) { kept[kind] += all[0] === null ? 0 : sign; return before.apply(this, all); };
        }
      }
      const { scene } = evalbusViewer;
      const adapt = scene.adapt, hadShadows = scene.layers.shadows;
      scene.adapt = () => {};
      evalbusViewer.setLayer("shadows", true);
      const after = [];
      for (let turn = 0; turn < 3; ++turn) {
        await evalbusViewer.buildScene();
        for (const tick of [0, 1e9]) {
          evalbusViewer.seek(tick);
          scene.draw();
        }
        after.push({ ...kept });
      }
      Object.assign(gl, old);
      delete scene.adapt;
      evalbusViewer.setLayer("shadows", hadShadows);
      return after;
    })()""")
    if kept[1] != kept[2]:
        found.append(f"a new scene leaves graphics objects behind: {kept}")


def check_touch(browser, found):
    """Checks that a finger that moves up on the image scrolls a page that scrolls, and that it rotates the scene sideways."""
    browser.screen(400, 850, "light")
    browser.call("Emulation.setTouchEmulationEnabled", enabled=True)
    # With damping, the rotation would continue during the next movement.
    browser.evaluate("document.querySelector('.ev-view').scrollIntoView({block: 'center'}); evalbusViewer.scene.controls.enableDamping = false")
    frame(browser)
    state = "[scrollY, ...evalbusViewer.scene.camera.position.toArray()]"
    place = browser.evaluate("(() => { const b = document.querySelector('.ev-canvas').getBoundingClientRect();"
                             " return {x: b.left + b.width / 2, y: b.top + b.height / 2}; })()")
    for dx, dy in ((-60, 0), (0, -60)):
        before = browser.evaluate(state)
        browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[place])
        for k in range(1, 7):
            browser.call("Input.dispatchTouchEvent", type="touchMove",
                         touchPoints=[{"x": place["x"] + k * dx / 6, "y": place["y"] + k * dy / 6}])
        browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        frame(browser)
        after = browser.evaluate(state)
        is_scrolled, is_rotated = after[0] != before[0], math.dist(before[1:], after[1:]) > 0.01
        if [is_scrolled, is_rotated] != [dy != 0, dx != 0]:
            found.append(f"a finger that moves by ({dx}, {dy}) scrolls: {is_scrolled}, rotates: {is_rotated}")
    browser.evaluate("evalbusViewer.scene.controls.enableDamping = true")
    browser.call("Emulation.setTouchEmulationEnabled", enabled=False)
    browser.screen(1280, 900, "light")


def check_play(browser, found):
    browser.evaluate("evalbusViewer.seek(0); evalbusViewer.togglePlay()")
    wait_until(browser, "evalbusViewer.tick > 10", "it does not play", 20)
    browser.evaluate("evalbusViewer.togglePlay()")
    tick = browser.evaluate("evalbusViewer.tick")
    frame(browser)
    if browser.evaluate("evalbusViewer.tick") != tick:
        found.append("it continues while it is paused")


def check_sizes(browser, folder, found):
    """Checks the layout of the open page."""
    for width, height in SIZES:
        for scheme in ("light", "dark"):
            browser.screen(width, height, scheme)
            browser.evaluate("document.querySelector('[data-from]').scrollIntoView()")
            frame(browser)
            page = browser.evaluate("document.documentElement.scrollWidth")
            if page > width:
                found.append(f"{scheme}: {page} pixels wide on a screen of {width}")
            if browser.evaluate("document.querySelector('.ev-view').clientHeight") < 150:
                found.append(f"{width} {scheme}: nearly no image")
            tops = browser.evaluate("['.ev-conditions', '.ev-run', '.ev-metrics'].map((one) => document.querySelector(one).getBoundingClientRect().top)")
            if width < 820 and tops != sorted(tops):
                found.append(f"{width} {scheme}: the run is not between the outcome and the metrics: {tops}")
            if folder:
                browser.image(folder / f"viewer-{width}-{scheme}.png")


def own_addresses(url):
    own = ("file:", "data:", "blob:", "about:")
    return own if url.startswith("file:") else (*own, url.split("#")[0], url.split("#")[0].replace("http:", "ws:"))


def poisoned(text):
    """Returns the page with every external text in its blocks replaced by a hostile one."""
    def words(value, key=None):
        if isinstance(value, dict):
            return {k: words(v, k) for k, v in value.items()}
        if isinstance(value, list):
            return [words(one, key) for one in value]
        keep = ("block", "type", "shape", "scene", "mesh", "texture", "kind", "comparison", "clock", "interval_kind",
                "unit", "png")
        return HOSTILE if isinstance(value, str) and value and key not in keep else value

    def replace(match):
        raw = zlib.decompress(base64.b64decode(match[2]))
        length = struct.unpack("<I", raw[:4])[0]
        head = json.loads(raw[4:4 + length])
        if head["block"] in ("mesh", "texture"):
            return match[0]
        arrays = head.pop("arrays", {})
        head = {**words(head), "arrays": arrays}
        changed = json.dumps(head).encode()
        bytes_ = struct.pack("<I", len(changed)) + changed
        bytes_ += b"\0" * (-len(bytes_) % 8) + raw[-(-(4 + length) // 8) * 8:]
        return match[1] + base64.b64encode(zlib.compress(bytes_)).decode() + match[3]

    pattern = r'(<script[^>]*type="application/x-evalbus"[^>]*>)([^<]*)(</script>)'
    changed, count = re.subn(pattern, replace, text)
    if not count:
        sys.exit("error: the page has no blocks")
    return changed


def check_hostile(browser, page, folder, is_looked_at, found):
    poisoned_page = folder / "poisoned.html"
    poisoned_page.write_text(poisoned(page.read_text(encoding="utf-8")), encoding="utf-8")
    open_page(browser, poisoned_page.as_uri(), 1280, 900, "light", is_looked_at)
    browser.evaluate("evalbusViewer.parts.runTab.click()")
    for width in (1280, 400):
        browser.screen(width, 900, "light")
        frame(browser)
        if browser.evaluate("document.querySelectorAll('.evalbus-viewer :is(img, script, iframe)').length"):
            found.append("a name has become markup")
        text = browser.evaluate("document.querySelector('.ev-title').textContent")
        if "<img src=x" not in text or any(ord(c) < 32 or c == "\u202e" for c in text):
            found.append(f"a hostile name is shown as {text!r}")
        page_width = browser.evaluate("document.documentElement.scrollWidth")
        if page_width > width:
            found.append(f"long names make the page {page_width} pixels wide on a screen of {width}")
        browser.image(folder / f"hostile-{width}.png")
    found += [f"hostile: {one}" for one in complaints(browser.events, own_addresses("file:"))]


def check_without_gl(program, url, profile, found):
    """Checks that numbers and timeline work without WebGL, and that a line states why there is no image."""
    browser = Browser(program, profile, ("--disable-gpu", "--disable-3d-apis"))
    try:
        for domain in ("Page", "Runtime"):
            browser.call(f"{domain}.enable")
        browser.screen(1280, 900, "light")
        browser.call("Page.navigate", url=url)
        browser.wait_for("Page.loadEventFired")
        browser.evaluate("document.querySelector('[data-from]').scrollIntoView()")
        wait_until(browser, "Boolean(window.evalbusViewer && evalbusViewer.summary().note.includes('WebGL'))",
                   "the page does not report that there is no image")
        browser.evaluate("evalbusViewer.seek(5)")
        if browser.evaluate("evalbusViewer.tick") != 5 or not browser.evaluate("Object.keys(evalbusViewer.values()).length"):
            found.append("without WebGL there are no numbers")
        found += [f"without WebGL: {one}" for one in complaints(browser.events)]
    finally:
        browser.close()


def check(browser, url, run, folder, found):
    open_page(browser, url, 1280, 900, "light", folder is not None)
    head = shown(browser)["heads"][0]
    # Shows one episode if two are compared.
    browser.evaluate("evalbusViewer.compare(null)")
    episode = run / "episodes" / f"{head['episode']:04d}"
    wait_until(browser, "evalbusViewer.summary().hasImage", "there is no image")
    log = read_log(episode / "events.lcmlog")
    ticks = list(log["EVALBUS_STATE"]["header"]["tick"])
    if head["ticks"] != ticks[-1] + 1:
        found.append(f"{head['ticks']} ticks, the log has {ticks[-1] + 1}")
    bodies = 0
    for tick in (0, ticks[len(ticks) // 3], ticks[-1]):
        bodies += compare_poses(browser, log, tick, found)
    metrics = compare_values(browser, head, json.loads((episode / "summary.json").read_text()), found)
    if bodies < 3 or metrics < 20:
        found.append(f"only {bodies} poses and {metrics} metrics were compared")
    check_percent(browser, found)
    check_outline(browser, found)
    found += browser.evaluate((pathlib.Path(__file__).parent / "page_functions.js").read_text())
    check_metrics(browser, found)
    check_conditions(browser, found)
    check_time(browser, log, found)
    check_zoom(browser, found)
    check_pointed(browser, log, found)
    check_tab_stops(browser, found)
    check_address(browser, found)
    check_graphics_memory(browser, found)
    check_touch(browser, found)
    check_play(browser, found)
    check_sizes(browser, folder, found)
    found += complaints(browser.events, own_addresses(url))
    return bodies, metrics


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit("usage: check_viewer.py PAGE.html|URL RUN [FOLDER]")
    program = find_chromium()
    is_page = not sys.argv[1].startswith("http")
    url = pathlib.Path(sys.argv[1]).resolve(strict=True).as_uri() if is_page else sys.argv[1]
    run = pathlib.Path(sys.argv[2])
    folder = pathlib.Path(sys.argv[3]) if len(sys.argv) == 4 else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    found = []
    with opened(program) as browser, tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as scratch:
        bodies, metrics = check(browser, url, run, folder, found)
        if is_page:
            check_hostile(browser, pathlib.Path(sys.argv[1]), folder or pathlib.Path(scratch), folder is not None, found)
    if is_page:
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
            check_without_gl(program, url, profile, found)
    for one in found:
        print(one)
    print(f"{sys.argv[1]}: {len(found)} complaints; {bodies} poses and {metrics} metrics compared")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
