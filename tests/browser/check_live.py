#!/usr/bin/env python3
"""Watches a real run in headless Chromium.

The page is opened in the middle of a run, scrubbed, and sent hostile log lines. The run is killed, resumed
and finished.

usage: check_live.py EVALBUS FOLDER

Runs EVALBUS (the program) into FOLDER/run<b>. Fails (exit code 1) if the page does not follow the run, shows
other numbers than the run's own files, treats external text as markup, or writes to its console. Exit code
77: skipped, Chromium is not installed.
"""
import contextlib
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys

from check_viewer import (HOSTILE, compare_poses, compare_values, frame, open_page, own_addresses, read_log, shown,
                          wait_until)
from chromium import complaints, find_chromium, opened

POLICY_NAME = "<b onclick=alert(1)>noisy</b>"
RUN = "evalbusViewer.runs.get(0)"
# Fingerprint of log_t, from tests/data/fingerprints.txt.
LOG_FINGERPRINT = re.search(r"^log_t (\w{16})$", (pathlib.Path(__file__).resolve().parents[1] / "data" / "fingerprints.txt")
                            .read_text(), re.MULTILINE)[1]


def start(command, out):
    """Starts a new process group, so that all processes of a run can be killed at once."""
    return subprocess.Popen(command, stdout=open(out, "w"), stderr=subprocess.STDOUT, start_new_session=True)


def wait_for_line(pattern, out, process):
    """Waits for the pattern in a program's output. Returns its first group."""
    while not (match := re.search(pattern, out.read_text())):
        try:
            process.wait(0.05)
        except subprocess.TimeoutExpired:
            continue
        sys.exit(f"error: it ended with {process.returncode}: {out.read_text()}")
    return match[1]


def send_hostile_log(bus):
    """Sends a line of EVALBUS_LOG from an unknown process, and bytes that are not a message, in LCM datagrams."""
    def string(text):
        raw = text.encode() + b"\0"
        return struct.pack(">i", len(raw)) + raw

    header = struct.pack(">qiiqq", 0, 0, 0, 5, 100000)
    line = (bytes.fromhex(LOG_FINGERPRINT) + header + string("<i>stranger</i>\n") + struct.pack(">b", 3)
            + string(HOSTILE))
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as out:
        out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        for channel, payload in ((b"EVALBUS_LOG", line), (b"EVALBUS_STATUS", b"<b>no message</b>")):
            out.sendto(struct.pack(">II", 0x4C433032, 1) + channel + b"\0" + payload, bus)


def check_markup(browser, found):
    if browser.evaluate("document.querySelectorAll('.evalbus-viewer :is(img, script, iframe, i:not([class], .ev-bar i,"
                        " .ev-progress i), b[onclick])').length"):
        found.append("text from another program has become markup")
    if POLICY_NAME not in browser.evaluate("document.querySelector('.ev-subtitle').textContent"):
        found.append("the policy's name is not shown as it is")
    text = browser.evaluate("document.querySelector('.ev-log').textContent")
    if "<img src=x" not in text or "<i>stranger</i>" not in text or any(ord(c) < 32 or c == "\u202e" for c in text):
        found.append(f"a hostile log line is shown as {text!r}")


