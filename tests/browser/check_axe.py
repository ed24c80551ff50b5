#!/usr/bin/env python3
"""Checks pages with the accessibility rules of axe-core in headless Chromium.

usage: check_axe.py AXE.js EVALBUS RUN RUN [PAGE.html...]

Opens each PAGE, and the views of `evalbus web RUN RUN`: with a light and a dark theme, 1280 pixels wide, and 390
pixels wide. Fails (exit code 1) if a rule of WCAG 2.2 (A, AA) or of axe's best practices is violated. Exit code 77:
skipped, Chromium is not installed.
"""
import pathlib
import sys

from check_board import VIEWS, open_url, press, served
from check_viewer import frame, wait_until
from chromium import find_chromium, opened

SCREENS = ((1280, "light"), (1280, "dark"), (390, "light"))
AXE = """
axe.run(document, {runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22a", "wcag22aa", "best-practice"],
                   rules: {"target-size": {enabled: true}}, resultTypes: ["violations"]})
  .then(({violations}) => violations.flatMap((one) => one.nodes.map((node) => `${one.id}: ${node.target} ${node.html.slice(0, 160)}`)))
"""
PLAYER = "evalbusViewer.summary().hasImage"
# Name of a view of `evalbus web`, the address that opens it, a key that is pressed, and the condition that it is shown.
WEB = (("overview", "#/board", None, f"{VIEWS}.name === 'board'"),
       ("episodes", "#/episodes", None, f"{VIEWS}.name === 'episodes'"),
       ("filter", "#/episodes:result=failure", None, f"{VIEWS}.name === 'episodes'"),
       ("episode", "#view:run=1,episode=0,t=1", None, f"evalbusViewer.tracks.length === 1 && {PLAYER}"),
       ("zoomed timeline", "#view:run=1,episode=0,t=1", "+", "!document.querySelector('.ev-whole').hidden"),
       ("pair", "#view:run=1,episode=0,t=1,other=0/0/beside", None, f"evalbusViewer.tracks.length === 2 && {PLAYER}"),
       ("note", "#view:run=1,episode=0,t=1", "m", "Boolean(document.querySelector('dialog[open]'))"),
       ("shortcuts", "#view:run=1,episode=0,t=1", "?", "Boolean(document.querySelector('dialog[open]'))"))


def check(browser, axe, name, found):
    # The resolution does not matter here, and the processor has to render it.
    browser.evaluate("if (window.evalbusViewer && evalbusViewer.scene) { evalbusViewer.setLayer('shadows', false);"
                     " evalbusViewer.scene.ratio = 0.2; evalbusViewer.scene.resize(); }")
    for width, scheme in SCREENS:
        browser.screen(width, 900, scheme)
        frame(browser)
        if not browser.evaluate("Boolean(window.axe)"):
            browser.evaluate(axe + "; 0")
        found += [f"{name}, {width} {scheme}: {one}" for one in browser.evaluate(AXE)]


def check_web(browser, axe, url, found):
    open_url(browser, url)
    for name, address, key, condition in WEB:
        browser.screen(1280, 900, "light")
        browser.evaluate("document.querySelectorAll('dialog[open]').forEach((one) => one.close());"
                         f"location.hash = '{address}'; evalbusViewer.parts.app.focus()")
        for _ in range(2):  # the events of a closed dialog arrive later
            frame(browser)
        if key:
            press(browser, key)
        wait_until(browser, condition, f"{name} is not shown")
        check(browser, axe, name, found)


def main():
    if len(sys.argv) < 5:
        sys.exit("usage: check_axe.py AXE.js EVALBUS RUN RUN [PAGE.html...]")
    axe = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")
    found = []
    with opened(find_chromium()) as browser:
        for page in sys.argv[5:]:
            browser.screen(1280, 900, "light")
            browser.events.clear()
            browser.call("Page.navigate", url=pathlib.Path(page).resolve(strict=True).as_uri())
            browser.wait_for("Page.loadEventFired")
            browser.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
            check(browser, axe, page, found)
        with served(*sys.argv[2:5]) as url:
            check_web(browser, axe, url, found)
    for one in found:
        print(one)
    print(f"{len(found)} violations of axe-core's rules")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
