#!/usr/bin/env python3
"""Uses the overview and the list of episodes of `evalbus web` in headless Chromium.

usage: check_board.py EVALBUS PLAN LARGE [FOLDER]

PLAN is the finished folder of a plan with two policies, of which the second fails, and one task. LARGE is a
run folder with many episodes and no logs. Fails (exit code 1) if the overview shows other results than the
run folders, if a link leads elsewhere, if the images of the decisive seconds are wrong, if keys, filter,
notes or saved images do not work, or if the console is not empty. Writes images into FOLDER. Exit code 77:
skipped, Chromium is not installed.
"""
import contextlib
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from check_viewer import frame, own_addresses, wait_until
from chromium import complaints, find_chromium, opened

VIEWS = "evalbusViewer.views"


@contextlib.contextmanager
def served(evalbus, *arguments):
    """Starts `evalbus web` with these arguments; yields its URL."""
    port = () if "--port" in arguments else ("--port", "0")
    web = subprocess.Popen([evalbus, "web", *map(str, arguments), *port], stdout=subprocess.PIPE, text=True)
    try:
        yield re.search(r"http://\S+", web.stdout.readline())[0]
    finally:
        web.terminate()
        web.wait()


def open_url(browser, url, width=1280, scheme="light"):
    browser.screen(width, 900, scheme)
    browser.call("Page.navigate", url="about:blank")
    browser.events.clear()
    browser.call("Page.navigate", url=url)
    browser.wait_for("Page.loadEventFired")
    wait_until(browser, f"Boolean(window.evalbusViewer && {VIEWS} && {VIEWS}.board.head)", "there is no board")


def press(browser, key, text=None):
    for kind in ("keyDown", "keyUp"):
        browser.call("Input.dispatchKeyEvent", type=kind, key=key, **({"text": text or key} if kind == "keyDown" else {}))
    frame(browser)


def episodes_of(run):
    return [json.loads(line) for line in (run / "episodes.jsonl").read_text().splitlines()]


def check_table(browser, plan, policies, found):
    rows = browser.evaluate("[...document.querySelectorAll('.ev-board-table tbody tr')].map((row) => row.textContent)")
    if len(rows) != len(policies):
        found.append(f"the table has {rows}")
    for row, (policy, run) in zip(rows, policies):
        summary = json.loads((run / "summary.json").read_text())
        counts = f"{summary['successes']} of {summary['complete']}"
        if policy not in row or counts not in row:
            found.append(f"{policy} has {counts}, its row is {row!r}")


def check_heading(browser, found):
    """Checks that the heading is the verdict and that the bars of all rates are equally long."""
    heading = browser.evaluate("document.querySelector('.ev-board h1').textContent")
    if not re.search(r" is \d+ points worse than .*, 95 % CI |^No difference shown between ", heading) or re.search(r" -\d", heading):
        found.append(f"the heading is {heading!r}")
    lengths = browser.evaluate("[...new Set([...document.querySelectorAll('.ev-board-table .ev-rate')].map((bar) => bar.clientWidth))]")
    if len(lengths) != 1:
        found.append(f"the bars of the rates are {lengths} pixels long")


def check_stages(browser, policies, found):
    """Checks that the note on stages is shown if, and only if, a success lacks a stage."""
    is_wanted = any(one["metrics"]["success"] and not all(one["metrics"].get("task_stage_reached", {}).values())
                    for _, run in policies for one in episodes_of(run))
    is_shown = browser.evaluate("document.querySelector('.ev-funnels').textContent.includes('Stages are not conditions of success')")
    if is_shown != is_wanted:
        found.append(f"the note on stages is {'' if is_shown else 'not '}shown")


def check_narrow(browser, found):
    """Checks that rates and differences fit into narrow screens and that long names do not widen the table."""
    name = "document.querySelector('.ev-board-table tbody th a').textContent"
    before = browser.evaluate(name)
    browser.evaluate(f"{name} = 'long_name_'.repeat(20)")
    for width in (390, 600, 1280):
        browser.screen(width, 900, "light")
        frame(browser)
        hidden = browser.evaluate("[...document.querySelectorAll('.ev-board-table .ev-all, .ev-board-table .ev-against')]"
                                  ".filter((cell) => cell.getBoundingClientRect().right > innerWidth).length")
        if hidden:
            found.append(f"{width} pixels: {hidden} results are outside the screen")
    browser.evaluate(f"{name} = {json.dumps(before)}")


