// Sorts tables by the clicked column; a second click reverses the order. Marks tables that can be scrolled. A
// click on an event's time seeks the video to it. This file must not contain characters that XML or HTML
// would interpret as markup.
"use strict";

function valueOf(cell) {
  const data = cell.querySelector("data");
  const text = data ? data.value : cell.textContent.trim();
  const number = text === "" ? NaN : Number(text);
  return Number.isNaN(number) ? text : number;
}

// Sorts numbers before texts.
function compare(a, b) {
  if (typeof a === typeof b) return typeof a === "number" ? a - b : a.localeCompare(b);
  return typeof a === "number" ? -1 : 1;
}

for (const table of document.querySelectorAll("table.sortable")) {
  const titles = [...table.tHead.rows[0].cells];
  titles.forEach((title, column) => {
    if (title.classList.contains("unsorted")) return;
    const button = document.createElement("button");
    button.type = "button";
    button.append(...title.childNodes);
    title.append(button);
    button.addEventListener("click", () => {
      const sign = title.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      titles.forEach((other) => other.removeAttribute("aria-sort"));
      title.setAttribute("aria-sort", sign === 1 ? "ascending" : "descending");
      const rows = [...table.tBodies[0].rows].map((row) => ({ row, key: valueOf(row.cells[column]) }));
      rows.sort((a, b) => sign * compare(a.key, b.key));
      table.tBodies[0].append(...rows.map(({ row }) => row));
    });
  });
}

for (const button of document.querySelectorAll("[data-seek]")) {
  button.addEventListener("click", () => {
    const video = button.closest("article").querySelector("video");
    video.currentTime = Number(button.dataset.seek);
  });
}

// Marks a table that is wider than its container, because phones show no scroll bars.
function markWide() {
  for (const place of document.querySelectorAll(".scroll")) {
    place.classList.toggle("wide", place.scrollWidth > place.clientWidth);
  }
}
markWide();
addEventListener("resize", markWide);
for (const details of document.querySelectorAll("details")) details.addEventListener("toggle", markWide);

// Expands all details for printing.
addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details")) details.open = true;
});
