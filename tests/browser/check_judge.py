#!/usr/bin/env python3
"""Gives blind verdicts on two runs with `evalbus judge` in headless Chromium.

usage: check_judge.py EVALBUS A B [FOLDER]

A and B are the folders of two finished runs of one task with equal seeds. Their policies have different
names, and their episodes have no verdicts yet. Fails (exit code 1) if the page receives or shows something
that reveals the run, the policy or the outcome of an episode, if a verdict that is given by key or button is
not in verdicts.jsonl, if the results are not revealed at the end, or if the console is not empty. Writes
images into FOLDER. Exit code 77: skipped, Chromium is not installed.
"""
import json
import pathlib
import re
import signal
import subprocess
import sys

from check_board import press
from check_viewer import frame, own_addresses, wait_until
from chromium import complaints, find_chromium, opened

JUDGE = "evalbusViewer.judge"
OPERATOR = "Ann <b>B.</b>"


def lines_of(file):
    return [json.loads(line) for line in file.read_text().splitlines()]


def check_blind(browser, item, secrets, found):
    """Checks what the page shows and what the server sends about an episode."""
    text = browser.evaluate("document.body.innerText")
    raw = browser.evaluate(f"fetch('episode/0/{item}').then((answer) => answer.text())")
    for secret in secrets:
        if secret in text:
            found.append(f"episode {item}: the page shows {secret!r}")
        if secret in raw:
            found.append(f"episode {item}: the server sends {secret!r}")
    head = browser.evaluate("evalbusViewer.tracks[0].head")
    for key in ("failure_reason", "explanation", "cause_text", "success", "complete"):
        if head[key] is not None:
            found.append(f"episode {item}: the server sends {key}: {head[key]}")
    if head["end_reason"] or head["policy"] or head["seed"] or head["parameters"] or len(head["events"]) > 1:
        found.append(f"episode {item}: the server sends {head}")
    if any(stage["tick"] for stage in head["stages"]):
        found.append(f"episode {item}: the server sends stages {head['stages']}")
    rows = browser.evaluate("evalbusViewer.runs.get(0).episodes.length")
    if rows:
        found.append(f"the server sends {rows} results")


def click(browser, text):
    browser.evaluate("[...document.querySelectorAll('.ev-judge button')].find((button) =>"
                     f" button.textContent.startsWith({json.dumps(text)})).click()")
    frame(browser)


def check_enter(browser, found):
    """Checks that Enter presses a focused button, which keeps the focus, and that it saves after a click with the pointer."""
    browser.call("Emulation.setFocusEmulationEnabled", enabled=True)
    browser.evaluate(f"{JUDGE}.outcomes.get('success').focus()")
    for stage in (None, 1):
        if stage is not None:
            browser.evaluate(f"{JUDGE}.stageList.children[{stage}].focus()")
        label = browser.evaluate("document.activeElement.textContent")
        press(browser, "Enter", "\r")
        if browser.evaluate(f"[{JUDGE}.outcome, {JUDGE}.stages, {JUDGE}.saved, document.activeElement.textContent]") != ["success", stage, None, label]:
            found.append(f"Enter on {label!r} does not press the button, or moves the focus")
    place = browser.evaluate(f"(() => {{ const b = {JUDGE}.outcomes.get('failure').getBoundingClientRect();"
                             " return {x: b.left + b.width / 2, y: b.top + b.height / 2}; })()")
    for kind in ("mousePressed", "mouseReleased"):
        browser.call("Input.dispatchMouseEvent", type=kind, button="left", clickCount=1, **place)
    if browser.evaluate(f"{JUDGE}.outcome !== 'failure' || {JUDGE}.form.contains(document.activeElement)"):
        found.append("a click with the pointer does not choose the outcome, or its button keeps the focus, so that Enter would not save")
    browser.evaluate(f"{JUDGE}.outcome = {JUDGE}.stages = null; {JUDGE}.showChoices()")
    browser.call("Emulation.setFocusEmulationEnabled", enabled=False)


def give(browser, item, outcome, stages, rubric, uses_keys, secrets, found):
    wait_until(browser, f"{JUDGE}.item === {item} && {JUDGE}.isShown", f"episode {item} is not shown")
    check_blind(browser, item, secrets, found)
    if uses_keys:
        press(browser, outcome[0])
        press(browser, str(stages))
    else:
        click(browser, outcome.capitalize())
        click(browser, str(stages))
    if rubric is not None:
        browser.evaluate(f"{JUDGE}.rubric.focus()")
        browser.call("Input.insertText", text=str(rubric))
        browser.evaluate(f"{JUDGE}.rubric.blur()")