def check_arrows(browser, found):
    """Checks that a matrix is one stop of the Tab key and that arrow keys move within it."""
    browser.call("Emulation.setFocusEmulationEnabled", enabled=True)
    stops = browser.evaluate("[...document.querySelectorAll('.ev-matrix')].map((one) => [...one.querySelectorAll('.ev-cell')]"
                             ".filter((cell) => cell.tabIndex === 0).length)")
    if set(stops) != {1}:
        found.append(f"the matrices have {stops} stops of the Tab key")
    label = "document.activeElement.getAttribute('aria-label') || ''"
    browser.evaluate("document.querySelector('.ev-matrix .ev-cell[tabindex=\"0\"]').focus()")
    first = browser.evaluate(label)
    labels = []
    for key in ("ArrowRight", "ArrowDown"):
        for kind in ("keyDown", "keyUp"):
            browser.call("Input.dispatchKeyEvent", type=kind, key=key, code=key)
        labels.append(browser.evaluate(label))
    right, down = labels
    if "episode 0:" not in first or "episode 1:" not in right or "episode 1:" not in down or down.split(",")[0] == first.split(",")[0]:
        found.append(f"the arrow keys lead from {first!r} to {right!r} and {down!r}")
    if browser.evaluate("document.querySelectorAll('.ev-matrix [tabindex=\"0\"]').length") != len(stops):
        found.append("after the arrow keys, there are more stops of the Tab key")
    browser.evaluate("document.activeElement.blur()")
    browser.call("Emulation.setFocusEmulationEnabled", enabled=False)


def check_seeds(browser, policies, found):
    cells = browser.evaluate("[...document.querySelectorAll('.ev-seed-line')].map((line) =>"
                             " [...line.querySelectorAll('a.ev-cell')].map((cell) => cell.dataset.outcome)).filter((line) => line.length)")
    expected = [["success" if one["metrics"]["success"] else "failure" for one in episodes_of(run)] for _, run in policies]
    if cells != expected:
        found.append(f"the matrix has {cells}, the runs {expected}")