def check_end(browser, run, last, found):
    """Compares the list, the success rate and an episode with the run's files."""
    rows = browser.evaluate(f"{RUN}.episodes.map((row) => [row.episode, row.end_reason, row.success])")
    lines = [json.loads(line) for line in (run / "episodes.jsonl").read_text().splitlines()]
    expected = [[one["episode"], one["end_reason"], one["metrics"]["success"] == 1] for one in lines]
    if rows != expected:
        found.append(f"the list has {rows}, episodes.jsonl {expected}")
    summary, info = json.loads((run / "summary.json").read_text()), shown(browser)["info"]
    if info["rate"] != summary["success_rate"] or info["interval"] != summary["success_rate_wilson_95"]:
        found.append(f"the page has {info['rate']} {info['interval']}, the summary {summary['success_rate']}"
                     f" {summary['success_rate_wilson_95']}")
    browser.evaluate(f"evalbusViewer.open(0, {last}, 0, false)")
    wait_until(browser, f"evalbusViewer.summary().shown[0] === '0/{last}' && evalbusViewer.summary().hasImage",
               "the last episode is not shown")
    episode = run / "episodes" / f"{last:04d}"
    log = read_log(episode / "events.lcmlog")
    ticks = list(log["EVALBUS_STATE"]["header"]["tick"])
    bodies = sum(compare_poses(browser, log, tick, found) for tick in (0, ticks[len(ticks) // 2], ticks[-1]))
    metrics = compare_values(browser, shown(browser)["heads"][0], json.loads((episode / "summary.json").read_text()), found)
    if bodies < 3 or metrics < 20:
        found.append(f"only {bodies} poses and {metrics} metrics were compared")


def check(browser, evalbus, folder, processes, found):
    run, run_out, web_out = folder / "run<b>", folder / "run.out", folder / "web.out"
    command = [evalbus, "run", "lift_pot/position", "--policy", "expert", "--policy-name", POLICY_NAME, "--realtime",
               "--rtf", "4", "--video", "none", "--out", str(run)]
    # The run is killed long before it has finished 200 episodes. The resumed run evaluates only two more.
    processes.append(start([*command, "--episodes", "200"], run_out))
    group, port = wait_for_line(r"udpm://([\d.]+:\d+)", run_out, processes[0]).split(":")
    wait_for_line(r"(?s)\n +0 +(\w+)", run_out, processes[0])
    # The page is opened in the middle of the run: the first episode has finished, and the second is active.
    processes.append(start([evalbus, "web", str(run), "--port", "0"], web_out))
    url = wait_for_line(r"(http://\S+)", web_out, processes[1])
    open_page(browser, url, 1280, 900, "dark", False)
    if not shown(browser)["isFollowing"] or shown(browser)["episodes"] < 1:
        found.append("it does not follow, or does not know the episode that has ended")
    if not browser.evaluate("Number.isFinite(evalbusViewer.tracks[0].position.data[0])"
                            " && Number.isFinite(evalbusViewer.tracks[0].valueAt(0, 0))"):
        found.append("the beginning of the episode under way is not known")
    browser.evaluate("evalbusViewer.seek(3)")
    frame(browser)
    if browser.evaluate("evalbusViewer.tick") != 3 or shown(browser)["isFollowing"]:
        found.append("a scrub does not stay")
    browser.evaluate("evalbusViewer.follow()")
    send_hostile_log((group, int(port)))
    wait_until(browser, "document.querySelector('.ev-log').textContent.includes('stranger')", "the log line is not shown")
    check_markup(browser, found)

    if processes[0].poll() is not None:
        sys.exit("error: the run ended before it could be killed")
    os.killpg(processes[0].pid, signal.SIGKILL)
    processes[0].wait()
    wait_until(browser, f"{RUN}.info.is_live === false", "the page does not show that the run was killed")
    wait_until(browser, "document.querySelector('.ev-state-pill').textContent.startsWith('interrupted')", "the page does not show that it was interrupted")
    episodes = len((run / "episodes.jsonl").read_text().splitlines()) + 2
    processes.append(start([*command, "--episodes", str(episodes), "--resume"], run_out))
    wait_until(browser, f"{RUN}.info.episode === {episodes - 1}", "the resumed run's last episode does not begin on the page")
    # While evalbus web is stopped, the last messages of the run are queued. It receives them after the run's
    # processes have exited.
    processes[1].send_signal(signal.SIGSTOP)
    code = processes[2].wait()
    processes[1].send_signal(signal.SIGCONT)
    if code != 0:
        sys.exit(f"error: {run_out.read_text()}")
    wait_until(browser, f"{RUN}.info.is_over && {RUN}.episodes.length === {episodes}", "the resumed run does not end on the page")
    wait_until(browser, "evalbusViewer.summary().heads[0].is_over", "the last episode does not end on the page")
    wait_until(browser, f"{RUN}.info.interval_kind === 'Wilson'", "the rate is not the final one")
    check_end(browser, run, episodes - 1, found)
    found += complaints(browser.events, own_addresses(url))


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: check_live.py EVALBUS FOLDER")
    program = find_chromium()
    found, processes = [], []
    with opened(program) as browser:
        try:
            check(browser, sys.argv[1], pathlib.Path(sys.argv[2]), processes, found)
        finally:
            for process in processes:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
    for one in found:
        print(one)
    print(f"{len(found)} complaints about a run that was watched")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
