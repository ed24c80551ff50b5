// Sorts tables by the clicked column; a second click reverses the order. Shows long tables of
// episodes in pages. Marks tables that can be scrolled. A click on an event's time moves the video
// to this time. Expands folded parts for printing. This file must not contain characters that XML or
// HTML would interpret as markup.
"use strict";

function valueOf(cell) {
  const data = cell.querySelector("data");
  const text = data ? data.value : cell.textContent.trim();
  const number = text === "" ? NaN : Number(text);
  return Number.isNaN(number) ? text : number;
}

// Orders numbers before texts.
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
      table.dispatchEvent(new Event("sorted"));
    });
  });
}

// Maximum number of rows of a table that is not split into pages.
const ROWS_OF_PAGE = 100;

function makePages(table) {
  const filter = table.closest("section")?.querySelector(".only-failures");
  const pager = document.createElement("div");
  const text = document.createElement("span");
  let page = 0;
  const shownRows = () => {
    const rows = [...table.tBodies[0].rows];
    return filter?.checked ? rows.filter((row) => !row.classList.contains("good")) : rows;
  };
  const show = () => {
    const rows = shownRows();
    page = Math.max(0, Math.min(page, Math.ceil(rows.length / ROWS_OF_PAGE) - 1));
    const first = page * ROWS_OF_PAGE, end = Math.min(first + ROWS_OF_PAGE, rows.length);
    rows.forEach((row, i) => row.classList.toggle("elsewhere", Math.floor(i / ROWS_OF_PAGE) !== page));
    text.textContent = rows.length ? `rows ${first + 1} to ${end} of ${rows.length}` : "no rows";
  };
  const button = (label, step) => {
    const element = document.createElement("button");
    element.type = "button";
    element.textContent = label;
    element.addEventListener("click", () => { page += step; show(); });
    return element;
  };
  pager.className = "pager";
  pager.append(button("previous", -1), text, button("next", 1));
  table.closest(".scroll").after(pager);
  filter?.addEventListener("change", () => { page = 0; show(); });
  table.addEventListener("sorted", () => { page = 0; show(); });
  // A link may lead to a row on another page.
  const follow = () => {
    const row = document.getElementById(location.hash.slice(1));
    const index = row ? shownRows().indexOf(row) : -1;
    if (index === -1) return;
    page = Math.floor(index / ROWS_OF_PAGE);
    show();
    row.scrollIntoView();
  };
  addEventListener("hashchange", follow);
  show();
  follow();
}

for (const table of document.querySelectorAll("table.episodes")) {
  if (table.tBodies[0].rows.length > ROWS_OF_PAGE) makePages(table);
}

for (const button of document.querySelectorAll("[data-seek]")) {
  button.addEventListener("click", () => {
    const video = button.closest("article").querySelector("video");
    video.currentTime = Number(button.dataset.seek);
  });
}

// Marks tables that are wider than their containers, because phones show no scroll bars. The Tab key stops only
// at these.
function markWide() {
  for (const place of document.querySelectorAll(".scroll")) {
    const isWide = place.classList.toggle("wide", place.scrollWidth > place.clientWidth);
    place.tabIndex = isWide ? 0 : -1;
    place.role = isWide ? "group" : null;
    place.ariaLabel = isWide ? "wide table" : null;
  }
}
markWide();
addEventListener("resize", markWide);
for (const details of document.querySelectorAll("details")) details.addEventListener("toggle", markWide);

// Expands details for printing, except those that hold further figures or settings.
addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details:not(.more)")) details.open = true;
});