def check_hover(browser, policies, found):
    """Checks that a cell of the matrix shows its decisive seconds next to it, by pointer and by keyboard."""
    failures = [one for one in episodes_of(policies[1][1]) if not one["metrics"]["success"]]
    last = failures[-1]
    image = "Boolean(document.querySelector('.ev-hover:not([hidden]) .ev-ready'))"
    is_over = f"document.querySelector('.ev-hover').hidden && !{VIEWS}.thumbnails.isPlaying"
    browser.evaluate("window.drawn = []; const old = %s.thumbnails.draw; %s.thumbnails.draw = function (time_s) {"
                     " drawn.push(time_s); old.call(this, time_s); }" % (VIEWS, VIEWS))
    browser.events.clear()

    def sent():
        return [one["params"]["request"]["url"] for one in browser.events if one.get("method") == "Network.requestWillBeSent"
                and "/episode/" in one["params"]["request"]["url"]]

    def check_card(what):
        wait_until(browser, image, f"{what}: no image")
        wait_until(browser, "new Set(drawn).size > 2", f"{what}: the image does not move")
        start_s = max(0, (last["cause"] or {}).get("time_s", last["metrics"]["completion_time"]) - 1)
        times = browser.evaluate("drawn")
        if min(times) < start_s - 1e-6 or max(times) > start_s + 2 + 1e-6:
            found.append(f"{what}: shows {min(times)} to {max(times)} s, not the two seconds from {start_s} s")
        text = browser.evaluate("document.querySelector('.ev-hover').textContent")
        if last["cause"]["text"] not in text or f"episode {last['episode']}" not in text:
            found.append(f"{what}: the card of {last} contains {text!r}")
        browser.evaluate("drawn.length = 0")

    # A pointer that crosses the matrix requests only the cell on which it rests.
    browser.evaluate("document.querySelectorAll('.ev-matrices a.ev-cell[data-outcome=failure], .ev-matrices a.ev-cell[data-outcome=success]')"
                     ".forEach((cell) => cell.dispatchEvent(new PointerEvent('pointerover', {bubbles: true})));"
                     "[...document.querySelectorAll('.ev-matrices a.ev-cell[data-outcome=failure]')].pop()"
                     ".dispatchEvent(new PointerEvent('pointerover', {bubbles: true}))")
    check_card("pointer")
    if len(sent()) != 1:
        found.append(f"the pointer crosses the matrix, which requests {sent()}")
    browser.evaluate("document.querySelector('.ev-matrices').dispatchEvent(new PointerEvent('pointerleave'))")
    if not browser.evaluate(is_over):
        found.append("the image stays when the pointer has left the matrix")
    # Without this setting, a headless page never has the focus.
    browser.call("Emulation.setFocusEmulationEnabled", enabled=True)
    browser.evaluate("[...document.querySelectorAll('.ev-matrices a.ev-cell[data-outcome=failure]')].pop().focus()")
    check_card("keyboard")
    # The matrix is redrawn whenever an episode ends.
    browser.evaluate(f"drawn.length = 0; {VIEWS}.board.seeds.redraw()")
    label = browser.evaluate("document.activeElement.getAttribute('aria-label') || ''")
    if f"episode {last['episode']}:" not in label or not browser.evaluate(image):
        found.append(f"after an update of the matrix, the focus is at {label!r}")
    press(browser, "Escape", "\x1b")
    if not browser.evaluate(is_over):
        found.append("Escape does not close the card")
    browser.evaluate("document.activeElement.blur(); location.hash = '#/episodes:result=failure'")
    wait_until(browser, f"{VIEWS}.name === 'episodes'", "the list is not shown")
    browser.evaluate(f"{VIEWS}.episodes.setWall(true); [...document.querySelectorAll('.ev-failure')].pop().focus()")
    wait_until(browser, "Boolean(document.activeElement.querySelector('.ev-ready'))", "an image of the wall does not move with the focus")
    failures = sum(not one["metrics"]["success"] for _, run in policies for one in episodes_of(run))
    count = browser.evaluate("document.querySelector('.ev-filter-bar .ev-note').textContent")
    if count != f"{failures} failures":
        found.append(f"the wall of {failures} failures shows {count!r}")
    if browser.evaluate("document.querySelector('.ev-thumbnail canvas').tabIndex") != -1:
        found.append("the small image is a stop of the Tab key")
    browser.evaluate(f"document.activeElement.blur(); {VIEWS}.episodes.setWall(false)")
    if browser.evaluate(f"{VIEWS}.thumbnails.isPlaying"):
        found.append("an image of the wall moves without the focus")
    browser.call("Emulation.setFocusEmulationEnabled", enabled=False)
    browser.evaluate("location.hash = '#/board'")
    wait_until(browser, f"{VIEWS}.name === 'board'", "the overview is not shown")


def check_links(browser, policies, found):
    """Checks that a click on a failure opens it next to the other policy's success, one second before its
    decisive moment."""
    failures = [one for one in episodes_of(policies[1][1]) if not one["metrics"]["success"]]
    first = failures[0]
    browser.evaluate("document.querySelector('a.ev-cell[data-outcome=failure]').click()")
    wait_until(browser, "evalbusViewer.tracks.length === 2 && evalbusViewer.summary().hasImage", "the pair is not shown")
    shown = browser.evaluate("evalbusViewer.tracks.map((track) => [track.head.policy, track.episode])")
    if shown[0][1] != first["episode"] or shown[1][1] != first["episode"] or shown[0][0] == shown[1][0]:
        found.append(f"the pair is {shown}")
    cause = first.get("cause") or {}
    start_s = max(0, (cause.get("time_s") or first["metrics"]["completion_time"]) - 1)
    time_s = browser.evaluate("evalbusViewer.tick * evalbusViewer.tracks[0].tickSeconds")
    if abs(time_s - start_s) > 0.011:
        found.append(f"it opens at {time_s} s, not at {start_s} s")
    if not browser.evaluate("location.hash").startswith("#view:"):
        found.append("the address does not name the episode")
    browser.evaluate("history.back()")
    wait_until(browser, f"{VIEWS}.name === 'board' && location.hash === '#/board'", "back does not lead to the overview")
    # The failed episode is longer than the success next to it.
    late_s = first["metrics"]["completion_time"] - 0.5
    browser.evaluate(f"location.hash = '#view:run=0,episode={first['episode']},t={late_s:.3f},other=1/{first['episode']}'")
    wait_until(browser, "evalbusViewer.tracks.length === 2 && evalbusViewer.tracks[0].run === 0"
               f" && Math.abs(evalbusViewer.tick * evalbusViewer.tracks[0].tickSeconds - {late_s}) < 0.021",
               "a pair does not open at a time after the end of its first episode")


