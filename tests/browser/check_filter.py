#!/usr/bin/env python3
"""Checks the filters of the list of episodes (viz/viewer/page/filter.js) in headless Chromium.

usage: check_filter.py

Expected results are written by hand. Exit code 1: a filter accepts other rows or reports another error; 77:
skipped, Chromium is not installed.
"""
import json
import pathlib
import sys
import tempfile

from chromium import Browser, find_chromium

PAGE = pathlib.Path(__file__).resolve().parents[2] / "viz" / "viewer" / "page"

ROWS = [
    {"episode": 0, "seed": 7, "policy": "expert", "task": "lift_pot", "variation": "position", "success": True,
     "complete": True, "failure_reason": "", "end_reason": "success", "time_s": 5.5, "slips": 0, "grasps": 2, "text": ""},
    {"episode": 1, "seed": 8, "policy": "noisy", "task": "lift_pot", "variation": "position", "success": False,
     "complete": True, "failure_reason": "grasp_slip", "end_reason": "time_limit", "time_s": 20, "slips": 2, "grasps": 3,
     "cause_time_s": 3.6, "cause_text": "Right gripper lost the pot at 3.60 s", "text": "", "note": "odd start"},
    {"episode": 2, "seed": 9, "policy": "noisy", "task": "stack", "variation": "base", "success": False,
     "complete": True, "failure_reason": "wrong_pose", "end_reason": "time_limit", "time_s": 30, "slips": 0, "grasps": 1, "text": ""},
    {"episode": 3, "seed": 10, "policy": "noisy", "task": "stack", "variation": "base", "success": False,
     "complete": False, "failure_reason": "", "end_reason": "server_error", "time_s": None, "slips": 1, "grasps": 0, "text": ""},
    {"episode": 4, "seed": 11, "policy": 'my "robot"', "task": "open_door", "variation": "base", "success": False,
     "complete": True, "failure_reason": "not_judged", "end_reason": "time_limit", "time_s": 40, "slips": None, "grasps": None, "text": ""},
]

ACCEPTED = {
    "": [0, 1, 2, 3, 4],
    "   ": [0, 1, 2, 3, 4],
    "slips>0": [1, 3],
    "slips=0": [0, 2],  # not an unknown number
    'policy="my robot"': [4],
    "slips > 0 and time<25": [1],
    "slips>0 time<25": [1],
    "time<6": [0],
    "time>=20": [1, 2, 4],
    "time!=20": [0, 2, 4],  # a missing time matches no comparison
    "success_time<25": [0],
    "moment<4": [1],
    "seed=9": [2],
    "seed:9": [2],
    "reason:slip": [1],
    "reason:GRASP_slip": [1],
    'reason="grasp slip"': [1],
    "reason=slip": [],
    "reason:gripper": [1],
    'reason="target pose not reached"': [2],
    'reason!="target pose not reached"': [0, 1, 3, 4],
    "not reason:slip": [0, 2, 3, 4],
    "reason:slip or slips=1": [1, 3],
    "policy=noisy and (task:stack or slips>1)": [1, 2, 3],
    "policy=noisy and task:stack or slips>1": [1, 2, 3],
    "not (policy=noisy or policy=expert)": [4],
    "result=failure": [1, 2],
    "result:incomplete": [3],
    "result=unjudged": [4],
    "policy!=expert": [1, 2, 3, 4],
    "note:odd": [1],
    "pot": [0, 1],
    '"lost the pot"': [1],
    "noisy stack": [2, 3],
    'task="stack/base"': [2, 3],
    "reason=server_error": [3],
    "constructor": [],
}

REFUSED = {
    "slips>": "character 7: expected a value after slips>",
    "sips>0": 'character 1: "sips" is not a field; the fields are time, success_time, moment, slips, grasps, collisions, stages, '
              "seed, episode, policy, task, result, reason, note, text",
    "slips>many": 'character 7: slips is a number; "many" is not',
    "policy>a": "character 7: policy is a text; use : (contains), = or !=",
    "(slips>0": "character 1: the parenthesis is not closed",
    "slips>0)": "character 8: there is no parenthesis to close",
    '"open': "character 1: the quotation mark is not closed",
    "slips>0 and": "character 12: expected a condition, for example slips>0 or reason:slip",
    "or slips>0": "character 1: expected a condition, for example slips>0 or reason:slip",
    "slips>0 or and": "character 12: expected a condition, for example slips>0 or reason:slip",
    "not": "character 4: expected a condition, for example slips>0 or reason:slip",
    "()": "character 2: expected a condition, for example slips>0 or reason:slip",
    ">5": "character 1: expected a condition, for example slips>0 or reason:slip",
    "__proto__=1": 'character 1: "__proto__" is not a field; the fields are time, success_time, moment, slips, grasps, collisions, stages, '
                   "seed, episode, policy, task, result, reason, note, text",
}


def main():
    program = find_chromium()
    found = []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(program, profile)
        try:
            for name in ("dom.js", "filter.js"):
                # The scripts are loaded as on a page, so each script can use names that earlier scripts define.
                browser.evaluate("document.head.append(Object.assign(document.createElement('script'), {text: "
                                 f"{json.dumps((PAGE / name).read_text())}}}))")
            apply = ("((text) => { try { const accepts = Evalbus.parseFilter(text); "
                     f"return {json.dumps(ROWS)}.filter(accepts).map((row) => row.episode); }} "
                     "catch (error) { return error instanceof Evalbus.FilterError ? error.message : 'crash: ' + error; } })")
            for text, expected in {**ACCEPTED, **REFUSED}.items():
                got = browser.evaluate(f"{apply}({json.dumps(text)})")
                if got != expected:
                    found.append(f"{text!r}: {got!r}, expected {expected!r}")
        finally:
            browser.close()
    for complaint in found:
        print(complaint)
    print(f"{len(ACCEPTED) + len(REFUSED)} filters, {len(found)} complaints")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
