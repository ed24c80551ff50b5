// The timeline below the image: stages, objects held by each gripper, events. A click seeks to its time.
"use strict";

// End of an episode's time axis: its duration or, while it is running, a length that grows in steps.
Evalbus.axisEnd = (track) => {
  if (track.head.is_over) return Math.max(track.last * track.tickSeconds, track.tickSeconds);
  const now = track.last * track.tickSeconds;
  let end = 2;
  while (end < now * 1.02) end *= 1.5;
  return track.head.time_limit_s ? Math.min(end, Math.max(now, track.head.time_limit_s)) : end;
};

Evalbus.Timeline = class {
  // onSeek(tick): also called while dragging.
  constructor(place, onSeek) {
    this.onSeek = onSeek;
    this.canvas = Evalbus.element("canvas", { class: "ev-lanes" });
    this.cursor = Evalbus.element("div", { class: "ev-cursor" });
    this.tip = Evalbus.element("div", { class: "ev-tip", hidden: "" });
    this.slider = Evalbus.element("div", { class: "ev-timeline", role: "slider", tabindex: "0", "aria-label": "time",
      "aria-valuemin": "0" }, this.canvas, this.cursor, this.tip);
    place.append(this.slider);
    this.slider.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      this.slider.setPointerCapture(event.pointerId);
      this.isDragged = true;
      this.seekTo(event);
    });
    this.slider.addEventListener("pointermove", (event) => {
      if (this.isDragged) this.seekTo(event);
      this.point(event);
    });
    const release = () => { this.isDragged = false; };
    this.slider.addEventListener("pointerup", release);
    this.slider.addEventListener("pointercancel", release);
    this.slider.addEventListener("pointerleave", () => { this.tip.hidden = true; });
    new ResizeObserver(() => this.redraw()).observe(this.slider);
  }

  // tracks: A and, if compared, B.
  show(tracks, palette) {
    this.tracks = tracks;
    this.palette = palette;
    this.lanes = [];
    tracks.forEach((track, k) => {
      const which = tracks.length > 1 ? (k === 0 ? "A " : "B ") : "";
      if ((track.head.stages || []).length) this.lanes.push({ kind: "stages", track, label: `${which}stages` });
      (track.head.grippers || []).forEach((gripper, index) => {
        const name = track.head.grippers.length > 1 ? Evalbus.spaced(gripper) : "gripper";
        this.lanes.push({ kind: "gripper", track, gripper, index, label: `${which}${name}` });
      });
      this.lanes.push({ kind: "events", track, label: `${which}events` });
    });
    // Width of the longest label; the getter `left` limits it.
    const context = this.canvas.getContext("2d");
    context.font = `11px ${palette.font}`;
    this.labels = Math.ceil(Math.max(...this.lanes.map((lane) => context.measureText(lane.label).width)));
    this.slider.style.height = `${this.lanes.length * Evalbus.Timeline.LANE + Evalbus.Timeline.AXIS + 4}px`;
    this.redraw();
  }

  get left() { return Math.min(this.labels + 15, Math.max(72, 0.12 * this.slider.clientWidth)); }
  get right() { return 14; }

  xOf(time_s) {
    return this.left + (this.slider.clientWidth - this.left - this.right) * time_s / this.end;
  }

  timeAt(event) {
    const box = this.slider.getBoundingClientRect();
    return (event.clientX - box.left - this.left) / (box.width - this.left - this.right) * this.end;
  }

  seekTo(event) {
    if (!this.tracks || !this.tracks.length) return;
    this.onSeek(Math.round(Math.max(0, this.timeAt(event)) / this.tracks[0].tickSeconds));
  }

  // Shows a tooltip for the marks under the pointer.
  point(event) {
    if (!this.tracks) return;
    const box = this.slider.getBoundingClientRect();
    const x = event.clientX - box.left, lane = Math.floor((event.clientY - box.top) / Evalbus.Timeline.LANE);
    const near = (this.marks || []).filter((mark) => mark.lane === lane && x >= mark.from - 6 && x <= mark.to + 6);
    near.sort((a, b) => Math.abs((a.from + a.to) / 2 - x) - Math.abs((b.from + b.to) / 2 - x));
    this.tip.hidden = near.length === 0;
    if (!near.length) return;
    Evalbus.setText(this.tip, near[0].text);
    const width = this.tip.offsetWidth;
    this.tip.style.left = `${Math.max(0, Math.min(box.width - width, x - width / 2))}px`;
    this.tip.style.top = `${lane * Evalbus.Timeline.LANE - 28}px`;
  }

  redraw() {
    if (!this.tracks || !this.tracks.length) return;
    this.end = Math.max(...this.tracks.map(Evalbus.axisEnd));
    this.marks = [];
    Evalbus.drawOn(this.canvas, (context, width, height) => this.draw(context, width, height));
    this.move(this.tick || 0);
  }

  draw(context, width, height) {
    const { LANE, AXIS } = Evalbus.Timeline;
    const palette = this.palette;
    context.font = `11px ${palette.font}`;
    context.textBaseline = "middle";
    const bottom = height - AXIS;
    context.lineWidth = 1;
    for (const time of Evalbus.ticksOf(0, this.end, (width - this.left) / 90)) {
      const x = Math.round(this.xOf(time)) + 0.5;
      context.strokeStyle = palette.rule;
      context.beginPath();
      context.moveTo(x, 0);
      context.lineTo(x, bottom);
      context.stroke();
      context.fillStyle = palette.soft;
      context.textAlign = "center";
      context.fillText(`${Number(time.toPrecision(6))} s`, Math.min(x, width - 12), bottom + AXIS / 2 + 2);
    }
    this.lanes.forEach((lane, k) => {
      const top = k * LANE;
      context.fillStyle = palette.soft;
      context.textAlign = "right";
      context.fillText(Evalbus.shortened(context, lane.label, this.left - 14), this.left - 10, top + LANE / 2);
      context.strokeStyle = palette.rule;
      context.beginPath();
      context.moveTo(this.left, top + LANE + 0.5);
      context.lineTo(width - this.right, top + LANE + 0.5);
      context.stroke();
      context.save();
      context.beginPath();
      context.rect(this.left - 7, top, width - this.left - this.right + 14, LANE);
      context.clip();
      this[lane.kind](context, lane, top, k);
      context.restore();
    });
  }

  mark(lane, from, to, text) {
    this.marks.push({ lane, from, to, text });
  }

  stages(context, { track }, top, lane) {
    const { LANE } = Evalbus.Timeline;
    const reached = track.head.stages.filter((stage) => stage.tick !== null)
      .sort((a, b) => a.tick - b.tick);
    reached.forEach((stage, k) => {
      const from = this.xOf(stage.tick * track.tickSeconds);
      const next = k + 1 < reached.length ? reached[k + 1].tick : track.last;
      const to = this.xOf(next * track.tickSeconds);
      context.globalAlpha = 0.22;
      context.fillStyle = this.palette.c2;
      context.fillRect(from, top + 4, Math.max(2, to - from - 1), LANE - 8);
      context.globalAlpha = 1;
      context.fillRect(from, top + 4, 3, LANE - 8);
      const name = Evalbus.spaced(stage.name);
      if (to - from > 46) {
        context.fillStyle = this.palette.text;
        context.textAlign = "left";
        context.fillText(Evalbus.shortened(context, name, to - from - 14), from + 8, top + LANE / 2 + 0.5);
      }
      this.mark(lane, from, Math.max(from + 3, to), `${name} · ${(stage.tick * track.tickSeconds).toFixed(2)} s`);
    });
  }

  // Draws the gripper opening as an area and the held object as a bar.
  gripper(context, { track, gripper, index }, top, lane) {
    const { LANE } = Evalbus.Timeline;
    const color = this.palette.parts[index % this.palette.parts.length];
    const opening = track.curve("gripper_opening");
    if (opening && track.ticks > 1) {
      const row = track.rows[opening.first_row + index];
      const step = Math.max(1, Math.floor(track.ticks / 1200));
      context.beginPath();
      context.moveTo(this.xOf(0), top + LANE - 3);
      for (let k = 0; row && k < track.ticks; k += step) {
        const value = Math.max(0, Math.min(1, row.data[k] || 0));
        context.lineTo(this.xOf(k * track.tickSeconds), top + LANE - 3 - value * (LANE - 8));
      }
      context.lineTo(this.xOf(track.last * track.tickSeconds), top + LANE - 3);
      context.globalAlpha = 0.2;
      context.fillStyle = color;
      context.fill();
      context.globalAlpha = 1;
    }
    const grasps = track.head.events.filter((event) => event.kind === "grasp" && event.gripper === gripper);
    for (const grasp of grasps) {
      const begin = grasp.tick * track.tickSeconds;
      const end = Math.min(track.last * track.tickSeconds, grasp.duration_s ? begin + grasp.duration_s : Infinity);
      const from = this.xOf(begin), to = this.xOf(end);
      context.fillStyle = color;
      context.fillRect(from, top + LANE / 2 - 4, Math.max(2, to - from), 8);
      const what = Evalbus.spaced(grasp.object) || "an object";
      this.mark(lane, from, to, `${Evalbus.spaced(gripper)} holds ${what} · ${begin.toFixed(2)} to ${end.toFixed(2)} s`);
    }
  }

  events(context, { track }, top, lane) {
    const middle = top + Evalbus.Timeline.LANE / 2;
    for (const event of track.head.events) {
      if (!Evalbus.eventMarks[event.kind]) continue;
      const x = this.xOf(event.tick * track.tickSeconds);
      Evalbus.eventMarks[event.kind](context, x, middle, this.palette, track);
      this.mark(lane, x, x, `${(event.tick * track.tickSeconds).toFixed(2)} s · ${Evalbus.words(event.text)}`);
    }
  }

  move(tick) {
    this.tick = tick;
    if (!this.tracks || !this.tracks.length) return;
    const track = this.tracks[0];
    this.cursor.style.transform = `translateX(${this.xOf(tick * track.tickSeconds).toFixed(2)}px)`;
    const shown = String(Math.floor(tick));
    if (this.slider.getAttribute("aria-valuenow") === shown) return;
    this.slider.setAttribute("aria-valuemax", String(track.last));
    this.slider.setAttribute("aria-valuenow", shown);
    this.slider.setAttribute("aria-valuetext", `${(Math.floor(tick) * track.tickSeconds).toFixed(2)} s`);
  }
};