def check_address(browser, found):
    """Checks that the address selects the episode that is shown after a click in the list of episodes, and that a
    link to the episode before still opens it."""
    link = "#view:run=0,episode=0,t=0.100"
    browser.evaluate(f"location.hash = '{link}'")
    # The list, which may be that of another run, is updated one animation frame later.
    wait_until(browser, "evalbusViewer.summary().shown.join() === '0/0' && evalbusViewer.runPanel.list.current === '0/0'",
               "the episode is not shown")
    row = "[...document.querySelectorAll('.ev-list .ev-row:not([hidden])')].find((one) => one.querySelector('.ev-number').textContent === '1')"
    browser.evaluate(f"{row}.click()")
    wait_until(browser, "evalbusViewer.summary().shown.join() === '0/1'", "a click does not open an episode")
    wait_until(browser, "location.hash.startsWith('#view:run=0,episode=1,')", "the address selects another episode than the shown one")
    browser.evaluate(f"location.hash = '{link}'")
    wait_until(browser, "evalbusViewer.summary().shown.join() === '0/0'", "a link does not lead back to an episode")
    browser.evaluate(f"{row}.querySelector('.ev-versus').click()")
    wait_until(browser, "location.hash.startsWith('#view:run=0,episode=0,') && location.hash.endsWith(',other=0/1')",
               "the address does not select the compared episode")
    browser.evaluate("evalbusViewer.toggleBeside()")
    wait_until(browser, "location.hash.endsWith(',other=0/1/beside')", "the address does not state that the episodes are side by side")
    browser.evaluate("evalbusViewer.uncompare()")
    wait_until(browser, "!location.hash.includes('other')", "the address selects an episode that is no longer compared")
    browser.evaluate("evalbusViewer.toggleBeside()")


def check_keys(browser, policies, found):
    browser.evaluate("location.hash = '#view:run=0,episode=0,t=0.100'")
    wait_until(browser, "evalbusViewer.summary().shown[0] === '0/0' && evalbusViewer.summary().hasImage", "the episode is not shown")
    press(browser, "2")
    wait_until(browser, "evalbusViewer.summary().shown[0] === '1/0'", "the key 2 does not open the second policy")
    failing = [one["episode"] for one in episodes_of(policies[1][1]) if not one["metrics"]["success"]]
    if len(failing) > 1:
        browser.evaluate(f"location.hash = '#view:run=1,episode={failing[0]},t=0'")
        wait_until(browser, f"evalbusViewer.summary().shown[0] === '1/{failing[0]}'", "the failure is not shown")
        frame(browser)
        tip = browser.evaluate("document.querySelector('.ev-row[aria-selected=true]').title")
        sentence = next(one["cause"]["text"] for one in episodes_of(policies[1][1]) if one["episode"] == failing[0])
        if not tip.endswith(f": {sentence}"):
            found.append(f"the tooltip of the row is {tip!r}, the cause {sentence!r}")
        press(browser, "j")
        wait_until(browser, f"evalbusViewer.summary().shown[0] === '1/{failing[1]}'", "j does not lead to the next failure")
        press(browser, "k")
        wait_until(browser, f"evalbusViewer.summary().shown[0] === '1/{failing[0]}'", "k does not lead back")
    image = browser.evaluate("evalbusViewer.imageOfScene().then((blob) => blob.arrayBuffer())"
                             ".then((bytes) => [...new Uint8Array(bytes.slice(0, 4)), bytes.byteLength])")
    if image[:4] != [0x89, 0x50, 0x4E, 0x47] or image[4] < 10000:
        found.append(f"the image of the scene is {image}")


