// Elements, words and numbers of the page. Names come from files and messages of others: they are set as text, never
// as markup.
"use strict";

const Evalbus = {};

// element("button", {class: "ev-icon", title: "Play", onclick: f}, child, "text", ...)
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

// Drawn by lines of 1.6 px in a square of 16.
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

// Writes only what has changed: a text set anew costs a layout.
Evalbus.setText = (node, text) => {
  if (node.textContent !== text) node.textContent = text;
};

// What others wrote, fit for one line: control characters and those that turn the line's direction become spaces.
Evalbus.words = (text) => String(text === null || text === undefined ? "" : text)
  .replace(/[\u0000-\u001f\u007f-\u009f\u200b-\u200f\u2028-\u202e\u2066-\u2069\ufeff]+/g, " ").trim();

// "left_gripper_holds_pot" as people read it.
Evalbus.spaced = (name) => Evalbus.words(name).replace(/_/g, " ");

// Why an episode came out so: the words of what ended it, say a policy's error, as they are; then what decided.
Evalbus.reasonOf = (head) => [Evalbus.words(head.end_detail), Evalbus.spaced(head.explanation)].filter(Boolean).join("; ");

// Four digits that count; a place that grows does not jump.
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

// One of many that reach up to `most`: all with as many decimals, so that none jumps.
Evalbus.numberAmong = (value, most) => {
  if (!Number.isFinite(value) || !(most > 0) || most >= 1e7 || most < 1e-4) return Evalbus.number(value);
  const decimals = most >= 1000 ? 0 : most >= 100 ? 1 : most >= 10 ? 2 : most >= 0.01 ? 3 : 5;
  const text = value.toFixed(decimals);
  return (Number(text) === 0 ? text.replace("-", "") : text).replace("-", "−");
};

Evalbus.seconds = (value) => (value === null || !Number.isFinite(value) ? "–" : `${value.toFixed(2)} s`);

Evalbus.percent = (share) => (share === null || share === undefined ? "–" : `${(100 * share).toFixed(0)} %`);

// Steps of 1, 2 or 5 times a power of ten, about `count` of them from low to high.
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

// A canvas of as many pixels as its place has, drawn by `draw(context, width, height)` in CSS pixels.
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

// The palette of viewer.css as it is now, light or dark.
Evalbus.paletteOf = (node) => {
  const style = getComputedStyle(node);
  const palette = {};
  for (const name of ["page", "text", "soft", "rule", "panel", "link", "good", "bad", "none", "c0", "c1", "c2", "c3",
    "c4", "c5"]) {
    palette[name] = style.getPropertyValue(`--${name}`).trim();
  }
  palette.font = style.fontFamily;
  palette.parts = [palette.c0, palette.c1, palette.c2, palette.c3, palette.c4, palette.c5];
  return palette;
};
