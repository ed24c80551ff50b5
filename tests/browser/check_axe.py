#!/usr/bin/env python3
"""Checks pages with the accessibility rules of axe-core in headless Chromium.

usage: check_axe.py AXE.js EVALBUS RUN RUN [PAGE.html...]

Opens each PAGE, the views of `evalbus web RUN RUN`, the pages of a run and of a plan while they are active, and the page
of `evalbus judge`: with a light and a dark theme, 1280 pixels and 390 pixels wide. Fails (exit code 1) if a rule of WCAG 2.2 (A, AA) or of axe's best practices is violated. Exit code 77:
skipped, Chromium is not installed.
"""
import contextlib
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile

from check_board import VIEWS, open_url, press, served
from check_live import start
from check_viewer import frame, wait_until
from chromium import find_chromium, opened

SCREENS = ((1280, "light"), (1280, "dark"), (390, "light"), (390, "dark"))
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


@contextlib.contextmanager
def active(folder, *command):
    """Starts a command that writes into the folder and runs until it is killed here. Yields when the folder exists."""
    process = start([*map(str, command), "--out", str(folder)], folder.with_suffix(".out"))
    try:
        while not any((folder / name).exists() for name in ("run.json", "plan.json")):
            try:
                process.wait(0.05)
            except subprocess.TimeoutExpired:
                continue
            sys.exit(f"error: it ended with {process.returncode}: {folder.with_suffix('.out').read_text()}")
        yield
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def check_active(browser, axe, evalbus, folder, found):
    """Checks the pages of a run and of a plan that are active."""
    run, plan = folder / "run", folder / "plan"
    paced = ("--realtime", "--rtf", "1", "--video", "none")
    with active(run, evalbus, "run", "lift_pot/position", "--policy", "noisy_expert", "--episodes", "100", *paced), served(evalbus, run) as url:
        open_url(browser, url)
        for tab in ("episodeTab", "runTab"):
            browser.screen(1280, 900, "light")
            wait_until(browser, f"{PLAYER} && evalbusViewer.summary().isFollowing", "the active run is not shown")
            browser.evaluate(f"evalbusViewer.parts.{tab}.click()")
            check(browser, axe, f"active run, {tab}", found)
    file = folder / "plan.yaml"
    file.write_text("policies: [expert, {name: noisy, policy: noisy_expert}]\ntasks: [lift_pot/position, stack_two_blocks/position]\n"
                    "episodes: 100\noptions: {realtime: true, rtf: 1}\n")
    with active(plan, evalbus, "run", file), served(evalbus, plan) as url:
        open_url(browser, url)
        for name, address, condition in (("overview", "#/board", f"{VIEWS}.name === 'board'"), ("episodes", "#/episodes", f"{VIEWS}.name === 'episodes'"),
                                         ("player", "#/player", PLAYER)):
            browser.screen(1280, 900, "light")
            browser.evaluate(f"location.hash = '{address}'")
            wait_until(browser, condition, f"{name} of the active plan is not shown")
            check(browser, axe, f"active plan, {name}", found)


def check_judge(browser, axe, evalbus, runs, folder, found):
    """Checks the page of `evalbus judge` with an episode, and with the results."""
    copies = [shutil.copytree(run, folder / f"judged_{k}") for k, run in enumerate(runs)]
    judge = subprocess.Popen([evalbus, "judge", *map(str, copies), "--operator", "Ann", "--port", "0"], stdout=subprocess.PIPE, text=True)
    try:
        browser.screen(1280, 900, "light")
        browser.call("Page.navigate", url=re.search(r"http://\S+", judge.stdout.readline())[0])
        wait_until(browser, f"Boolean(window.evalbusViewer && evalbusViewer.judge.isShown && {PLAYER})", "no episode is shown")
        browser.evaluate("evalbusViewer.judge.choose('failure'); evalbusViewer.judge.chooseStages(1)")
        check(browser, axe, "judge", found)
        browser.evaluate("evalbusViewer.judge.head.verdicts.forEach((_, episode) =>"
                         " evalbusViewer.source.send({verdict: {episode, outcome: 'failure', stages: null, rubric: null}}))")
        wait_until(browser, "evalbusViewer.judge.head.results", "the results are not revealed")
        check(browser, axe, "results of judge", found)
    finally:
        judge.send_signal(signal.SIGINT)
        judge.communicate()


def main():
    if len(sys.argv) < 5:
        sys.exit("usage: check_axe.py AXE.js EVALBUS RUN RUN [PAGE.html...]")
    axe = pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")
    found = []
    with opened(find_chromium()) as browser, tempfile.TemporaryDirectory() as folder:
        for page in sys.argv[5:]:
            browser.screen(1280, 900, "light")
            browser.events.clear()
            browser.call("Page.navigate", url=pathlib.Path(page).resolve(strict=True).as_uri())
            browser.wait_for("Page.loadEventFired")
            browser.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true; })")
            check(browser, axe, page, found)
        with served(*sys.argv[2:5]) as url:
            check_web(browser, axe, url, found)
        check_active(browser, axe, sys.argv[2], pathlib.Path(folder), found)
        check_judge(browser, axe, sys.argv[2], map(pathlib.Path, sys.argv[3:5]), pathlib.Path(folder), found)
    for one in found:
        print(one)
    print(f"{len(found)} violations of axe-core's rules")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