def check_filter(browser, policies, found):
    press(browser, "/")
    if not browser.evaluate("document.activeElement.classList.contains('ev-filter-text')"):
        found.append("/ does not lead to the filter")
    for text, expected in (("slips>0 and time<18", lambda one: one["metrics"]["slip_count"] > 0 and one["metrics"]["completion_time"] < 18),
                           ("result=failure", lambda one: not one["metrics"]["success"])):
        browser.evaluate("document.activeElement.select()")
        browser.call("Input.insertText", text=text)
        frame(browser)
        got = browser.evaluate(f"{VIEWS}.episodes.rows.map((row) => [row.run, row.episode])")
        wanted = [[k, one["episode"]] for k, (_, run) in enumerate(policies) for one in episodes_of(run) if expected(one)]
        if got != wanted:
            found.append(f"{text}: {got}, expected {wanted}")
    browser.evaluate("document.activeElement.select()")
    browser.call("Input.insertText", text="sips>0")
    frame(browser)
    problem = browser.evaluate("document.querySelector('.ev-filter-problem').textContent")
    if not problem.startswith('character 1: "sips" is not a field'):
        found.append(f"a wrong filter is reported as {problem!r}")
    browser.evaluate(f"{VIEWS}.episodes.setFilter('seed=-1')")
    text = browser.evaluate("document.querySelector('.ev-all-episodes').innerText")
    if "No episodes match the filter." not in text:
        found.append(f"a filter that accepts nothing shows {text!r}")
    browser.evaluate(f"{VIEWS}.episodes.setFilter('')")
    browser.evaluate(f"{VIEWS}.episodes.sortBy('time')")
    times = browser.evaluate(f"{VIEWS}.episodes.rows.map((row) => row.time_s)")
    if times != sorted(times):
        found.append(f"sorted by time: {times}")
    image = browser.evaluate("Evalbus.imageOf(evalbusViewer.parts.app).then((blob) => blob.size)")
    if image < 5000:
        found.append(f"the image of the list has {image} bytes")


def check_sentences(browser, found):
    """Checks that the list shows the whole task and the whole sentence of each episode."""
    for width in (390, 1024, 1280):
        browser.screen(width, 900, "light")
        frame(browser)
        cut = browser.evaluate("[...document.querySelectorAll('.ev-table-box .ev-table-row:not([hidden]) :is(.ev-col-task, .ev-col-text)')]"
                               ".filter((cell) => !cell.clientHeight || cell.scrollHeight > cell.clientHeight + 1).map((cell) => cell.textContent)")
        if cut:
            found.append(f"{width} pixels: the list cuts {cut}")


def check_note(browser, run, found):
    browser.evaluate("location.hash = '#view:run=1,episode=0,t=0.100'")
    wait_until(browser, "evalbusViewer.summary().shown[0] === '1/0'", "the episode is not shown")
    press(browser, "m")
    title = browser.evaluate("document.querySelector('.ev-note-dialog h3').textContent")
    if "/" not in title or not title.endswith(", episode 0"):
        found.append(f"the title of the note is {title!r}")
    browser.call("Input.insertText", text="odd <b>start</b>")
    press(browser, "Enter", "\r")
    wait_until(browser, "evalbusViewer.notes.of(1, 0) === 'odd <b>start</b>'", "the note does not come back")
    if json.loads((run / "notes.json").read_text()) != {"0": "odd <b>start</b>"}:
        found.append(f"the note was kept as {(run / 'notes.json').read_text()!r}")
    browser.evaluate("location.hash = '#/episodes:note:odd'")
    wait_until(browser, f"{VIEWS}.episodes.rows.length === 1", "the filter does not find the note")
    if browser.evaluate("document.querySelectorAll('.ev-table-box b').length"):
        found.append("a note has become markup")


