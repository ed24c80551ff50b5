"""Runs the commands of docs/watch.md: a recorded episode as a source, with images of a video instead of a
camera's.

usage: watch_page_test.py BIN   (the folder of evalbus' programs)
"""

import json
import os
import pathlib
import shutil
import struct
import sys
import tempfile
import zlib
from base64 import b64decode

import support
from page_commands import Shell, blocks, enter_network

support.need("numpy")

import evalbus

BIN = pathlib.Path(sys.argv[1]).resolve()


def packed_episode(report):
    """Returns the head of the first episode's block in a report, and the bytes after it (docs/viewer_data.md)."""
    text = report.read_text().split('data-block="episode/0/0">')[1].split("<")[0]
    block = zlib.decompress(b64decode(text))
    (length,) = struct.unpack_from("<I", block)
    return json.loads(block[4 : 4 + length]), block[(4 + length + 7) // 8 * 8 :]


def check_images(folder):
    """Checks that the folder's images are in the log, in order and with their times, and in the report."""
    published = [file.read_bytes() for file in sorted((folder / "images").iterdir())]
    images = [
        message for _, channel, message in evalbus.events(folder / "runs/c/episodes/0000/events.lcmlog")
        if channel == "EVALBUS_CAMERA_front"
    ]  # fmt: skip
    assert len(images) > 20, len(images)
    for k, image in enumerate(images):
        assert bytes(image["data"]) == published[min(k, len(published) - 1)], k
        assert image["header"]["episode"] == 0
        assert abs(image["header"]["sim_time_us"] - k * 100_000) <= 20_000, (k, image["header"])
        assert image["header"]["tick"] == image["header"]["sim_time_us"] // 20_000, image["header"]
    head, data = packed_episode(folder / "runs/c/report.html")
    assert head["image_cameras"] == ["front"], head["image_cameras"]
    jpeg = head["arrays"]["image_jpeg"]
    at = jpeg["offset"]
    assert data[at : at + len(published[0])] == published[0]
    # An episode without images has the same results.
    episodes = [json.loads((folder / f"runs/{run}/episodes.jsonl").read_text().splitlines()[0]) for run in "bc"]
    for episode in episodes:
        assert episode["complete"] and episode["end_reason"] == "success", episode
    assert episodes[0]["metrics"] == episodes[1]["metrics"]


def check_contacts(folder):
    """Checks that the contacts of run d equal those that the source published."""
    contacts = []
    for run in "ad":
        log = evalbus.events(folder / f"runs/{run}/episodes/0000/events.lcmlog")
        messages = [message for _, channel, message in log if channel == "EVALBUS_CONTACTS"]
        contacts.append([[(c["geom_a"], c["geom_b"]) for c in message["contact"]] for message in messages])
    assert contacts[0] == contacts[1]
    assert sum(map(len, contacts[1])) > 100
    assert json.loads((folder / "runs/d/run.json").read_text())["contacts"] == "source"
    original, episode = (
        json.loads((folder / f"runs/{run}/episodes.jsonl").read_text().splitlines()[0]) for run in "ad"
    )
    assert episode["complete"] and episode["end_reason"] == "success", episode
    assert episode["metrics"]["slip_count"] == original["metrics"]["slip_count"]


def check_page(folder):
    """Checks in a browser, if one is installed, that the page shows the images."""
    if not shutil.which("chromium"):
        return
    sys.path.insert(0, str(support.SOURCE / "tests" / "browser"))
    from check_viewer import wait_until
    from chromium import SOFTWARE_GL, Browser, complaints, find_chromium

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(find_chromium(), profile, SOFTWARE_GL)
        for domain in ("Page", "Runtime", "Log", "Network"):
            browser.call(f"{domain}.enable")
        browser.call("Page.navigate", url=(folder / "runs/c/report.html").as_uri())
        browser.wait_for("Page.loadEventFired")
        wait_until(browser, "window.evalbusViewer && evalbusViewer.tracks.length", "no episode is shown")
        browser.evaluate("evalbusViewer.seek(100)")
        image = "document.querySelector('.ev-images img')"
        wait_until(browser, f"{image} && {image}.complete && {image}.naturalWidth === 320", "no image is shown")
        assert browser.evaluate("document.querySelector('.ev-images figcaption').textContent") == "front"
        assert not complaints(browser.events), complaints(browser.events)
        browser.close()


def main():
    enter_network()
    if not shutil.which("ffmpeg"):
        support.skip("no ffmpeg")
    os.environ["PATH"] = f"{BIN}:{os.environ['PATH']}"
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        shell = Shell(folder)
        ran = 0
        try:
            for commands, _ in blocks("docs/watch.md"):
                watch = None
                for command in commands:
                    if "--web" in command:
                        continue  # skipped, because it serves a browser
                    print(f"$ {command}", flush=True)
                    ran += 1
                    if command.endswith(" &"):
                        watch = shell.stay(command.removesuffix(" &"))
                        continue
                    if command == "wait":
                        assert watch.wait(support.DEADLINE_S) == 0, watch.output()
                    else:
                        shell.run(command)
                if watch:
                    assert watch.wait(support.DEADLINE_S) == 0, watch.output()
            assert ran == 11, ran
            check_contacts(folder)
            check_images(folder)
            check_page(folder)
        finally:
            shell.end()


main()
