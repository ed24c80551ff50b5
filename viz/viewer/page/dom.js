// Helpers for elements, texts and numbers. Names come from external files and messages, so they must be set as text, never
// as markup.
"use strict";

const Evalbus = {};

// Creates an element. Example: element("button", {class: "ev-icon", title: "Play", onclick: f}, child, "text", ...)
Evalbus.element = (tag, properties, ...children) => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties || {})) {
    if (value === null || value === undefined) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else made.setAttribute(name, value);
  }
  made.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return made;
};

// Creates an icon of lines that are 1.6 px wide, on a 16 x 16 grid.
Evalbus.icon = (paths, isFilled) => {
  const space = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(space, "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("aria-hidden", "true");
  svg.setAttribute("class", isFilled ? "ev-svg ev-filled" : "ev-svg");
  const path = document.createElementNS(space, "path");
  path.setAttribute("d", paths);
  svg.append(path);
  return svg;
};

// Sets the text only if it has changed, because setting it triggers a layout.
Evalbus.setText = (node, text) => {
  if (node.textContent !== text) node.textContent = text;
};

// Makes an external text safe for one line. Replaces control characters, and characters that change the text direction, by
// spaces.
Evalbus.words = (text) => String(text === null || text === undefined ? "" : text)
  .replace(/[\u0000-\u001f\u007f-\u009f\u200b-\u200f\u2028-\u202e\u2066-\u2069\ufeff]+/g, " ").trim();

// Replaces underscores by spaces: "left_gripper_touches_pot" becomes "left gripper touches pot".
Evalbus.spaced = (name) => Evalbus.words(name).replace(/_/g, " ");

// Returns the text of an event. Texts of grasps, releases and slips contain names of objects; other texts may contain file names
// or names of geoms, which are not changed.
Evalbus.eventText = ({ kind, text }) => (["grasp", "release", "slip"].includes(kind) ? Evalbus.spaced(text) : Evalbus.words(text));

// Returns the key of a row's episode, "run/episode".
Evalbus.keyOf = (row) => `${row.run}/${row.episode}`;

// Returns the result of a row of the list of episodes: "success", "failure", "incomplete" or, without a verdict, "unjudged".
Evalbus.resultOf = (row) => {
  if (!row.complete) return "incomplete";
  return row.failure_reason === "not_judged" ? "unjudged" : row.success ? "success" : "failure";
};

// Texts of end reasons and failure reasons, as in lcmtypes/end_reason.h.
Evalbus.REASON_TEXTS = { grasp_slip: "slipped from the gripper", grasp_miss: "missed the grasp", wrong_pose: "target pose not reached",
  stall: "robot stopped", timeout: "time limit" };
Evalbus.reasonText = (reason) => (Object.hasOwn(Evalbus.REASON_TEXTS, reason) ? Evalbus.REASON_TEXTS[reason] : Evalbus.spaced(reason));

// Returns the text that explains the outcome: the cause or, if there is none, the detail of the end reason (e.g. a policy's
// error) and the deciding condition.
Evalbus.reasonOf = (head) => head.cause_text ? Evalbus.words(head.cause_text) : [Evalbus.words(head.end_detail), Evalbus.spaced(head.explanation)].filter(Boolean).join("; ");

// Replaces the URL fragment at most once per PAUSE_MS and then with the latest text, because browsers limit the rate (Safari: 100
// calls of replaceState in 30 s). A fragment that is set meanwhile, such as by a link, is not replaced by an older text.
Evalbus.FragmentWriter = class {
  constructor(replace = (text) => history.replaceState(null, "", text), current = () => location.hash) {
    this.replace = replace;
    this.current = current;
    this.timer = null;
  }

  write(text) {
    this.text = text;
    if (this.timer !== null) {
      this.before = this.current();
      return;
    }
    this.put();
  }

  put() {
    this.replace(this.text);
    this.text = null;
    this.timer = setTimeout(() => {
      this.timer = null;
      if (this.text !== null && this.before === this.current()) this.put();
    }, Evalbus.FragmentWriter.PAUSE_MS);
  }
};

Evalbus.FragmentWriter.PAUSE_MS = 400;

// Text in the place of the scene until the first episode is loaded.
Evalbus.LOADING = "Loading the episode.";

// Returns the outcome and reason of the compared episode. end: name of the outcome. text: its reason, which may begin with this
// name.
Evalbus.textOfB = (end, text) => {
  const isRepeated = text.toLowerCase().startsWith(end);
  return `B: ${isRepeated ? end + text.slice(end.length) : [end, text].filter(Boolean).join(". ")}`;
};

// Formats a number: integers below 1e9 exactly, very large and very small numbers with a power of ten, all others with a
// number of decimals that suits their size. The number of characters changes as little as possible.
Evalbus.number = (value) => {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const size = Math.abs(value);
  const minus = (text) => text.replace("-", "−");
  if (Number.isInteger(value) && size < 1e9) return minus(String(value));
  if (size >= 1e7 || size < 1e-4) return minus(value.toExponential(2));
  const decimals = size >= 1000 ? 0 : size >= 100 ? 1 : size >= 10 ? 2 : size >= 0.01 ? 3 : 5;
  return minus(value.toFixed(decimals));
};

// Formats a number with this many decimals. A number that rounds to zero has no sign.
Evalbus.fixed = (value, decimals) => {
  const text = value.toFixed(decimals);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
};

// Formats a number with a number of decimals that suits values up to `most` and is the same for all of these values.
Evalbus.numberAmong = (value, most) => {
  if (!Number.isFinite(value) || !(most > 0) || most >= 1e7 || most < 1e-4) return Evalbus.number(value);
  const decimals = most >= 1000 ? 0 : most >= 100 ? 1 : most >= 10 ? 2 : most >= 0.01 ? 3 : 5;
  return Evalbus.fixed(value, decimals);
};

// Formats the value of a condition as Compared in metrics/task/predicate.h does: lengths to millimeters, angles to tenths of a
// degree (hundredths below 1 degree), with more digits if an unmet condition would otherwise seem to be at its threshold.
Evalbus.measured = (value, unit, threshold, isUnmet) => {
  if (!Number.isFinite(value) || (unit !== "m" && unit !== "deg")) return Evalbus.numberAmong(value, Math.abs(threshold) || Math.abs(value));
  let decimals = unit === "m" ? 3 : Math.abs(value) < 1 ? 2 : 1;
  while (isUnmet && value !== threshold && Number(value.toFixed(decimals)) === threshold && decimals < 9) ++decimals;
  return Evalbus.fixed(value, decimals);
};

// Returns "1 episode" or "3 episodes".
Evalbus.plural = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;

Evalbus.seconds = (value) => (value === null || !Number.isFinite(value) ? "–" : `${value.toFixed(2)} s`);

// Formats a share as in base/text.h: whole percents, halves up. 1e-9 is added, because k / n may be up to 1e-16 below the
// exact share.
Evalbus.percent = (share) => (Number.isFinite(share) ? `${Math.floor(100 * share + 0.5 + 1e-9)} %` : "–");

// Formats a difference as PercentagePoints in base/text.h does: halves away from zero, "+" before differences above zero.
Evalbus.points = (share, decimals = 0) => {
  const scale = 10 ** decimals;
  const size = Math.floor(100 * scale * Math.abs(share) + 0.5 + 1e-9) / scale;
  return `${size === 0 ? "" : share > 0 ? "+" : "−"}${size.toFixed(decimals)}`;
};

// Returns the number of decimals for a difference of rates, as PointDecimals in base/text.h does: 1 if whole points would
// contradict the rates in whole percents.
Evalbus.pointDecimals = (difference, rate, other) => {
  const whole = (share) => Math.floor(100 * share + 0.5 + 1e-9);
  return whole(Math.abs(difference)) === Math.abs(whole(rate) - whole(other)) ? 0 : 1;
};

// Formats p as PEquals in results/comparison_text.h does: halves up, but a p below 0.05 is not rounded to 0.05.
Evalbus.pText = (p) => {
  if (p < 0.001) return "p < 0.001";
  const rounded = Math.floor(1000 * p + 0.5 + 1e-9) / 1000;
  return p < 0.05 && rounded >= 0.05 ? `p = ${(Math.floor(10000 * p) / 10000).toFixed(4)}` : `p = ${rounded.toFixed(3)}`;
};

// Formats an interval as PercentText in results/summary_table.h does: one decimal if it is narrower than two percentage
// points.
Evalbus.percentRange = ([lower, upper]) => {
  const decimals = upper - lower < 0.02 ? 1 : 0;
  return `${(100 * lower).toFixed(decimals)} to ${(100 * upper).toFixed(decimals)} %`;
};

// Returns about `count` ticks from low to high with a step of 1, 2 or 5 times a power of ten.
Evalbus.ticksOf = (low, high, count) => {
  const span = high - low;
  if (!(span > 0)) return [low];
  const raw = span / Math.max(1, count);
  const power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = [1, 2, 5, 10].map((k) => k * power).find((candidate) => candidate >= raw * 0.999);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * span; ++k) ticks.push(k * step);
  return ticks;
};

