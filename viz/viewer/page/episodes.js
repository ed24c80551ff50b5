// Shows the list of all episodes, which can be filtered and sorted, and the wall of failures (a grid of thumbnails).
"use strict";

Evalbus.Episodes = class extends Evalbus.RowList {
  // board: provides the rows. actions: {changed(filter)}.
  constructor(place, board, thumbnails, actions) {
    super({ class: "ev-table-box", role: "rowgroup" });
    const e = Evalbus.element;
    this.board = board;
    this.actions = actions;
    this.sort = { name: "", isDown: false };
    this.filter = e("input", { type: "search", class: "ev-filter-text", placeholder: "slips>0 and time<6", spellcheck: "false",
      autocomplete: "off", "aria-label": "filter", title: "filter (/)" });
    this.filter.addEventListener("input", () => {
      this.apply();
      actions.changed(this.filter.value);
    });
    this.filter.addEventListener("keydown", (event) => {
      if (event.key !== "Escape" && event.key !== "Enter") return;
      if (this.isWall) this.filter.blur();
      else this.box.focus();
    });
    this.problem = e("p", { class: "ev-filter-problem", role: "status" });
    this.count = e("span", { class: "ev-note" });
    this.asList = e("button", { type: "button", onclick: () => this.setWall(false) }, "List");
    this.asWall = e("button", { type: "button", onclick: () => this.setWall(true) }, "Failure wall");
    this.head = e("div", { class: "ev-table-row ev-table-head", role: "row" }, Evalbus.Episodes.COLUMNS.map((column) => {
      const button = e("button", { type: "button", onclick: () => this.sortBy(column.name) }, column.title);
      return e("span", { class: `ev-col-${column.name}`, role: "columnheader" }, button);
    }));
    this.none = e("p", { class: "ev-note", role: "status" });
    this.table = e("div", { class: "ev-table", role: "table", "aria-label": "episodes" }, e("div", { role: "rowgroup" }, this.head), this.box);
    this.wall = new Evalbus.Wall(thumbnails, () => this.setWall(false));
    place.append(e("h1", { class: "ev-hidden" }, "Episodes"), e("div", { class: "ev-filter-bar" }, this.filter, this.count, e("span", { class: "ev-segments" }, this.asList, this.asWall)),
      this.problem, this.none, this.table, this.wall.place);
    this.setWall(false);
  }

  setWall(isWall) {
    this.isWall = isWall;
    this.asList.setAttribute("aria-pressed", String(!isWall));
    this.asWall.setAttribute("aria-pressed", String(isWall));
    this.table.hidden = isWall;
    this.wall.place.hidden = !isWall;
    this.showRows();
  }

  setFilter(text) {
    if (this.filter.value === text) return;
    this.filter.value = text;
    this.apply();
  }

  // Shows the current rows of the board.
  show() {
    this.all = this.board.rows();
    this.apply();
  }

  apply() {
    let accepts = () => true;
    try {
      accepts = Evalbus.parseFilter(this.filter.value);
      Evalbus.setText(this.problem, "");
    } catch (error) {
      if (!(error instanceof Evalbus.FilterError)) throw error;
      Evalbus.setText(this.problem, error.message);
    }
    this.filter.setAttribute("aria-invalid", String(this.problem.textContent !== ""));
    this.rows = (this.all || []).filter(accepts);
    const column = Evalbus.Episodes.COLUMNS.find((one) => one.name === this.sort.name);
    if (column) this.rows.sort((a, b) => Evalbus.Episodes.compare(column.value(a), column.value(b), this.sort.isDown));
    this.showRows();
  }

  // Compares two values for sorting. Missing values come last in both directions.
  static compare(a, b, isDown) {
    const isNone = (value) => value === null || value === undefined || value === "" || Number.isNaN(value);
    if (isNone(a) || isNone(b)) return isNone(a) - isNone(b);
    const order = typeof a === "string" ? a.localeCompare(b) : a - b;
    return isDown ? -order : order;
  }

  // Sorts by a column. The first click sorts ascending, the second descending, and the third restores the original order.
  sortBy(name) {
    const isSame = this.sort.name === name;
    this.sort = isSame && this.sort.isDown ? { name: "", isDown: false } : { name, isDown: isSame };
    this.head.childNodes.forEach((cell, k) => {
      const isSorted = Evalbus.Episodes.COLUMNS[k].name === this.sort.name;
      cell.setAttribute("aria-sort", isSorted ? (this.sort.isDown ? "descending" : "ascending") : "none");
    });
    this.apply();
  }

  // Shows the rows that the filter accepts or, on the wall, the failures among them.
  showRows() {
    const accepted = this.isWall ? (list) => list.filter((row) => Evalbus.FILTER_TEXTS.result(row) === "failure") : (list) => list;
    const shown = accepted(this.rows), all = accepted(this.all || []);
    const count = (list) => list.length.toLocaleString("en");
    Evalbus.setText(this.count, `${shown.length === all.length ? "" : `${count(shown)} of `}${count(all)} ${this.isWall ? "failures" : "episodes"}`);
    Evalbus.setText(this.none, shown.length ? "" : `No ${this.isWall ? "failures" : "episodes"}${all.length ? " match the filter" : ""}.`);
    if (this.isWall) this.wall.show(shown);
    else this.redraw();
  }

  makeRow() {
    const e = Evalbus.element;
    const slot = { cells: Evalbus.Episodes.COLUMNS.map((column) => e("span", { class: `ev-col-${column.name}`, role: "cell" })) };
    // The link covers the whole row (board.css).
    slot.link = e("a", { class: "ev-row-link" });
    slot.link.addEventListener("focus", () => this.select(slot.row));
    slot.cells[0].append(slot.link);
    slot.node = e("div", { class: "ev-table-row", role: "row" }, slot.cells);
    return slot;
  }

  fill(slot, row) {
    slot.row = row;
    const canOpen = row.has_track !== false;
    const link = canOpen ? Evalbus.episodeLink(row) : null;
    if (link) slot.link.href = link;
    else slot.link.removeAttribute("href");
    slot.link.setAttribute("aria-label", `${Evalbus.words(row.policy)}, episode ${row.episode}: ${Evalbus.FILTER_TEXTS.result(row)}`);
    Evalbus.Episodes.COLUMNS.forEach((column, k) => Evalbus.setText(k === 0 ? slot.link : slot.cells[k], column.text(row)));
    slot.cells[0].dataset.outcome = Evalbus.FILTER_TEXTS.result(row);
    slot.node.title = Evalbus.words(row.cause_text || row.text);
    slot.node.setAttribute("aria-selected", String(Boolean(this.selected) && Evalbus.keyOf(row) === this.selected));
  }

  select(row) {
    this.selected = row ? Evalbus.keyOf(row) : null;
    this.draw();
  }

  // Returns the next row after the episode `key` ("run/episode") for which `accepts` returns true, or null if there is none.
  // way: 1 for down, -1 for up.
  neighbor(key, way, accepts) {
    const at = this.rows.findIndex((row) => Evalbus.keyOf(row) === key);
    for (let k = at < 0 && way < 0 ? this.rows.length - 1 : at + way; k >= 0 && k < this.rows.length; k += way) {
      if (accepts(this.rows[k])) return this.rows[k];
    }
    return null;
  }

  reveal(row) {
    super.reveal(row);
    this.select(row);
  }
};

