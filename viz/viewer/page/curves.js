// One card per metric with its current value and its curve. All cards share the axis of the timeline. When the episode has
// ended, the metrics that change most come first, and constant metrics are folded.
"use strict";

Evalbus.Curves = class extends Evalbus.CurvePlots {
  // timeline: its time axis is shared. onPin(): called when curves are pinned or unpinned.
  constructor(place, timeline, onPin) {
    super();
    const e = Evalbus.element;
    this.timeline = timeline;
    this.onPin = onPin;
    this.filter = e("input", { type: "search", class: "ev-metric-filter", placeholder: "Filter metrics", "aria-label": "filter metrics",
      oninput: () => this.applyFilter() });
    this.grid = e("div", { class: "ev-curves" });
    this.constantTitle = e("summary", {});
    this.constantGrid = e("div", { class: "ev-curves" });
    this.constant = e("details", { class: "ev-fold ev-constant", hidden: "" }, this.constantTitle, this.constantGrid);
    place.append(this.filter, this.grid, this.constant);
    this.tip = e("div", { class: "ev-tip" });
    this.hover = e("div", { class: "ev-cursor ev-thin" });
    this.cards = [];
    // Cards outside the viewport are not drawn.
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

  // Creates the cards of the episodes. redraw() draws them.
  prepare(tracks, palette) {
    this.tracks = tracks;
    this.palette = palette;
    const layout = JSON.stringify(tracks.map((track) => [track.key, track.head.curves, track.head.is_over]));
    if (layout !== this.layout) {
      this.layout = layout;
      this.build();
    }
  }

  build() {
    for (const card of this.cards) this.seen.unobserve(card.node);
    const enlarged = new Set(this.cards.filter((card) => card.isLarge).map((card) => card.name));
    const pinned = new Set(this.pins.map((card) => card.name));
    const [track, other] = this.tracks;
    this.cards = track.head.curves.map((curve) => {
      const parts = curve.parts.map((part, k) => ({
        row: curve.first_row + k, name: Evalbus.spaced(part), value: Evalbus.element("span", { class: "ev-value" }),
        color: Evalbus.roleOf(part, k, track.head),
      }));
      const otherCurve = other && other.curve(curve.name);
      const otherParts = otherCurve ? otherCurve.parts.map((part, k) => ({
        row: otherCurve.first_row + k, name: Evalbus.spaced(part), value: Evalbus.element("span", { class: "ev-value ev-other" }),
        color: parts.length > 1 ? Evalbus.roleOf(part, k, track.head) : "b",
      })) : [];
      const canvas = Evalbus.element("canvas", { "aria-hidden": "true" });
      const cursor = Evalbus.element("div", { class: "ev-cursor ev-thin" });
      const unit = curve.unit && curve.unit !== "1" ? Evalbus.element("span", { class: "ev-unit" }, curve.unit) : null;
      const values = Evalbus.element("span", { class: "ev-values" }, parts.map((part, k) => {
        const swatch = parts.length > 1 ? Evalbus.element("i", { class: "ev-swatch" }) : null;
        if (swatch) swatch.style.background = `var(--${part.color})`;
        return Evalbus.element("span", { class: "ev-part", title: part.name }, swatch,
          parts.length > 1 ? Evalbus.element("span", { class: "ev-part-name" }, part.name) : null, part.value,
          otherParts[k] ? otherParts[k].value : null);
      }), unit);
      const plot = Evalbus.element("span", { class: "ev-plot" }, canvas, cursor);
      const label = Evalbus.element("button", { class: "ev-label", type: "button", title: Evalbus.words(curve.name) },
        Evalbus.words(curve.label));
      // A card is one stop of the Tab key, so the pin has a key instead.
      label.addEventListener("keydown", (event) => {
        if (event.key !== "Enter" || !event.shiftKey) return;
        event.preventDefault();
        pin.click();
      });
      const pin = Evalbus.element("button", { class: "ev-pin", type: "button", tabindex: "-1", title: "pin under the timeline (shift Enter)",
        "aria-label": `pin ${Evalbus.words(curve.label)} under the timeline`, "aria-keyshortcuts": "Shift+Enter", onclick: (event) => {
          event.stopPropagation();
          this.setPinned(card, !card.isPinned);
          this.onPin();
        } }, Evalbus.icon("M6 2h4v5l2 2.5H4L6 7zM8 9.5V14"));
      const node = Evalbus.element("div", { class: "ev-card", onclick: () => this.enlarge(card) },
        Evalbus.element("span", { class: "ev-card-head" }, label, pin), values, plot);
      plot.addEventListener("pointermove", (event) => this.point(card, event));
      plot.addEventListener("pointerleave", () => { this.tip.remove(); this.hover.remove(); });
      const card = { name: curve.name, curve, node, label, pin, canvas, cursor, parts, otherParts, plot, isSeen: false,
        isLarge: enlarged.has(curve.name) };
      this.setPinned(card, pinned.has(curve.name));
      label.setAttribute("aria-expanded", String(card.isLarge));
      node.classList.toggle("ev-large", card.isLarge);
      // Three or more names need a wide card.
      node.classList.toggle("ev-wide", parts.length > 2);
      this.seen.observe(node);
      return card;
    });
    this.arrange();
  }

  // Places each card in the grid or, if its metric is constant, in the fold.
  arrange() {
    const [track, other] = this.tracks;
    const rowsOf = (one, card, parts) => parts.map(({ row }) => {
      const values = one.rows[row].data.subarray(0, one.ticks);
      return card.curve.sparse ? Evalbus.held(values) : values;
    });
    const ratio = other ? track.tickSeconds / other.tickSeconds : 1;
    const change = new Map(this.cards.map((card) => [card, !track.head.is_over ? 1 : Evalbus.changeOf(rowsOf(track, card, card.parts),
      card.otherParts.length ? rowsOf(other, card, card.otherParts) : null, ratio)]));
    const constant = this.cards.filter((card) => change.get(card) === 0);
    const changing = this.cards.filter((card) => change.get(card) > 0).sort((a, b) => change.get(b) - change.get(a));
    this.grid.replaceChildren(...changing.map((card) => card.node));
    this.constantGrid.replaceChildren(...constant.map((card) => card.node));
    this.numConstant = constant.length;
    this.applyFilter();
  }

  applyFilter() {
    const words = this.filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const card of this.cards) {
      const text = `${card.curve.label} ${card.name} ${card.parts.map((part) => part.name).join(" ")}`.toLowerCase();
      card.node.hidden = !words.every((word) => text.includes(word));
    }
    this.constant.hidden = ![...this.constantGrid.children].some((node) => !node.hidden);
    const what = this.tracks && this.tracks[1] ? "equal in A and B" : "constant";
    Evalbus.setText(this.constantTitle, `${Evalbus.plural(this.numConstant, "metric")} ${this.numConstant === 1 ? "is" : "are"} ${what}`);
    if (words.length) this.constant.open = true;
  }

  // Cards whose curves are pinned, so that they are shown under the timeline.
  get pins() { return this.cards.filter((card) => card.isPinned); }

  setPinned(card, isPinned) {
    card.isPinned = isPinned;
    card.pin.setAttribute("aria-pressed", String(isPinned));
  }

  enlarge(card) {
    card.isLarge = !card.isLarge;
    card.node.classList.toggle("ev-large", card.isLarge);
    card.label.setAttribute("aria-expanded", String(card.isLarge));
    this.drawCard(card);
    this.move(this.ticks || [0]);
  }

  // Shows the values at the time under the pointer.
  point(card, event) {
    if (!this.tracks || !(card.right > card.left)) return;
    const box = card.plot.getBoundingClientRect();
    const x = Math.max(card.left, Math.min(card.right, event.clientX - box.left));
    const time = card.from + (x - card.left) / (card.right - card.left) * (card.to - card.from);
    if (this.tip.parentNode !== card.node) card.node.append(this.tip);
    if (this.hover.parentNode !== card.plot) card.plot.append(this.hover);
    this.hover.style.transform = `translateX(${x.toFixed(1)}px)`;
    Evalbus.setText(this.tip, `${time.toFixed(2)} s · ${this.textAt(card, time)}`);
    this.tip.style.left = `${Math.max(0, Math.min(card.node.clientWidth - this.tip.offsetWidth, x))}px`;
  }

  // Returns the named values of a card at a time, such as "left 0.120, right 0.300 m; B: left 0.200, right 0.300 m".
  textAt(card, time_s) {
    const [track, other] = this.tracks;
    const unit = card.curve.unit && card.curve.unit !== "1" ? ` ${card.curve.unit}` : "";
    const text = (one, parts) => {
      const tick = Math.round(time_s / one.tickSeconds);
      if (tick > one.last) return "–";
      return parts.map((part) => `${part.name ? `${part.name} ` : ""}${this.format(card, this.valueOf(one, card, part, tick))}`).join(", ") + unit;
    };
    return `${text(track, card.parts)}${card.otherParts.length ? `; B: ${text(other, card.otherParts)}` : ""}`;
  }

  redraw() {
    for (const card of this.cards) this.drawCard(card);
    if (this.ticks) this.move(this.ticks);
  }

  // ticks: current ticks of A and of B.
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
    const time = this.ticks[0] * track.tickSeconds;
    const x = card.left + (time - card.from) / (card.to - card.from) * (card.right - card.left);
    card.cursor.hidden = time < card.from - 1e-9 || time > card.to + 1e-9;
    card.cursor.style.transform = `translateX(${Number.isFinite(x) ? x.toFixed(1) : 0}px)`;
  }

  write(card, part, value) {
    Evalbus.setText(part.value, this.format(card, value));
  }

  format(card, value) {
    return card.isWhole ? Evalbus.number(value) : Evalbus.numberAmong(value, card.most);
  }

  // Returns {name: [values]} at the current ticks, for tests.
  values() {
    const tick = Math.floor(this.ticks[0] + 1e-6);
    return Object.fromEntries(this.cards.map((card) =>
      [card.name, card.parts.map((part) => this.valueOf(this.tracks[0], card, part, tick))]));
  }
};