Evalbus.Timeline.LANE = 24;
Evalbus.Timeline.AXIS = 20;

// Each kind has its own shape, so that marks can be distinguished without color.
Evalbus.eventMarks = {
  grasp(context, x, y, palette) {
    Evalbus.polygon(context, [[x - 5, y - 4], [x + 5, y - 4], [x, y + 5]], palette.c2, true);
  },
  release(context, x, y, palette) {
    Evalbus.polygon(context, [[x - 5, y + 4], [x + 5, y + 4], [x, y - 5]], palette.c2, false);
  },
  slip(context, x, y, palette) {
    Evalbus.polygon(context, [[x, y - 6], [x + 6, y], [x, y + 6], [x - 6, y]], palette.c4, true);
  },
  collision(context, x, y, palette) {
    context.strokeStyle = palette.bad;
    context.lineWidth = 2;
    context.beginPath();
    for (const sign of [-1, 1]) {
      context.moveTo(x - 4, y - 4 * sign);
      context.lineTo(x + 4, y + 4 * sign);
    }
    context.stroke();
    context.lineWidth = 1;
  },
  self_collision(context, x, y, palette) {
    Evalbus.eventMarks.collision(context, x, y, palette);
    context.strokeStyle = palette.bad;
    context.beginPath();
    context.arc(x, y, 7, 0, 2 * Math.PI);
    context.stroke();
  },
  end(context, x, y, palette, track) {
    context.fillStyle = track.outcome() === "failure" ? palette.bad : track.outcome() === "success" ? palette.good
      : palette.soft;
    context.fillRect(x - 2, y - 9, 4, 18);
  },
};

// Returns as much of the text as fits, with an ellipsis.
Evalbus.shortened = (context, text, width) => {
  if (context.measureText(text).width <= width) return text;
  let length = text.length;
  while (length > 0 && context.measureText(`${text.slice(0, length)}…`).width > width) --length;
  return length > 0 ? `${text.slice(0, length).trimEnd()}…` : "";
};

Evalbus.polygon = (context, points, color, isFilled) => {
  context.beginPath();
  points.forEach(([x, y], k) => (k === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
  context.closePath();
  context.fillStyle = context.strokeStyle = color;
  context.lineWidth = 1.5;
  if (isFilled) context.fill();
  else context.stroke();
  context.lineWidth = 1;
};