// Returns the note on an episode, marked by a pencil, or the sentence of its cause. In ascending order, notes come first.
Evalbus.noteOrCause = (row) => (row.note ? `✎ ${Evalbus.words(row.note)}` : Evalbus.words(row.cause_text || row.text));

Evalbus.isFailure = (row) => Evalbus.resultOf(row) === "failure" && row.has_track !== false;

Evalbus.Episodes.COLUMNS = [
  { name: "result", title: "result", value: Evalbus.FILTER_TEXTS.result,
    text: (row) => ({ success: "✓", failure: "✕", incomplete: "–", unjudged: "–" }[Evalbus.FILTER_TEXTS.result(row)]) },
  { name: "policy", title: "policy", value: (row) => row.policy, text: (row) => Evalbus.words(row.policy) },
  { name: "task", title: "task", value: Evalbus.FILTER_TEXTS.task, text: (row) => Evalbus.spaced(Evalbus.FILTER_TEXTS.task(row)) },
  { name: "episode", title: "episode", value: (row) => row.episode, text: (row) => String(row.episode) },
  { name: "reason", title: "reason", value: (row) => Evalbus.reasonText(Evalbus.FILTER_TEXTS.reason(row)), text: (row) => Evalbus.reasonText(Evalbus.FILTER_TEXTS.reason(row)) },
  { name: "time", title: "end", value: (row) => row.time_s, text: (row) => Evalbus.seconds(row.time_s) },
  { name: "slips", title: "slips", value: (row) => row.slips, text: (row) => Evalbus.number(row.slips) },
  { name: "grasps", title: "grasps", value: (row) => row.grasps, text: (row) => Evalbus.number(row.grasps) },
  { name: "stages", title: "stages", value: (row) => row.stages, text: (row) => Evalbus.number(row.stages) },
  { name: "text", title: "note, cause", value: (row) => Evalbus.noteOrCause(row), text: (row) => Evalbus.noteOrCause(row) },
];

