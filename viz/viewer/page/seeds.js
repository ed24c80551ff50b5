// The matrix of seeds. Rows are policies and columns are seeds. A cell contains a check mark, the letter of the failure
// reason, or a dash for an incomplete episode. A click shows the episode next to the best episode of another policy with this
// seed.
"use strict";

// Returns a letter for each reason. reasons: the most frequent first. The letter is the first free one among the initials of
// the reason's words, its other letters, and the alphabet; "?" if none is free.
Evalbus.lettersOf = (reasons) => {
  const letters = new Map(), used = new Set();
  for (const reason of reasons) {
    const words = Evalbus.reasonText(reason).toUpperCase().split(" ");
    const wanted = [...words.map((word) => word[0]), ...words.join(""), ..."ABCDEFGHIJKLMNOPQRSTUVWXYZ"];
    const letter = wanted.find((one) => /[A-Z]/.test(one || "") && !used.has(one)) || "?";
    used.add(letter);
    letters.set(reason, letter);
  }
  return letters;
};

// Returns the row to show next to `row`, among the episodes of other policies with the same seed: the fastest success or, if
// there is none, the first episode. Returns null if there are no such episodes.
Evalbus.partnerOf = (row, rows) => {
  const others = rows.filter((one) => one && one !== row && one.policy !== row.policy && one.has_track !== false);
  const best = others.filter((one) => one.success && one.complete).sort((a, b) => a.time_s - b.time_s)[0];
  return best || others[0] || null;
};

Evalbus.episodeLink = (row, other) => `#view:run=${row.run},episode=${row.episode},t=${Evalbus.startOf(row).toFixed(3)}`
  + (other ? `,other=${other.run}/${other.episode}/beside` : "");