// Returns the labels of an axis. All labels have as many decimals as the tick that needs most; zero has none.
Evalbus.axisTexts = (ticks) => {
  const exact = ticks.map((tick) => Number(tick.toPrecision(6)));
  const most = Math.max(...exact.map(Math.abs));
  const decimals = Math.max(...exact.map((tick) => (String(tick).split(".")[1] || "").length));
  if (most >= 1e7 || decimals > 6) return exact.map(Evalbus.number);
  return exact.map((tick) => (tick === 0 ? "0" : tick.toFixed(decimals).replace("-", "−")));
};

// Sets the canvas's resolution to its size in device pixels, and calls draw(context, width, height), which uses CSS pixels.
Evalbus.drawOn = (canvas, draw) => {
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return;
  const ratio = Math.min(window.devicePixelRatio || 1, 3);
  const w = Math.round(width * ratio), h = Math.round(height * ratio);
  if (canvas.width !== w) canvas.width = w;
  if (canvas.height !== h) canvas.height = h;
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  draw(context, width, height);
};

// Returns the current colors of viewer.css, which depend on light or dark mode.
Evalbus.paletteOf = (node) => {
  const style = getComputedStyle(node);
  const palette = {};
  for (const name of ["page", "text", "soft", "rule", "panel", "link", "none", "good", "bad", "bad-text", "warn", "left",
    "right", "b", "b-text", "o0", "o1", "o2", "o3"]) {
    palette[name] = style.getPropertyValue(`--${name}`).trim();
  }
  palette.font = style.fontFamily;
  return palette;
};