// Shows failures as images of their decisive moments, grouped by reason. The image under the pointer or with the keyboard
// focus is animated.
Evalbus.Wall = class {
  // showList(): shows the list instead of the wall.
  constructor(thumbnails, showList) {
    this.showList = showList;
    this.thumbnails = thumbnails;
    this.place = Evalbus.element("div", { class: "ev-wall" });
    this.waiting = [];
    thumbnails.onIdle = () => this.drawNext();
  }

  show(rows) {
    const layout = JSON.stringify(rows.map((row) => [Evalbus.keyOf(row), row.seed, row.failure_reason, row.time_s]));
    if (layout === this.layout) {
      // Drawing stops while the wall is hidden.
      this.drawNext();
      return;
    }
    this.layout = layout;
    this.hasTasks = new Set(rows.map(Evalbus.FILTER_TEXTS.task)).size > 1;
    const groups = new Map();
    for (const row of rows) {
      const reason = Evalbus.FILTER_TEXTS.reason(row);
      if (!groups.has(reason)) groups.set(reason, []);
      groups.get(reason).push(row);
    }
    this.waiting = [];
    const e = Evalbus.element;
    this.place.replaceChildren(...[...groups].sort((a, b) => b[1].length - a[1].length).flatMap(([reason, list]) => {
      const more = list.length - Evalbus.Wall.PER_REASON;
      return [e("h2", {}, `${Evalbus.reasonText(reason)} (${list.length.toLocaleString("en")})`),
        e("div", { class: "ev-cards" }, list.slice(0, Evalbus.Wall.PER_REASON).map((row) => this.card(row))),
        more > 0 ? e("p", {}, e("a", { href: Evalbus.listLink(`reason=${Evalbus.filterValue(reason)}`), onclick: this.showList }, `${more.toLocaleString("en")} more in the list`)) : null];
    }).filter(Boolean));
    this.drawNext();
  }

  card(row) {
    const e = Evalbus.element;
    const canvas = e("canvas", { width: "240", height: "180", "aria-hidden": "true" });
    const image = e("span", { class: "ev-card-image" }, canvas);
    const link = row.has_track === false ? null : Evalbus.episodeLink(row);
    const card = e("a", { class: "ev-failure", href: link }, image,
      e("b", {}, Evalbus.words(row.policy)), e("span", {}, `${this.hasTasks ? `${Evalbus.spaced(Evalbus.FILTER_TEXTS.task(row))}, ` : ""}episode\u00a0${row.episode}`),
      e("span", { class: "ev-why" }, Evalbus.words(row.cause_text || row.text)));
    if (link) {
      this.waiting.push([row, canvas]);
      for (const kind of ["pointerenter", "focus"]) card.addEventListener(kind, () => this.thumbnails.play(row, image));
      for (const kind of ["pointerleave", "blur"]) card.addEventListener(kind, () => this.thumbnails.stop());
    }
    return card;
  }

  // Draws the images of the cards one after another, until all are drawn, an image is played, or the wall is hidden.
  async drawNext() {
    if (this.isDrawing) return;
    this.isDrawing = true;
    while (this.waiting.length && !this.thumbnails.isPlaying && this.place.offsetParent !== null) {
      const [row, canvas] = this.waiting[0];
      const isDrawn = await this.thumbnails.still(row, canvas);
      if (isDrawn !== null && this.waiting.length && this.waiting[0][1] === canvas) this.waiting.shift();
    }
    this.isDrawing = false;
  }
};

Evalbus.Wall.PER_REASON = 12;