def check_one_state(browser, found):
    """Checks that table, matrix and head show the same episodes: neither episodes that the board does not count yet, nor a
    board whose episodes have not arrived."""
    state = ("(%s.show(), [document.querySelectorAll('.ev-board-table tbody tr')[1].innerText,"
             " document.querySelectorAll('.ev-matrices a.ev-cell').length, document.querySelector('.ev-legend').innerText,"
             " document.querySelector('.ev-subtitle').textContent])" % VIEWS)

    def add(episode):
        browser.evaluate("evalbusViewer.hearEpisodes({ run: 1, from: %d, episodes: [{ ...evalbusViewer.runs.get(1).episodes[0],"
                         " episode: %d, seed: %d }] })" % (episode, episode, episode))

    count = browser.evaluate("evalbusViewer.runs.get(1).episodes.length")
    before = browser.evaluate(state)
    add(count)
    if browser.evaluate(state) != before:
        found.append("the matrix shows an episode that the table does not count")
    browser.evaluate("{ const head = JSON.parse(JSON.stringify(%s.board.head)), one = head.policies[1]; one.runs_done = [%d];"
                     " for (const counted of [one.all, one.cells[0]]) counted.judged = counted.done = %d;"
                     " Object.assign(head, { num_policies: 3, num_tasks: 2 }); %s.hearBoard(head); }" % (VIEWS, count + 2, count + 2, VIEWS))
    if browser.evaluate(state) != before:
        found.append("the table counts an episode that the matrix does not show")
    add(count + 1)
    after = browser.evaluate(state)
    if f" of {count + 2}" not in after[0] or after[1] != before[1] + 2 or after[3] != "3 policies, 2 tasks":
        found.append(f"the overview with two more episodes is {after}")


def check_removed(browser, evalbus, run, found):
    """Checks that a run whose folder was removed is not called interrupted."""
    with tempfile.TemporaryDirectory() as folder:
        copy = shutil.copytree(run, pathlib.Path(folder, "run"))
        with served(evalbus, copy) as url:
            open_url(browser, url + "#/board")
            wait_until(browser, "document.querySelectorAll('.ev-board-table tbody tr').length === 1", "the overview is not shown")
            shutil.rmtree(copy)
            wait_until(browser, "document.querySelector('.ev-state-pill').textContent === 'folder not found'"
                       " && document.querySelector('.ev-board').innerText.includes('no longer exists')", "a removed folder is not noticed")
            text = browser.evaluate("document.querySelector('.ev-board').innerText")
            if "no episode yet" in text:
                found.append(f"a run whose folder was removed is shown as {text!r}")


def check_pointer(browser, found):
    """Checks that no frames are requested while the pointer rests on the timeline, and that its image follows the pointer."""
    x, y = browser.evaluate("(() => { const box = document.querySelector('.ev-timeline').getBoundingClientRect();"
                            " return [box.left + box.width / 2, box.top + 10]; })()")
    browser.evaluate("window.drawn = []; const old = %s.thumbnails.draw; %s.thumbnails.draw = function (time_s) {"
                     " drawn.push(time_s); old.call(this, time_s); }" % (VIEWS, VIEWS))
    for count in (1, 2):
        browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=x + 40 * count, y=y)
        wait_until(browser, f"drawn.length === {count} && drawn[{count - 1}] === evalbusViewer.timeline.pointed",
                   "the image does not follow the pointer", 60)
        check_rest(browser, found)
    browser.call("Input.dispatchMouseEvent", type="mouseMoved", x=1, y=1)


def check_early(browser, evalbus, plan, policies, found):
    """Checks that a plan opens with the overview, and is not called finished, while only its first run exists."""
    with tempfile.TemporaryDirectory() as folder:
        early = pathlib.Path(folder) / "plan"
        early.mkdir()
        shutil.copy(plan / "plan.json", early)
        (early / policies[0][0]).symlink_to((plan / policies[0][0]).resolve())
        with served(evalbus, early) as url:
            open_url(browser, url)
            frame(browser)
            state = "document.querySelector('.ev-state-pill').textContent"
            got = browser.evaluate(f"[{VIEWS}.name, {state}]")
            browser.evaluate("location.hash = '#/player'")
            wait_until(browser, "evalbusViewer.tracks.length === 1", "the first run is not shown")
            got.append(browser.evaluate(state))
            if got[0] != "board" or any("finished" in one for one in got):
                found.append(f"a plan whose second run is missing is shown as {got}")