Evalbus.Seeds = class {
  constructor(viewer, hover) {
    const e = Evalbus.element;
    this.viewer = viewer;
    this.hover = hover;
    this.most = Evalbus.Seeds.PAGE;
    this.onlyDifferent = e("input", { type: "checkbox" });
    this.onlyDifferent.addEventListener("change", () => this.redraw());
    this.legend = e("p", { class: "ev-legend" });
    this.tasks = e("div", { class: "ev-matrices" });
    this.place = e("div", {}, e("div", { class: "ev-seed-tools" }, this.legend,
      e("label", {}, this.onlyDifferent, " only seeds on which the policies differ")), this.tasks);
    this.rowOf = new WeakMap();  // by cell
    for (const kind of ["pointerover", "focusin"]) {
      this.tasks.addEventListener(kind, (event) => this.hover(this.rowOf.get(event.target) || null, event.target));
    }
    for (const kind of ["pointerleave", "focusout"]) this.tasks.addEventListener(kind, () => this.isRedrawing || this.hover(null));
    // Each matrix is one stop of the Tab key. The arrow keys move within the matrix.
    this.tasks.addEventListener("focusin", (event) => this.stopAt(event.target));
    this.tasks.addEventListener("keydown", (event) => this.step(event));
    new ResizeObserver(() => this.place.clientWidth !== this.width && this.redraw()).observe(this.place);
  }

  show(board) {
    this.board = board;
    this.isLoading = !board.hasEpisodesOf(board.head);
    const { runs, notes } = this.viewer;
    const state = JSON.stringify([board.head.policies.map((policy) => [policy.name, policy.runs.map((run) =>
      [runs.has(run) ? runs.get(run).changes : 0, ...(notes.byRun.get(run) || [])]), policy.runs_done]), board.head.tasks.length,
    this.isLoading, board.head.policies.map((policy) => board.isGone(policy))]);
    if (state === this.state) return;
    this.state = state;
    this.redraw();
  }

  redraw() {
    if (!this.board || !this.place.clientWidth) return;
    this.width = this.place.clientWidth;
    this.place.style.setProperty("--name", `${this.nameWidth()}px`);
    const { policies, tasks } = this.board.head;
    const rows = policies.map((_, k) => (this.isLoading ? [] : this.board.rowsOf(k)));
    const counts = new Map();
    for (const row of rows.flat()) {
      const reason = Evalbus.FILTER_TEXTS.reason(row);
      if (Evalbus.resultOf(row) === "failure") counts.set(reason, (counts.get(reason) || 0) + 1);
    }
    const reasons = [...counts].sort((a, b) => b[1] - a[1] || (a[0] < b[0] ? -1 : 1));
    this.letters = Evalbus.lettersOf(reasons.map(([reason]) => reason));
    this.showLegend(reasons, new Set(rows.flat().map(Evalbus.resultOf)));
    this.onlyDifferent.parentElement.hidden = policies.length < 2;
    // The keyboard focus must be kept when new episodes arrive.
    const focused = this.rowOf.get(document.activeElement);
    this.focused = focused && Evalbus.keyOf(focused);
    this.toFocus = null;
    this.isRedrawing = true;
    this.tasks.replaceChildren(...tasks.map((task) => this.matrix(task.name, policies,
      rows.map((list) => list.filter((row) => `${row.task}/${row.variation}` === task.name)))));
    for (const matrix of this.tasks.children) {
      const first = matrix.querySelector("a.ev-cell");
      if (first) first.tabIndex = 0;
    }
    this.isRedrawing = false;
    if (this.toFocus) this.toFocus.focus({ preventScroll: true });
    else if (focused) this.hover(null);
  }

  // Returns the width of the policies' names, px. Longer names are shortened.
  nameWidth() {
    const context = document.createElement("canvas").getContext("2d");
    context.font = `13px ${getComputedStyle(this.place).fontFamily}`;
    const names = this.board.head.policies.map((policy) => context.measureText(Evalbus.words(policy.name)).width);
    return Math.ceil(Math.min(Math.max(70, ...names) + 12, Math.max(132, 0.25 * this.width)));
  }

  // results: results of the episodes.
  showLegend(reasons, results) {
    const e = Evalbus.element;
    this.legend.replaceChildren(e("span", {}, e("i", { class: "ev-cell", "data-outcome": "success" }, "✓"), " success"),
      ...reasons.map(([reason, count]) => e("a", { href: Evalbus.listLink(`reason=${Evalbus.filterValue(reason)}`) },
        e("i", { class: "ev-cell", "data-outcome": "failure" }, this.letters.get(reason)), ` ${Evalbus.reasonText(reason)} (${count.toLocaleString("en")})`)),
      ...[["incomplete", "not scored"], ["unjudged", "not judged"]].filter(([result]) => results.has(result)).map(([result, text]) =>
        e("span", {}, e("i", { class: "ev-cell", "data-outcome": result }, "–"), ` ${text}`)));
  }

  // rows: rows of each policy.
  matrix(task, policies, rows) {
    const e = Evalbus.element;
    const bySeed = new Map();
    rows.forEach((list, k) => list.forEach((row) => {
      if (!bySeed.has(row.seed)) bySeed.set(row.seed, []);
      bySeed.get(row.seed)[k] = row;
    }));
    let columns = [...bySeed.values()].sort((a, b) => a.find(Boolean).episode - b.find(Boolean).episode);
    if (this.onlyDifferent.checked) {
      columns = columns.filter((column) => new Set(column.filter((row) => row && ["success", "failure"].includes(Evalbus.resultOf(row))).map((row) => row.success)).size > 1);
    }
    const shown = columns.slice(0, this.most);
    const perBand = Math.max(5, 5 * Math.floor((this.width - this.nameWidth()) / Evalbus.Seeds.CELL / 5));
    const bands = [];
    for (let from = 0; from < shown.length; from += perBand) bands.push(this.band(shown.slice(from, from + perBand), policies));
    const more = columns.length - shown.length;
    const showMore = () => {
      this.most += 5 * Evalbus.Seeds.PAGE;
      this.redraw();
    };
    return e("div", { class: "ev-matrix" }, e("h3", {}, Evalbus.spaced(task)), bands.length ? bands : e("p", { class: "ev-note" }, bySeed.size ? "no seed on which the policies differ" : this.isLoading ? "loading" : policies.every((policy) => this.board.isGone(policy)) ? "folder not found" : "no episode yet"),
      more > 0 ? e("p", { class: "ev-segments" }, e("button", { type: "button", onclick: showMore }, `${more.toLocaleString("en")} more seeds`)) : null);
  }

  band(columns, policies) {
    const e = Evalbus.element;
    const line = (policy, k) => e("div", { class: "ev-seed-line" }, e("span", { class: "ev-seed-policy", title: Evalbus.words(policy.name) },
      Evalbus.words(policy.name)), columns.map((column) => this.cell(column[k], column)));
    const first = columns.map((column) => column.find(Boolean).episode);
    return e("div", { class: "ev-band" }, e("div", { class: "ev-seed-line", "aria-hidden": "true" },
      e("span", { class: "ev-seed-policy ev-note" }, "episode"),
      first.map((episode, i) => e("span", { class: "ev-cell ev-seed-number" }, i % 5 === 0 ? String(episode) : ""))),
    policies.map(line));
  }

  stopAt(cell) {
    if (!this.rowOf.has(cell)) return;
    for (const other of cell.closest(".ev-matrix").querySelectorAll("a.ev-cell[tabindex='0']")) other.tabIndex = -1;
    cell.tabIndex = 0;
  }

  step(event) {
    const ways = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    if (!(event.key in ways) || !this.rowOf.has(event.target)) return;
    event.preventDefault();
    event.stopPropagation();
    const [dx, dy] = ways[event.key];
    // A step along a row continues in the next band. A step down from the last row of a band leads to the first row of the
    // next band.
    const lines = [...event.target.closest(".ev-matrix").querySelectorAll(".ev-seed-line:not([aria-hidden])")]
      .map((line) => [...line.querySelectorAll(".ev-cell")]);
    const perBand = this.board.head.policies.length;
    let y = lines.findIndex((line) => line.includes(event.target)), x = lines[y].indexOf(event.target);
    do {
      x += dx;
      y += dy;
      if (dx > 0 && x === lines[y].length) [x, y] = [0, y + perBand];
      if (dx < 0 && x < 0) [x, y] = [(lines[y - perBand] || []).length - 1, y - perBand];
    } while (lines[y] && lines[y][x] && !this.rowOf.has(lines[y][x]));
    if (lines[y] && lines[y][x]) lines[y][x].focus();
  }

  cell(row, column) {
    if (!row) return Evalbus.element("span", { class: "ev-cell", "data-outcome": "none" });
    const outcome = Evalbus.FILTER_TEXTS.result(row);
    const reason = Evalbus.FILTER_TEXTS.reason(row);
    const sign = outcome === "success" ? "✓" : outcome === "failure" ? this.letters.get(reason) : "–";
    const canOpen = row.has_track !== false;
    const cell = Evalbus.element(canOpen ? "a" : "span", { class: row.note ? "ev-cell ev-noted" : "ev-cell", "data-outcome": outcome,
      href: canOpen ? Evalbus.episodeLink(row, Evalbus.partnerOf(row, column)) : null, tabindex: canOpen ? "-1" : null, "aria-describedby": "ev-hover",
      "aria-label": `${Evalbus.words(row.policy)}, episode ${row.episode}: ${Evalbus.reasonText(outcome === "success" ? "success" : reason)}` }, sign);
    this.rowOf.set(cell, row);
    if (Evalbus.keyOf(row) === this.focused) this.toFocus = cell;
    return cell;
  }
};

Evalbus.Seeds.PAGE = 200;  // seeds that are shown at first
Evalbus.Seeds.CELL = 24;  // px; as in board.css
