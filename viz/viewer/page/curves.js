// One card per metric with its current value and its curve; all share the axis of the timeline.
"use strict";

Evalbus.Curves = class {
  constructor(place, onSeek) {
    this.onSeek = onSeek;
    this.grid = Evalbus.element("div", { class: "ev-curves" });
    place.append(this.grid);
    this.cards = [];
    // Cards outside of the viewport are not drawn.
    this.seen = new IntersectionObserver((entries) => {
      for (const entry of entries) {
        const card = this.cards.find((one) => one.node === entry.target);
        if (!card) continue;
        card.isSeen = entry.isIntersecting;
        this.drawCard(card);
      }
    }, { rootMargin: "200px" });
    new ResizeObserver(() => this.redraw()).observe(this.grid);
  }

  show(tracks, palette) {
    this.tracks = tracks;
    this.palette = palette;
    const layout = JSON.stringify(tracks.map((track) => [track.key, track.head.curves]));
    if (layout !== this.layout) {
      this.layout = layout;
      this.build();
    }
    this.redraw();
  }

  build() {
    for (const card of this.cards) this.seen.unobserve(card.node);
    const enlarged = new Set(this.cards.filter((card) => card.isLarge).map((card) => card.name));
    const [track, other] = this.tracks;
    this.cards = track.head.curves.map((curve) => {
      const parts = curve.parts.map((part, k) => ({
        row: curve.first_row + k, name: Evalbus.spaced(part), value: Evalbus.element("span", { class: "ev-value" }),
        color: k,
      }));
      const otherCurve = other && other.curve(curve.name);
      const otherParts = otherCurve ? otherCurve.parts.map((part, k) => ({
        row: otherCurve.first_row + k, value: Evalbus.element("span", { class: "ev-value ev-other" }), color: k,
      })) : [];
      const canvas = Evalbus.element("canvas", { "aria-hidden": "true" });
      const cursor = Evalbus.element("div", { class: "ev-cursor ev-thin" });
      const unit = curve.unit && curve.unit !== "1" ? Evalbus.element("span", { class: "ev-unit" }, curve.unit) : null;
      const values = Evalbus.element("span", { class: "ev-values" }, parts.map((part, k) => {
        const swatch = parts.length > 1 ? Evalbus.element("i", { class: `ev-swatch ev-c${k % 6}` }) : null;
        return Evalbus.element("span", { class: "ev-part", title: part.name }, swatch,
          parts.length > 1 ? Evalbus.element("span", { class: "ev-part-name" }, part.name) : null, part.value,
          otherParts[k] ? otherParts[k].value : null, k + 1 === parts.length ? unit : null);
      }));
      const plot = Evalbus.element("span", { class: "ev-plot" }, canvas, cursor);
      const node = Evalbus.element("button", { class: "ev-card", type: "button", "aria-expanded": "false",
        onclick: () => this.enlarge(card) },
      Evalbus.element("span", { class: "ev-label", title: Evalbus.words(curve.name) }, Evalbus.words(curve.label)), values,
      plot);
      const card = { name: curve.name, curve, node, canvas, cursor, parts, otherParts, plot, isSeen: false,
        isLarge: enlarged.has(curve.name) };
      node.classList.toggle("ev-large", card.isLarge);
      // Three or more names need a wide card.
      node.classList.toggle("ev-wide", parts.length > 2);
      this.seen.observe(node);
      return card;
    });
    this.grid.replaceChildren(...this.cards.map((card) => card.node));
  }

  enlarge(card) {
    card.isLarge = !card.isLarge;
    card.node.classList.toggle("ev-large", card.isLarge);
    card.node.setAttribute("aria-expanded", String(card.isLarge));
    this.drawCard(card);
    this.move(this.ticks || [0]);
  }

  redraw() {
    for (const card of this.cards) this.drawCard(card);
    if (this.ticks) this.move(this.ticks);
  }

  rangeOf(card) {
    let low = Infinity, high = -Infinity;
    const look = (track, parts) => {
      for (const { row } of parts) {
        const values = track.rows[row].data;
        for (let k = 0; k < track.ticks; ++k) {
          if (values[k] < low) low = values[k];
          if (values[k] > high) high = values[k];
        }
      }
    };
    look(this.tracks[0], card.parts);
    if (this.tracks[1]) look(this.tracks[1], card.otherParts);
    if (low > high) return null;
    // Starts the axis at zero if no value is negative.
    if (low >= 0 && low < 0.6 * high) low = 0;
    // An almost constant curve is drawn as a straight line instead of enlarging rounding errors.
    const size = Math.max(Math.abs(low), Math.abs(high));
    if (size < Evalbus.Curves.NOTHING) return { low: 0, high: this.isWhole(card) ? 1 : Evalbus.Curves.NOTHING };
    if (high - low < 1e-3 * size) {
      high += 0.5 * size;
      low = low > 0 ? 0 : low - 0.5 * size;
    }
    return { low, high };
  }

  drawCard(card) {
    if (!card.isSeen || !this.tracks) return;
    const end = Math.max(...this.tracks.map(Evalbus.axisEnd));
    card.end = end;
    const range = this.rangeOf(card);
    Evalbus.drawOn(card.canvas, (context, width, height) => {
      const bottom = card.isLarge ? height - 16 : height - 3, top = 6;
      context.font = `10.5px ${this.palette.font}`;
      card.left = 0;
      context.textBaseline = "middle";
      card.most = range ? Math.max(Math.abs(range.low), Math.abs(range.high)) : 0;
      card.isWhole = range && this.isWhole(card);
      if (!range) {
        context.fillStyle = this.palette.soft;
        context.textAlign = "left";
        context.fillText(this.tracks[0].head.is_over ? "no value" : "no value yet", 0, height / 2);
        card.right = width;
        return;
      }
      // If the only tick would be zero, uses closer ticks.
      const few = Evalbus.ticksOf(range.low, range.high, card.isLarge ? 4 : 1.6);
      const marks = few.length > 1 ? few : Evalbus.ticksOf(range.low, range.high, 2.5);
      const texts = marks.map((mark) => Evalbus.number(Number(mark.toPrecision(6))));
      card.left = Math.ceil(Math.max(...texts.map((text) => context.measureText(text).width))) + 8;
      card.right = width - 6;
      const y = (value) => bottom - (value - range.low) / (range.high - range.low) * (bottom - top);
      const x = (time) => card.left + time / end * (card.right - card.left);
      context.textAlign = "right";
      marks.forEach((mark, k) => {
        context.strokeStyle = this.palette.rule;
        context.beginPath();
        context.moveTo(card.left, Math.round(y(mark)) + 0.5);
        context.lineTo(card.right, Math.round(y(mark)) + 0.5);
        context.stroke();
        context.fillStyle = this.palette.soft;
        context.fillText(texts[k], card.left - 5, Math.max(6, Math.min(y(mark), bottom - 4)));
      });
      if (card.isLarge) {
        context.textAlign = "center";
        for (const time of Evalbus.ticksOf(0, end, (card.right - card.left) / 70)) {
          context.fillText(`${Number(time.toPrecision(6))} s`, Math.min(x(time), card.right - 8), height - 6);
        }
      }
      if (this.tracks[1]) {
        context.globalAlpha = 0.75;
        context.setLineDash([3, 3]);
        card.otherParts.forEach((part) => this.line(context, this.tracks[1], part, x, y, card));
        context.setLineDash([]);
        context.globalAlpha = 1;
      }
      card.parts.forEach((part) => this.line(context, this.tracks[0], part, x, y, card));
    });
    this.moveCard(card);
  }

  // Draws at most two points per pixel, the minimum and the maximum, so that peaks remain visible.
  line(context, track, part, x, y, card) {
    const values = track.rows[part.row].data;
    const pixels = Math.max(50, card.right - card.left);
    const step = Math.max(1, Math.floor(track.ticks / pixels));
    context.strokeStyle = this.palette.parts[part.color % this.palette.parts.length];
    context.lineWidth = 1.6;
    context.lineJoin = "round";
    context.beginPath();
    let isDown = false;
    const to = (tick) => {
      const place = [x(tick * track.tickSeconds), y(values[tick])];
      if (isDown) context.lineTo(...place);
      else context.moveTo(...place);
      isDown = true;
    };
    for (let k = 0; k < track.ticks; k += step) {
      let low = -1, high = -1;
      for (let i = k; i < Math.min(k + step, track.ticks); ++i) {
        if (Number.isNaN(values[i])) continue;
        if (low < 0 || values[i] < values[low]) low = i;
        if (high < 0 || values[i] > values[high]) high = i;
      }
      if (low < 0) {
        if (!card.curve.sparse) isDown = false;
        continue;
      }
      to(Math.min(low, high));
      if (low !== high) to(Math.max(low, high));
    }
    context.stroke();
    context.lineWidth = 1;
  }

  // ticks: of A and of B.
  move(ticks) {
    this.ticks = ticks;
    if (!this.tracks) return;
    for (const card of this.cards) this.moveCard(card);
  }

  moveCard(card) {
    if (!card.isSeen || !this.ticks) return;
    const [track, other] = this.tracks;
    for (const part of card.parts) {
      this.write(card, part, this.valueOf(track, card, part, Math.floor(this.ticks[0] + 1e-6)));
    }
    for (const part of card.otherParts) {
      this.write(card, part, this.valueOf(other, card, part, Math.floor(this.ticks[1] + 1e-6)));
    }
    const x = card.left + this.ticks[0] * track.tickSeconds / card.end * (card.right - card.left);
    card.cursor.style.transform = `translateX(${Number.isFinite(x) ? x.toFixed(1) : 0}px)`;
  }

  write(card, part, value) {
    Evalbus.setText(part.value, card.isWhole ? Evalbus.number(value) : Evalbus.numberAmong(value, card.most));
  }

  // Whether all values are integers, which are shown without decimals.
  isWhole(card) {
    return card.parts.every(({ row }) => {
      const { data } = this.tracks[0].rows[row];
      for (let k = 0; k < this.tracks[0].ticks; ++k) {
        if (!Number.isNaN(data[k]) && !Number.isInteger(data[k])) return false;
      }
      return true;
    });
  }

  valueOf(track, card, part, tick) {
    return card.curve.sparse ? track.lastValueAt(part.row, tick) : track.valueAt(part.row, tick);
  }

  // Returns {name: [values]} at the current ticks, for tests.
  values() {
    const tick = Math.floor(this.ticks[0] + 1e-6);
    return Object.fromEntries(this.cards.map((card) =>
      [card.name, card.parts.map((part) => this.valueOf(this.tracks[0], card, part, tick))]));
  }
};

// Values below this count as zero, in any of the units used (m, rad, s, mm).
Evalbus.Curves.NOTHING = 1e-3;