def check_plan(browser, evalbus, plan, folder, found):
    info = json.loads((plan / "plan.json").read_text())
    task = info["tasks"][0].replace("/", "-")
    policies = [(one["name"], plan / one["name"] / task) for one in info["policies"]]
    if all(one["metrics"]["success"] for one in episodes_of(policies[1][1])):
        sys.exit(f"error: {policies[1][0]} never fails, so there is no failure to look for")
    with served(evalbus, plan) as url:
        open_url(browser, url)
        wait_until(browser, f"{VIEWS}.name === 'board' && document.querySelector('a.ev-cell[data-outcome=failure]')"
                   f" && {VIEWS}.board.head.is_over", "the overview is not shown")
        check_table(browser, plan, policies, found)
        check_heading(browser, found)
        check_narrow(browser, found)
        check_stages(browser, policies, found)
        check_seeds(browser, policies, found)
        check_arrows(browser, found)
        check_hover(browser, policies, found)
        for width, scheme in ((390, "light"), (1280, "light"), (1280, "dark"), (1920, "light")):
            browser.screen(width, 900, scheme)
            frame(browser)
            if browser.evaluate("document.documentElement.scrollWidth") > width:
                found.append(f"wider than {width} pixels")
            if folder:
                browser.image(folder / f"board-{width}-{scheme}.png")
        browser.screen(1280, 900, "light")
        check_links(browser, policies, found)
        check_address(browser, found)
        check_keys(browser, policies, found)
        check_filter(browser, policies, found)
        check_sentences(browser, found)
        check_note(browser, policies[1][1], found)
        browser.evaluate("location.hash = '#/board'")
        wait_until(browser, f"{VIEWS}.name === 'board'", "the overview is not shown")
        check_one_state(browser, found)
        found += complaints(browser.events, own_addresses(url))
    with served(evalbus, plan, "--listen", "0.0.0.0") as url:
        open_url(browser, re.sub(r"//[^:/]+", "//127.0.0.1", url))
        wait_until(browser, "evalbusViewer.notes.of(1, 0) !== ''", "other machines do not see the note")
        if browser.evaluate("evalbusViewer.notes.canWrite"):
            found.append("other machines may write notes")
    check_early(browser, evalbus, plan, policies, found)
    check_restart(browser, evalbus, policies, found)
    check_interrupted(browser, evalbus, [run for _, run in policies], found)
    check_removed(browser, evalbus, policies[0][1], found)
    with served(evalbus, policies[0][1]) as url:
        open_url(browser, url)
        wait_until(browser, "evalbusViewer.summary().hasImage", "a single run does not open with its episode")
        if browser.evaluate(f"{VIEWS}.name") != "player":
            found.append("a single run does not open in the player")
        browser.evaluate("evalbusViewer.seek(3)")
        check_rest(browser, found)
        check_pointer(browser, found)
        # The page was opened without a fragment, so "back" returns to this URL.
        browser.evaluate("history.replaceState(null, '', location.pathname); location.hash = '#/board'")
        frame(browser)
        check_rest(browser, found)
        browser.evaluate("history.back()")
        wait_until(browser, f"{VIEWS}.isPlayer", "the back button does not return to the player", 20)
        browser.evaluate("location.hash = '#/board'")
        frame(browser)
        heading = browser.evaluate("document.querySelector('.ev-board h1').textContent")
        summary = json.loads((policies[0][1] / "summary.json").read_text())
        if f"({summary['successes']} of {summary['complete']}), 95 % CI " not in heading:
            found.append(f"the heading of a single run is {heading!r}")


def check_rest(browser, found):
    """Checks that a page at rest requests no animation frames."""
    wait_until(browser, "!evalbusViewer.isAwake", "the page does not come to rest", 60)
    browser.evaluate("window.realFrame = requestAnimationFrame; window.frames_requested = 0;"
                     " window.requestAnimationFrame = (f) => { ++frames_requested; return realFrame(f); }")
    browser.evaluate("new Promise((done) => { let count = 0; const next = () => ++count < 10 ? realFrame(next) : done(); next(); })")
    if browser.evaluate("window.requestAnimationFrame = realFrame; frames_requested") != 0:
        found.append("a page at rest requests animation frames")