// Returns the name of the color (viewer.css) for the k-th part of a curve. If the part's name contains an arm, such as "left
// gripper to pot", this is the arm's color, otherwise a color that has no other meaning.
Evalbus.roleOf = (name, k, head) => {
  const words = ` ${Evalbus.spaced(name)} `;
  const arm = (head.arms || []).findIndex((one) => words.includes(` ${Evalbus.spaced(one)} `));
  return arm === 0 ? "left" : arm === 1 ? "right" : `o${k % 4}`;
};

// A list with rows of equal height. Only the visible rows exist in the DOM, because a run may have 100,000 episodes. Derived
// classes implement makeRow(), which returns an object with the row's `node`, and fill(slot, row), which sets its content.
Evalbus.RowList = class {
  // box: properties of the scrolling element. rows: properties of the element inside it that contains the rows.
  constructor(box, rows) {
    const e = Evalbus.element;
    this.rows = [];
    this.pool = [];
    this.filler = e("div", { role: "presentation" });
    this.window = e("div", { class: "ev-rows", ...rows });
    this.box = e("div", { tabindex: "0", "aria-label": "episodes", ...box }, this.filler, this.window);
    this.box.addEventListener("scroll", () => this.draw(), { passive: true });
    new ResizeObserver(() => this.redraw()).observe(this.box);
  }

  // Returns the height of a row in px, which may depend on the width of the list.
  get height() {
    return parseFloat(getComputedStyle(this.box).getPropertyValue("--row")) || 30;
  }

  // Must be called when `rows` has changed.
  redraw() {
    this.filler.style.height = `${this.rows.length * this.height}px`;
    this.draw();
  }

  draw() {
    const { height } = this;
    const first = Math.max(0, Math.floor(this.box.scrollTop / height) - 4);
    const count = Math.min(this.rows.length - first, Math.ceil(Math.min(this.box.clientHeight || 300, 3000) / height) + 8);
    while (this.pool.length < count) {
      this.pool.push(this.makeRow());
      this.window.append(this.pool.at(-1).node);
    }
    this.pool.forEach((slot, k) => {
      slot.node.hidden = k >= count;
      if (k < count) this.fill(slot, this.rows[first + k]);
    });
    this.window.style.transform = `translateY(${first * height}px)`;
  }

  reveal(row) {
    const { height } = this;
    const top = this.rows.indexOf(row) * height;
    if (top < this.box.scrollTop) this.box.scrollTop = top;
    if (top + height > this.box.scrollTop + this.box.clientHeight) this.box.scrollTop = top + height - this.box.clientHeight;
  }
};
