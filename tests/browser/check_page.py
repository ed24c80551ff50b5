#!/usr/bin/env python3
"""Opens a page in headless Chromium as a user would, on a desktop and a phone screen, with the light and the
dark theme.

usage: check_page.py PAGE.html [FOLDER]

Fails (exit code 1) if the console has an error or a warning, if the page requests anything from the network,
if it is wider than the screen, if an element that must be visible has no size, or if a click on a column
header does not sort. Writes images of the whole page into FOLDER. Exit code 77: skipped, Chromium is not
installed.
"""
import pathlib
import sys
import tempfile

from chromium import SOFTWARE_GL, Browser, complaints, find_chromium

WIDTHS = (1280, 400)


# Sorts each table by each column in both directions and checks the order of the cells.
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

# Finds texts of figures that lie outside their figure or overlap, and sentences that the screen cuts.
TEXTS = """
(() => {
  const wrong = [...document.querySelectorAll(".why:not(.why ~ .why)")].filter((cell) => cell.getBoundingClientRect().right > innerWidth)
    .map((cell) => `"${cell.textContent}" is cut`);
  for (const figure of document.querySelectorAll("svg:is(.figure, .share)")) {
    const frame = figure.getBoundingClientRect();
    if (!frame.width) continue;
    const boxes = [...figure.querySelectorAll("text")].map((text) => [text.textContent, text.getBoundingClientRect()]);
    boxes.forEach(([text, box], i) => {
      if (figure.matches(".figure") && (box.left < frame.left - 10 || box.right > frame.right + 10)) wrong.push(`"${text}" sticks out of ${figure.ariaLabel}`);
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
    browser.screen(width, 900, scheme)
    browser.call("Page.navigate", url=url)
    browser.wait_for("Page.loadEventFired")
    browser.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = false; })")
    found = []
    if browser.evaluate("innerWidth") != width:
        found.append(f"the window is {browser.evaluate('innerWidth')} pixels wide")

    def image(name):
        if folder:
            browser.image(folder / f"{name}.png", whole=True)

    image(f"{width}-{scheme}")
    browser.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    image(f"{width}-{scheme}-open")
    page_width = browser.evaluate("document.documentElement.scrollWidth")
    if page_width > width:
        found.append(f"{page_width} pixels wide")
    found += browser.evaluate(TEXTS) + browser.evaluate(SORT)
    return [f"{width} {scheme}: {complaint}" for complaint in found + complaints(browser.events)]


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit("usage: check_page.py PAGE.html [FOLDER]")
    program = find_chromium()
    page = pathlib.Path(sys.argv[1]).resolve(strict=True)
    folder = pathlib.Path(sys.argv[2]) if len(sys.argv) == 3 else None
    if folder:
        folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        browser = Browser(program, profile, SOFTWARE_GL)
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
