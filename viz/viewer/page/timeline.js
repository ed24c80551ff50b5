// The timeline below the image: stages, grasps, events, pinned curves. A click seeks to the time under the pointer, and the
// wheel zooms.
"use strict";

// Returns the end of an episode's time axis: its duration or, while it is running, a length that grows in steps.
Evalbus.axisEnd = (track) => {
  if (track.head.is_over) return Math.max(track.last * track.tickSeconds, track.tickSeconds);
  const now = track.last * track.tickSeconds;
  let end = 2;
  while (end < now * 1.02) end *= 1.5;
  return track.head.time_limit_s ? Math.min(end, Math.max(now, track.head.time_limit_s)) : end;
};

// Returns the part of [0, end] (s) that is shown after zooming `view` by `factor` around the time `center`, or null if all
// of it is shown. least: minimum length of the part, s. Pure.
Evalbus.zoomed = (view, end, center, factor, least) => {
  const { from, to } = view || { from: 0, to: end };
  const span = Math.max(least, (to - from) * factor);
  if (span >= end) return null;
  const begin = Math.max(0, Math.min(end - span, center - (center - from) * span / (to - from)));
  return { from: begin, to: begin + span };
};

Evalbus.Timeline = class {
  // onSeek(tick): called for a click and while dragging. onView(): called when the shown part of the time axis has changed.
  // onPoint(place): requests the scene at the time `pointed` in the element `place`, whenever `pointed` has changed;
  // onPoint(null) ends this.
  constructor(place, onSeek, onView, onPoint) {
    const e = Evalbus.element;
    this.onSeek = onSeek;
    this.onView = onView;
    this.onPoint = onPoint;
    this.pointed = null;  // time of a tick under the pointer, s; null if the pointer is not over the plot
    this.view = null;  // {from, to} in s if zoomed
    this.canvas = e("canvas", { class: "ev-lanes" });
    this.cursor = e("div", { class: "ev-cursor" });
    this.hover = e("div", { class: "ev-cursor ev-thin", hidden: "" });
    this.tip = e("div", { class: "ev-tip", hidden: "" });
    this.image = e("div", { class: "ev-tip-image ev-time-image", hidden: "" });
    this.slider = e("div", { class: "ev-timeline", role: "slider", tabindex: "0", "aria-label": "time",
      "aria-valuemin": "0", "aria-valuemax": "0", "aria-valuenow": "0" }, this.canvas, this.cursor, this.hover, this.tip, this.image);
    this.whole = e("button", { type: "button", class: "ev-whole", hidden: "", title: "show the whole episode (0)",
      onclick: () => this.setView(null) });
    place.append(this.slider, this.whole);
    this.slider.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      this.slider.setPointerCapture(event.pointerId);
      this.isDragged = true;
      this.setPointed(null);
      // A finger that moves up or down scrolls the page. This is known later, and is then reported as pointercancel.
      if (event.pointerType !== "touch") this.seekTo(event);
    });
    this.slider.addEventListener("pointermove", (event) => {
      if (this.isDragged) this.seekTo(event);
      this.point(event);
    });
    const release = () => { this.isDragged = false; };
    this.slider.addEventListener("pointerup", (event) => {
      if (this.isDragged) this.seekTo(event);
      release();
    });
    this.slider.addEventListener("pointercancel", release);
    this.slider.addEventListener("pointerleave", () => {
      this.tip.hidden = this.hover.hidden = true;
      this.setPointed(null);
    });
    this.slider.addEventListener("wheel", (event) => this.turn(event), { passive: false });
    new ResizeObserver(() => this.redraw()).observe(this.slider);
  }

  // tracks: A and, if two episodes are compared, B. pins: cards of `curves` that are shown as lanes. parting: null, or
  // {tick, text} of the point where A and B diverge.
  show(tracks, palette, { curves, pins, parting }) {
    if (!this.tracks || tracks.length !== this.tracks.length || tracks.some((track, k) => track !== this.tracks[k])) this.setPointed(null);
    const keys = tracks.map((track) => track.key).join();
    if (keys !== this.keys) this.view = null;
    this.keys = keys;
    this.tracks = tracks;
    this.palette = palette;
    this.parting = parting;
    this.lanes = [];
    const { LANE, CURVE, AXIS } = Evalbus.Timeline;
    tracks.forEach((track, k) => {
      const which = tracks.length > 1 ? (k === 0 ? "A " : "B ") : "";
      const isB = k > 0;
      if ((track.head.stages || []).length) this.lanes.push({ kind: "stages", track, isB, label: `${which}stages` });
      (track.head.grippers || []).forEach((gripper, index) => {
        const name = track.head.grippers.length > 1 ? Evalbus.spaced(gripper) : "gripper";
        this.lanes.push({ kind: "gripper", track, isB, gripper, index, label: `${which}${name}` });
      });
      this.lanes.push({ kind: "events", track, isB, label: `${which}events` });
    });
    for (const card of pins) this.lanes.push({ kind: "curve", track: tracks[0], curves, card, label: Evalbus.words(card.curve.label) });
    let top = 0;
    for (const lane of this.lanes) {
      lane.top = top;
      lane.height = lane.kind === "curve" ? CURVE : LANE;
      top += lane.height;
    }
    // Width of the longest label; the getter `left` limits it.
    const context = this.canvas.getContext("2d");
    context.font = `11px ${palette.font}`;
    this.labels = Math.ceil(Math.max(...this.lanes.map((lane) => context.measureText(lane.label).width)));
    this.slider.style.height = `${top + AXIS + 4}px`;
    this.redraw();
  }

  get left() { return Math.min(this.labels + 15, Math.max(72, 0.12 * this.slider.clientWidth)); }
  get right() { return 14; }
  get plotRight() { return this.slider.clientWidth - this.right; }
  get from() { return this.view ? this.view.from : 0; }
  get to() { return this.view ? this.view.to : this.end; }

  xOf(time_s) {
    return this.left + (this.plotRight - this.left) * (time_s - this.from) / (this.to - this.from);
  }

  timeAt(event) {
    const x = event.clientX - this.slider.getBoundingClientRect().left;
    return this.from + (x - this.left) / (this.plotRight - this.left) * (this.to - this.from);
  }

  // Returns the first and the last tick of the smallest range of ticks that covers the visible part of the timeline.
  ticksSeen(track) {
    return [Math.max(0, Math.floor(this.from / track.tickSeconds)), Math.min(track.last, Math.ceil(this.to / track.tickSeconds))];
  }

  tickAt(time_s) {
    return Math.round(time_s / this.tracks[0].tickSeconds);
  }

  seekTo(event) {
    if (!this.tracks || !this.tracks.length) return;
    this.onSeek(this.tickAt(Math.max(0, Math.min(this.end, this.timeAt(event)))));
  }

  // In a page that scrolls, the wheel zooms only with Ctrl. With Shift, or sideways, it moves the shown part.
  turn(event) {
    const isScrolling = document.scrollingElement.scrollHeight > innerHeight + 1;
    if (!this.tracks || (isScrolling && !event.ctrlKey)) return;
    event.preventDefault();
    const sideways = event.shiftKey ? event.deltaX || event.deltaY : event.deltaX;
    if (Math.abs(sideways) > Math.abs(event.shiftKey ? 0 : event.deltaY)) {
      if (!this.view) return;
      const span = this.to - this.from;
      const from = Math.max(0, Math.min(this.end - span, this.from + sideways / 600 * span));
      this.setView({ from, to: from + span });
    } else {
      this.zoom(Math.exp(Math.max(-100, Math.min(100, event.deltaY)) / 300), this.timeAt(event));
    }
  }

  // Zooms around a time or, if none is given, around the current time.
  zoom(factor, time_s) {
    if (!this.tracks || !this.tracks.length) return;
    const { tickSeconds } = this.tracks[0];
    const center = time_s === undefined ? (this.tick || 0) * tickSeconds : time_s;
    this.setView(Evalbus.zoomed(this.view, this.end, center, factor, 10 * tickSeconds));
  }

  setView(view) {
    this.view = view;
    if (this.isViewDue) return;
    // The timeline is redrawn at most once per animation frame.
    this.isViewDue = true;
    requestAnimationFrame(() => {
      this.isViewDue = false;
      this.redraw();
      this.onView();
    });
  }

  // Shows the time under the pointer, and the mark or the curve's values there.
  point(event) {
    if (!this.tracks || !this.tracks.length) return;
    const box = this.slider.getBoundingClientRect();
    const x = event.clientX - box.left, y = event.clientY - box.top;
    const isPlot = x >= this.left - 7 && x <= this.plotRight + 7;
    this.tip.hidden = this.hover.hidden = !isPlot;
    const time = Math.max(0, Math.min(this.end, this.timeAt(event)));
    // While the pointer is dragged, no image is needed, because the scene itself shows this time.
    this.setPointed(isPlot && !this.isDragged ? time : null, x);
    if (!isPlot) return;
    this.hover.style.transform = `translateX(${this.xOf(time).toFixed(1)}px)`;
    const lane = this.lanes.find((one) => y >= one.top && y < one.top + one.height);
    const near = (this.marks || []).filter((mark) => (mark.lane === lane || mark.lane === null) && x >= mark.from - 6 && x <= mark.to + 6);
    // If there are several marks, the narrowest is selected and, among equally narrow marks, the closest.
    near.sort((a, b) => (a.to - a.from) - (b.to - b.from) || Math.abs(a.from - x) - Math.abs(b.from - x));
    const text = lane && lane.kind === "curve" ? lane.curves.textAt(lane.card, time) : near.length ? near[0].text : "";
    Evalbus.setText(this.tip, [near.length && near[0].isPoint ? "" : `${time.toFixed(2)} s`, text].filter(Boolean).join(" · "));
    const width = this.tip.offsetWidth;
    this.tip.style.left = `${Math.max(0, Math.min(box.width - width, x - width / 2))}px`;
    this.tip.style.bottom = `${box.height - (lane ? lane.top : 0) + 4}px`;
  }

  // Shows the image of a time (s) above the point x of the timeline. setPointed(null) hides it.
  setPointed(time_s, x) {
    const was = this.pointed;
    this.pointed = time_s === null ? null : this.tickAt(time_s) * this.tracks[0].tickSeconds;
    if (time_s === null) this.image.hidden = true;
    else this.image.style.setProperty("--x", `${x.toFixed(0)}px`);
    if (was !== this.pointed) this.onPoint(time_s === null ? null : this.image);
  }

  redraw() {
    if (!this.tracks || !this.tracks.length) return;
    this.end = Math.max(...this.tracks.map(Evalbus.axisEnd));
    this.marks = [];
    this.whole.hidden = this.view === null;
    if (this.view) Evalbus.setText(this.whole, `${(this.to - this.from).toFixed(2)} of ${this.end.toFixed(2)} s · show all`);
    Evalbus.drawOn(this.canvas, (context, width, height) => this.draw(context, width, height));
    this.move(this.tick || 0);
  }

  draw(context, width, height) {
    const { AXIS } = Evalbus.Timeline;
    const palette = this.palette;
    context.font = `11px ${palette.font}`;
    context.textBaseline = "middle";
    const bottom = height - AXIS;
    context.lineWidth = 1;
    for (const time of Evalbus.ticksOf(this.from, this.to, (width - this.left) / 90)) {
      const x = Math.round(this.xOf(time)) + 0.5;
      context.strokeStyle = palette.rule;
      context.beginPath();
      context.moveTo(x, 0);
      context.lineTo(x, bottom);
      context.stroke();
      // The button "show all" covers the end of the axis.
      if (this.view && x + 20 > width - this.whole.offsetWidth) continue;
      context.fillStyle = palette.soft;
      context.textAlign = "center";
      context.fillText(`${Number(time.toPrecision(6))} s`, Math.min(x, width - 12), bottom + AXIS / 2 + 2);
    }
    for (const lane of this.lanes) {
      context.fillStyle = lane.isB ? palette["b-text"] : palette.soft;
      context.textAlign = "right";
      context.fillText(Evalbus.shortened(context, lane.label, this.left - 14), this.left - 10, lane.top + lane.height / 2);
      context.strokeStyle = palette.rule;
      context.beginPath();
      context.moveTo(this.left, lane.top + lane.height + 0.5);
      context.lineTo(this.plotRight, lane.top + lane.height + 0.5);
      context.stroke();
      context.save();
      context.beginPath();
      context.rect(this.left - 7, lane.top, this.plotRight - this.left + 14, lane.height);
      context.clip();
      Evalbus.lanes[lane.kind](this, context, lane);
      context.restore();
    }
    this.drawParting(context, bottom);
  }

  drawParting(context, bottom) {
    if (!this.parting) return;
    const x = this.xOf(this.parting.tick * this.tracks[0].tickSeconds);
    if (x < this.left - 7 || x > this.plotRight + 7) return;
    context.strokeStyle = this.palette.b;
    context.lineWidth = 2;
    context.setLineDash([4, 3]);
    context.beginPath();
    context.moveTo(x, 0);
    context.lineTo(x, bottom);
    context.stroke();
    context.setLineDash([]);
    context.lineWidth = 1;
    Evalbus.polygon(context, [[x - 5, bottom + 1], [x + 5, bottom + 1], [x, bottom - 7]], this.palette.b, true);
    this.mark(null, x - 2, x + 2, this.parting.text, true);
  }

  // Registers the text of the tooltip between two x coordinates; lane null: in all lanes. isPoint: whether the text contains
  // the time.
  mark(lane, from, to, text, isPoint = false) {
    this.marks.push({ lane, from, to, text, isPoint });
  }

  move(tick) {
    this.tick = tick;
    if (!this.tracks || !this.tracks.length) return;
    const track = this.tracks[0], time = tick * track.tickSeconds;
    if (this.view && (time < this.view.from || time > this.view.to) && !this.isViewDue && tick !== this.keptTick) {
      // The shown part follows the cursor, unless the user has moved it away from the cursor.
      const span = this.to - this.from;
      const from = Math.max(0, Math.min(this.end - span, time - (time > this.view.to ? 0.1 : 0.9) * span));
      this.setView({ from, to: from + span });
    }
    this.keptTick = tick;
    this.cursor.hidden = time < this.from - 1e-9 || time > this.to + 1e-9;
    this.cursor.style.transform = `translateX(${this.xOf(time).toFixed(2)}px)`;
    const text = `${(Math.floor(tick) * track.tickSeconds).toFixed(2)} s`;
    if (this.slider.getAttribute("aria-valuetext") === text) return;
    this.slider.setAttribute("aria-valuemax", String(track.last));
    this.slider.setAttribute("aria-valuenow", String(Math.floor(tick)));
    this.slider.setAttribute("aria-valuetext", text);
  }
};

Evalbus.Timeline.LANE = 24;
Evalbus.Timeline.CURVE = 54;
Evalbus.Timeline.AXIS = 20;
