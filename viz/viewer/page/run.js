// Panel with a run and its episodes: success rate, failure reasons, health of the components, log.
"use strict";

Evalbus.EpisodeList = class extends Evalbus.RowList {
  constructor(place, actions) {
    super({ class: "ev-list", role: "grid" }, { role: "rowgroup" });
    const e = Evalbus.element;
    this.actions = actions;
    this.filter = "all";
    this.all = e("button", { type: "button", onclick: () => this.setFilter("all") }, "All");
    this.failed = e("button", { type: "button", onclick: () => this.setFilter("failed") }, "Failures");
    this.reasonOnly = e("button", { type: "button", class: "ev-reason-only", hidden: "", title: "show all again",
      onclick: () => this.setFilter("all") });
    this.count = e("span", { class: "ev-note" });
    place.append(e("div", { class: "ev-filter" }, e("span", { class: "ev-segments" }, this.all, this.failed),
      this.reasonOnly, this.count), this.box);
    this.box.addEventListener("keydown", (event) => this.key(event));
    this.setFilter("all");
  }

  setFilter(filter) {
    this.filter = filter;
    this.all.setAttribute("aria-pressed", String(filter === "all"));
    this.failed.setAttribute("aria-pressed", String(filter === "failed"));
    this.reasonOnly.hidden = filter === "all" || filter === "failed";
    Evalbus.setText(this.reasonOnly, `${Evalbus.reasonText(filter)} ×`);
    this.box.scrollTop = 0;
    this.apply();
  }

  // current, other: keys of the episodes that are shown.
  show(rows, current, other) {
    this.current = current;
    this.other = other;
    this.all_rows = rows;
    this.apply();
    const row = current !== this.revealed && this.rows.find((one) => `${one.run}/${one.episode}` === current);
    if (row) this.reveal(row);
    if (row || current === undefined) this.revealed = current;
  }

  static isFailure(row) {
    return ["failure", "incomplete"].includes(Evalbus.resultOf(row));
  }

  apply() {
    const rows = this.all_rows || [];
    this.rows = this.filter === "all" ? rows : this.filter === "failed" ? rows.filter(Evalbus.EpisodeList.isFailure)
      : rows.filter((row) => row.failure_reason === this.filter || row.end_reason === this.filter);
    const whole = rows.length.toLocaleString("en");
    Evalbus.setText(this.count, this.rows.length === rows.length ? `${whole} finished`
      : `${this.rows.length.toLocaleString("en")} of ${whole}`);
    this.redraw();
  }

  makeRow() {
    const e = Evalbus.element;
    const slot = { sign: e("i", { class: "ev-sign", "aria-hidden": "true" }), number: e("span", { class: "ev-number", role: "gridcell" }),
      text: e("span", { class: "ev-name", role: "gridcell" }), time: e("span", { class: "ev-time-of", role: "gridcell" }) };
    slot.versus = e("button", { type: "button", class: "ev-versus", title: "compare with the displayed episode",
      onclick: (event) => {
        event.stopPropagation();
        this.actions.compare(slot.row);
      } }, "vs");
    slot.node = e("div", { class: "ev-row", role: "row", onclick: () => this.actions.open(slot.row) }, slot.sign,
      slot.number, slot.text, slot.time, e("span", { role: "gridcell" }, slot.versus));
    return slot;
  }

  fill(slot, row) {
    slot.row = row;
    const outcome = Evalbus.resultOf(row);
    slot.sign.dataset.outcome = outcome;
    Evalbus.setText(slot.number, String(row.episode));
    const why = outcome === "success" ? "success" : Evalbus.reasonText(row.failure_reason || row.end_reason);
    const text = outcome === "incomplete" ? `not scored: ${why}` : why;
    Evalbus.setText(slot.text, text);
    const sentence = Evalbus.words(row.cause_text || row.text);
    slot.node.title = `seed ${row.seed}${sentence ? `: ${sentence}` : ""}`;
    Evalbus.setText(slot.time, row.time_s === null ? "" : `${row.time_s.toFixed(2)} s`);
    const key = `${row.run}/${row.episode}`;
    slot.node.setAttribute("aria-selected", String(key === this.current));
    slot.node.classList.toggle("ev-is-b", key === this.other);
    const canOpen = this.actions.canOpen(row);
    slot.node.classList.toggle("ev-shut", !canOpen);
    slot.versus.toggleAttribute("data-hidden", !canOpen || key === this.current);
  }

  key(event) {
    const way = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10 }[event.key];
    if (!way || !this.rows.length) return;
    event.preventDefault();
    event.stopPropagation();
    const at = this.rows.findIndex((row) => `${row.run}/${row.episode}` === this.current);
    // Episodes that cannot be opened are skipped.
    let to = Math.max(0, Math.min(this.rows.length - 1, at + way));
    while (this.rows[to] && !this.actions.canOpen(this.rows[to])) to += Math.sign(way);
    const row = this.rows[to];
    if (!row) return;
    this.actions.open(row);
    this.reveal(row);
  }
};