def judge_all(browser, count, secrets, folder, found):
    """Returns the verdicts by place: outcome, stages and rubric."""
    outcomes = ("success", "failure", "abstain", "failure", "failure", "success")
    wanted = [(outcomes[k % 6], k % 4, 7.5 if k % 2 else None) for k in range(count)]
    for k, (outcome, stages, rubric) in enumerate(wanted):
        uses_keys = k % 2 == 0
        give(browser, k, outcome, stages, rubric, uses_keys, secrets, found)
        if k == 1 and folder:
            browser.image(folder / "judge.png")
        if k == 2:
            # The operator corrects the previous verdict.
            press(browser, "Backspace", "\b")
            wait_until(browser, f"{JUDGE}.item === 1 && {JUDGE}.isShown", "Backspace does not show the episode before")
            if browser.evaluate(f"[{JUDGE}.outcome, {JUDGE}.stages, {JUDGE}.rubric.value]") != ["failure", 1, "7.5"]:
                found.append("the verdict on the episode before is not shown")
            press(browser, "a")
            press(browser, "Enter", "\r")
            wanted[1] = ("abstain", 1, 7.5)
            give(browser, k, outcome, stages, None, uses_keys, secrets, found)
        if uses_keys:
            press(browser, "Enter", "\r")
        else:
            click(browser, "Save")
    return wanted


def check_screens(browser, folder, found):
    for width, scheme in ((390, "light"), (1280, "dark"), (1920, "light")):
        browser.screen(width, 900, scheme)
        frame(browser)
        if browser.evaluate("document.documentElement.scrollWidth") > width:
            found.append(f"wider than {width} pixels")
        if folder:
            browser.image(folder / f"judge-{width}-{scheme}.png")
    browser.screen(1280, 900, "light")


def check(browser, evalbus, runs, folder, found):
    policies = [json.loads((run / "run.json").read_text())["policy"] for run in runs]
    seeds = {str(one["seed"]) for run in runs for one in lines_of(run / "episodes.jsonl")}
    secrets = {*policies, *seeds, *(run.name for run in runs)}
    count = sum(len(lines_of(run / "episodes.jsonl")) for run in runs)
    command = [evalbus, "judge", *map(str, runs), "--operator", OPERATOR, "--port", "0", "--seed", "4"]
    judge = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        first = judge.stdout.readline()
        url = re.search(r"http://\S+", first)[0]
        browser.screen(1280, 900, "light")
        # The page records the texts in the place of the scene.
        browser.call("Page.addScriptToEvaluateOnNewDocument", source="window.notes = []; new MutationObserver(() => {"
                     " const note = document.querySelector('.ev-scene-note:not([hidden])'); if (note) notes.push(note.textContent);"
                     " }).observe(document, {childList: true, subtree: true, attributes: true})")
        browser.call("Page.navigate", url=url)
        browser.wait_for("Page.loadEventFired")
        wait_until(browser, f"Boolean(window.evalbusViewer && {JUDGE}.isShown && evalbusViewer.summary().hasImage)", "no episode is shown")
        if not folder:
            # The resolution does not matter here, and the processor has to render it.
            browser.evaluate("evalbusViewer.setLayer('shadows', false); evalbusViewer.scene.ratio = 0.2;"
                             " evalbusViewer.scene.resize()")
        if not browser.evaluate("notes.some((text) => text.startsWith('Loading'))"):
            found.append(f"while the first episode is loaded, the page shows {browser.evaluate('notes')}")
        check_screens(browser, folder, found)
        check_enter(browser, found)
        wanted = judge_all(browser, count, secrets, folder, found)
        wait_until(browser, f"{JUDGE}.head.results", "the results are not revealed")
        text = browser.evaluate("document.querySelector('.ev-judge').innerText")
        if not all(policy in text for policy in policies) or "Difference by the verdicts of" not in text:
            found.append(f"the results are {text!r}")
        if browser.evaluate("document.querySelectorAll('.ev-judge b').length"):
            found.append("an operator's name has become markup")
        if folder:
            browser.image(folder / "judge-results.png")
        kept = sorted((line["place"], line["verdict"], line["stages_reached"], line["rubric"])
                      for run in runs for line in lines_of(run / "verdicts.jsonl"))
        if kept != [(k, *one) for k, one in enumerate(wanted)]:
            found.append(f"kept were {kept}, given were {wanted}")
        found += complaints(browser.events, own_addresses(url))
    finally:
        judge.send_signal(signal.SIGINT)
        rest = judge.communicate()[0]
    if judge.returncode or any(policy in first for policy in policies) or not all(policy in rest for policy in policies):
        found.append(f"the terminal shows {first + rest!r} and ends with {judge.returncode}")


def main():
    if len(sys.argv) not in (4, 5):
        sys.exit("usage: check_judge.py EVALBUS A B [FOLDER]")
    program = find_chromium()
    folder = pathlib.Path(sys.argv[4]) if len(sys.argv) == 5 else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    found = []
    with opened(program) as browser:
        check(browser, sys.argv[1], [pathlib.Path(run) for run in sys.argv[2:4]], folder, found)
    for complaint in found:
        print(complaint)
    print(f"{len(found)} complaints about the page of evalbus judge")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