def check_interrupted(browser, evalbus, runs, found):
    """Checks that runs that were interrupted, which have a summary, are not shown as finished."""
    with tempfile.TemporaryDirectory() as folder:
        copies = [shutil.copytree(run, pathlib.Path(folder, f"run{k}")) for k, run in enumerate(runs)]
        for copy in copies:
            options = json.loads((copy / "run.json").read_text())
            (copy / "run.json").write_text(json.dumps({**options, "episodes": options["episodes"] + 5}))
        with served(evalbus, *copies) as url:
            open_url(browser, url)
            wait_until(browser, "document.querySelectorAll('.ev-board-table tbody tr').length === 2", "the overview is not shown")
            heading = browser.evaluate("document.querySelector('.ev-board h1').textContent")
            if heading != "Overview":
                found.append(f"the overview of interrupted runs has the heading {heading!r}")
        with served(evalbus, copies[0]) as url:
            open_url(browser, url)
            wait_until(browser, "evalbusViewer.tracks.length === 1", "the page of an interrupted run opens no episode")
            state = browser.evaluate("document.querySelector('.ev-state-pill').textContent")
            if not state.startswith("interrupted"):
                found.append(f"an interrupted run is shown as {state!r}")


def check_restart(browser, evalbus, policies, found):
    """Checks that runs, and their episodes, disappear if the next server at the address does not have them."""
    runs = [run for _, run in policies]
    with served(evalbus, *runs) as url:
        open_url(browser, url)
        browser.evaluate("location.hash = '#view:run=1,episode=0,t=0.100'")
        wait_until(browser, "evalbusViewer.summary().shown[0] === '1/0' && evalbusViewer.summary().hasImage", "the episode is not shown")
    wait_until(browser, "evalbusViewer.connectionState === 'lost'", "the end of the server is not noticed")
    if browser.evaluate("[evalbusViewer.runs.size, evalbusViewer.tracks.length]") != [2, 1]:
        found.append("a page without a server does not keep its runs")
    # On the next server, run 0 is a different run.
    with served(evalbus, runs[1], "--port", re.search(r":(\d+)/", url)[1]):
        wait_until(browser, "evalbusViewer.runs.size === 1 && evalbusViewer.summary().shown[0]?.startsWith('0/')"
                   " && evalbusViewer.summary().hasImage", "a run of the previous server stays on the page")
        shown = browser.evaluate("evalbusViewer.tracks[0].head.policy")
        if shown != policies[1][0]:
            found.append(f"the page shows an episode of {shown} of the previous server")


def check_large(browser, evalbus, large, folder, found):
    count = len(episodes_of(large))
    with served(evalbus, large) as url:
        # The page is opened again once the server has read the folder.
        open_url(browser, url + "#/board")
        wait_until(browser, f"{VIEWS}.board.head.policies[0].all.done === {count}", "the server does not read the run")
        open_url(browser, url + "#/board")
        wait_until(browser, f"{VIEWS}.board.rows().length === {count} && Boolean(document.querySelector('.ev-band .ev-cell[data-outcome=success]'))",
                   "the overview is not ready")
        ready_ms = browser.evaluate("performance.now()")
        browser.evaluate("location.hash = '#/episodes:result=failure'")
        wait_until(browser, f"{VIEWS}.episodes.rows.length > 0", "the list is not ready")
        rows = browser.evaluate("document.querySelectorAll('.ev-table-box .ev-table-row').length")
        nodes = browser.evaluate("document.querySelectorAll('*').length")
        if rows > 100 or nodes > 5000:
            found.append(f"the page has {nodes} elements, the list {rows} rows")
        if folder:
            browser.image(folder / "large.png")
        print(f"{count} episodes: ready {ready_ms:.0f} ms after the request, {nodes} elements")
        found += complaints(browser.events, own_addresses(url))


def main():
    if len(sys.argv) not in (4, 5):
        sys.exit("usage: check_board.py EVALBUS PLAN LARGE [FOLDER]")
    program = find_chromium()
    evalbus, plan, large = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    folder = pathlib.Path(sys.argv[4]) if len(sys.argv) == 5 else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    found = []
    with opened(program) as browser:
        check_plan(browser, evalbus, plan, folder, found)
        check_large(browser, evalbus, large, folder, found)
    for complaint in found:
        print(complaint)
    print(f"{len(found)} complaints about the overview")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