Evalbus.RunPanel = class {
  constructor(place, actions) {
    const e = Evalbus.element;
    this.actions = actions;
    this.runs = e("div", { class: "ev-runs ev-segments", hidden: "" });
    this.rate = e("span", { class: "ev-big" });
    this.rateText = e("p", { class: "ev-note" });
    this.interval = e("i", { class: "ev-interval" });
    this.rateMark = e("i", { class: "ev-rate-mark" });
    this.rateBar = e("div", { class: "ev-rate" }, this.interval, this.rateMark);
    this.done = e("i", {});
    this.progress = e("div", { class: "ev-progress", role: "progressbar", "aria-label": "episodes done" }, this.done);
    this.progressText = e("p", { class: "ev-note" });
    this.remarks = e("div");
    this.reasonsTitle = e("h2", {}, "Failure reasons");
    this.reasons = e("div");
    this.health = e("div");
    this.healthTitle = e("h2", {}, "Components");
    this.pacing = e("dl", { class: "ev-pacing" });
    this.pacingTitle = e("h2", {}, "Real time");
    this.log = e("ol", { class: "ev-log", tabindex: "0", "aria-label": "log" });
    this.logTitle = e("h2", {}, "Log");
    const listPlace = e("div", { class: "ev-episodes" }, e("h2", {}, "Episodes"));
    this.list = new Evalbus.EpisodeList(listPlace, actions);
    place.append(this.runs, e("h2", {}, "Success rate"), this.rate, this.rateText, this.rateBar,
      e("div", { class: "ev-scale", "aria-hidden": "true" }, e("span", {}, "0 %"), e("span", {}, "50 %"), e("span", {}, "100 %")),
      this.progress, this.progressText, this.remarks, this.reasonsTitle, this.reasons, listPlace, this.pacingTitle,
      this.pacing, this.healthTitle, this.health, this.logTitle, this.log);
  }

  // runs: runs that can be chosen. run: the run to show, as {info, episodes, lines}. current, other: keys of the episodes that
  // are shown.
  show(runs, run, current, other) {
    const info = run.info;
    this.showRuns(runs, info.run);
    Evalbus.setText(this.rate, Evalbus.percent(info.rate));
    const interval = info.interval;
    const kind = info.interval_kind === "anytime" ? "anytime-valid" : Evalbus.words(info.interval_kind);
    Evalbus.setText(this.rateText, info.judged
      ? `${info.successes} of ${info.judged}${interval ? `; 95 % interval ${Evalbus.percentRange(interval)}`
        + `${kind ? ` (${kind})` : ""}` : ""}` : info.complete ? "no episode has a verdict" : info.is_over ? "no episode is scored" : "no episode is scored yet");
    this.interval.hidden = !interval;
    if (interval) {
      this.interval.style.left = `${100 * interval[0]}%`;
      this.interval.style.width = `${100 * (interval[1] - interval[0])}%`;
    }
    this.rateMark.hidden = info.rate === null;
    this.rateMark.style.left = `${100 * (info.rate || 0)}%`;
    const planned = info.planned || 0;
    this.progress.hidden = !(planned > 0 && (info.is_live || info.is_active) && !info.is_over);
    this.done.style.transform = `scaleX(${planned > 0 ? Math.min(1, info.done / planned) : 0})`;
    this.progress.setAttribute("aria-valuenow", String(info.done));
    const speed = info.speed && !info.is_over && info.is_live ? `, ${Number(info.speed.toPrecision(2))} times real time` : "";
    Evalbus.setText(this.progressText, `${planned > 0 ? `${info.done} of ` : ""}${Evalbus.plural(planned || info.done, "episode")}${speed}`);
    this.remarks.replaceChildren(...(info.remarks || []).map((remark) =>
      Evalbus.element("p", { class: "ev-remark" }, Evalbus.words(remark))));
    if (info.undecodable > 0) {
      this.remarks.append(Evalbus.element("p", { class: "ev-remark" }, `${Evalbus.plural(info.undecodable, "message")} could not be decoded`));
    }
    this.showReasons(info);
    this.showPacing(info);
    this.showHealth(info);
    this.showLog(run.lines);
    this.list.show(run.episodes, current, other);
  }

  showRuns(runs, shown) {
    this.runs.hidden = runs.length < 2;
    const layout = JSON.stringify([runs.map((run) => [run.info.run, Evalbus.runName(run.info)]), shown]);
    if (layout === this.runsLayout) return;
    this.runsLayout = layout;
    this.runs.replaceChildren(...runs.map(({ info }) => Evalbus.element("button", { type: "button",
      "aria-pressed": String(info.run === shown), title: Evalbus.runName(info), onclick: () => this.actions.chooseRun(info.run) },
    Evalbus.runName(info))));
  }

  showReasons(info) {
    const layout = JSON.stringify(info.failure_reasons);
    if (layout === this.reasonsLayout) return;
    this.reasonsLayout = layout;
    const reasons = (info.failure_reasons || []).filter(([reason]) => reason !== "not_judged").sort((a, b) => b[1] - a[1]);
    this.reasonsTitle.hidden = this.reasons.hidden = reasons.length === 0;
    const most = Math.max(1, ...reasons.map(([, count]) => count));
    this.reasons.replaceChildren(...reasons.slice(0, 8).map(([reason, count]) => {
      const fill = Evalbus.element("i", {});
      fill.style.transform = `scaleX(${count / most})`;
      return Evalbus.element("button", { type: "button", class: "ev-reason-row", title: "only these episodes",
        onclick: () => this.list.setFilter(this.list.filter === reason ? "all" : reason) },
      Evalbus.element("span", { class: "ev-name" }, Evalbus.reasonText(reason)),
      Evalbus.element("span", { class: "ev-value" }, String(count)), Evalbus.element("span", { class: "ev-bar" }, fill));
    }));
  }

  showPacing(info) {
    const pacing = info.pacing;
    this.pacingTitle.hidden = this.pacing.hidden = !pacing;
    if (!pacing) return;
    const ms = (seconds) => (seconds === null || seconds === undefined ? "–" : `${(1000 * seconds).toFixed(1)} ms`);
    const rows = [["action latency, median", ms(pacing.action_latency_p50_s)],
      ["action latency, 99th percentile", ms(pacing.action_latency_p99_s)],
      ["pacing error, 99th percentile", ms(pacing.error_p99_s)],
      ["deadlines missed", Evalbus.number(pacing.deadline_misses)], ["late ticks", Evalbus.number(pacing.late_ticks)]];
    this.pacing.replaceChildren(...rows.flatMap(([name, value]) =>
      [Evalbus.element("dt", {}, name), Evalbus.element("dd", {}, value)]));
  }

  showHealth(info) {
    const components = info.components || [];
    this.healthTitle.hidden = this.health.hidden = components.length === 0;
    this.health.replaceChildren(...components.map((component) => {
      const silent = component.silent_s ? `silent for ${component.silent_s.toFixed(0)} s` : "";
      // A lag of one tick is normal.
      const lag = component.lag_ticks > 1 ? `${component.lag_ticks} ticks behind` : "";
      const state = [Evalbus.words(component.state), lag, silent].filter(Boolean).join(", ");
      return Evalbus.element("div", { class: component.is_bad ? "ev-component ev-bad" : "ev-component",
        title: Evalbus.words(component.text) }, Evalbus.element("i", { class: "ev-dot", "aria-hidden": "true" }),
      Evalbus.element("span", { class: "ev-name" }, Evalbus.words(component.name)),
      Evalbus.element("span", { class: "ev-state" }, state),
      component.is_bad && component.text ? Evalbus.element("span", { class: "ev-why" }, Evalbus.words(component.text)) : null);
    }));
  }

  showLog(lines) {
    this.logTitle.hidden = this.log.hidden = lines.length === 0;
    if (this.shownLines === lines && this.shownCount === lines.length) return;
    const isAtEnd = this.log.scrollTop + this.log.clientHeight > this.log.scrollHeight - 20;
    this.shownLines = lines;
    this.shownCount = lines.length;
    this.log.replaceChildren(...lines.slice(-200).map((line) => {
      const where = line.episode === null ? "" : `ep. ${line.episode}`;
      return Evalbus.element("li", { class: `ev-${Evalbus.words(line.level)}` },
        Evalbus.element("span", { class: "ev-from" }, [Evalbus.words(line.component), where].filter(Boolean).join(" · ")),
        ` ${Evalbus.words(line.text)}`);
    }));
    if (isAtEnd) this.log.scrollTop = this.log.scrollHeight;
  }
};
