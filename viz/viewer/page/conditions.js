// Panel with the state of an episode: outcome and reason, stages, conditions with their thresholds, events.
"use strict";

Evalbus.Conditions = class {
  constructor(place, onSeek) {
    this.onSeek = onSeek;
    const e = Evalbus.element;
    this.verdict = e("p", { class: "ev-verdict", "aria-live": "polite" });
    this.reason = e("p", { class: "ev-reason" });
    this.other = e("p", { class: "ev-reason ev-b" });
    this.stages = e("ol", { class: "ev-stages" });
    this.stagesTitle = e("h2", {}, "Stages");
    this.criteria = e("div");
    this.criteriaTitle = e("h2", {}, "Conditions");
    this.events = e("ol", { class: "ev-events" });
    this.eventsTitle = e("summary", {}, "Events");
    this.eventsPlace = e("details", { class: "ev-fold" }, this.eventsTitle, this.events);
    place.append(this.verdict, this.reason, this.other, this.stagesTitle, this.stages, this.criteriaTitle, this.criteria,
      this.eventsPlace);
  }

  // tracks: the episode and, if it is compared, the second episode. isReceived: false if the first episode's run is not on a
  // bus, so that no more messages of this episode arrive.
  show(tracks, isReceived) {
    this.tracks = tracks;
    const [track, other] = tracks;
    const words = { success: "Success", failure: "Failure", incomplete: "Not scored", running: "Running", left: "Unfinished",
      unjudged: "Not judged" };
    const outcome = track.outcome() !== "running" || isReceived ? track.outcome() : track.head.is_over ? "unjudged" : "left";
    const why = outcome === "failure" ? Evalbus.reasonText(track.head.failure_reason || track.head.end_reason) : "";
    Evalbus.setText(this.verdict, why ? `${words[outcome]}: ${why}` : words[outcome]);
    this.verdict.dataset.outcome = outcome;
    let reason = Evalbus.reasonOf(track.head);
    if (!reason && outcome === "running") {
      reason = track.head.time_limit_s ? `time limit ${track.head.time_limit_s} s` : "";
    }
    if (outcome === "left") reason = "no more messages of this episode arrive; --resume runs it again";
    const missing = track.missing.size ? `missing: ${Evalbus.plural(track.missing.size, "tick")}` : "";
    const cut = track.head.is_cut ? "truncated: the episode exceeds the maximum number of ticks" : "";
    Evalbus.setText(this.reason, [reason, missing, cut].filter(Boolean).join("; "));
    if (other) {
      Evalbus.setText(this.other, Evalbus.textOfB(words[other.outcome()].toLowerCase(), Evalbus.reasonOf(other.head)));
    }
    this.other.hidden = !other;

    const layout = JSON.stringify([tracks.map((one) => [one.key, (one.head.stages || []).map((s) => s.name)]),
      track.head.criteria, track.head.criteria_joined]);
    if (layout !== this.layout) {
      this.layout = layout;
      this.buildStages();
      this.buildCriteria();
      this.eventsLayout = null;
    }
    this.showEvents();
  }

  buildStages() {
    const e = Evalbus.element;
    const [track, other] = this.tracks;
    this.stageRows = (track.head.stages || []).map((stage, k) => {
      const time = e("span", { class: "ev-time-of" });
      const otherTime = other ? e("span", { class: "ev-time-of ev-other" }) : null;
      const name = Evalbus.spaced(stage.name);
      const button = e("button", { type: "button", title: name, onclick: () => {
        const now = this.tracks[0].head.stages[k];
        if (now && now.tick !== null) this.onSeek(now.tick);
      } }, e("i", { class: "ev-dot", "aria-hidden": "true" }), e("span", { class: "ev-name" }, name), time, otherTime);
      return { node: e("li", {}, button), button, time, otherTime };
    });
    this.stages.replaceChildren(...this.stageRows.map((row) => row.node));
    this.stagesTitle.hidden = this.stages.hidden = this.stageRows.length === 0;
  }

  buildCriteria() {
    const e = Evalbus.element;
    const criteria = this.tracks[0].head.criteria || [];
    this.criteriaRows = criteria.map((criterion, k) => {
      const hasNumber = criterion.first_row !== undefined && criterion.first_row !== null;
      const value = e("span", { class: "ev-value" });
      const unit = hasNumber && criterion.unit && criterion.unit !== "1"
        ? e("span", { class: "ev-target" }, ` ${criterion.unit === "deg" ? "degrees" : Evalbus.words(criterion.unit)}`) : null;
      const fill = e("i", {}), bar = hasNumber ? e("span", { class: "ev-bar" }, fill) : null;
      const holds = e("span", { class: "ev-holds" });
      // The condition is shown as text, such as "height of pot at least 1.096 m".
      const node = e("div", { class: criterion.failure ? "ev-criterion ev-is-failure" : "ev-criterion" },
        e("i", { class: "ev-dot", "aria-hidden": "true" }),
        e("span", { class: "ev-name" }, Evalbus.spaced(criterion.text_first || criterion.predicate)),
        e("span", { class: "ev-numbers" }, hasNumber ? value : holds, unit), bar);
      return { criterion, node, value, fill, holds, index: k, hasNumber };
    });
    const { success, failure } = this.tracks[0].head.criteria_joined || {};
    const places = (isFailure) => this.criteriaRows.filter((row) => Boolean(row.criterion.failure) === isFailure).map((row) => row.index);
    this.criteria.replaceChildren(...this.group("success", success, places(false)), ...this.group("failure", failure, places(true)));
    this.criteriaTitle.hidden = this.criteria.hidden = criteria.length === 0;
  }

  // Creates the rows of the success or failure conditions, grouped as in the task. A tree is an index into the rows, or
  // {all | any | latched | lasts: [trees]}. places: indices of the rows, for a task whose tree is not known.
  group(outcome, tree, places) {
    if (!places.length) return [];
    const e = Evalbus.element;
    const rows = (one) => {
      if (typeof one === "number") return [this.criteriaRows[one].node];
      const [[joined, trees]] = Object.entries(one);
      // For "latched" and "lasts", the operands come first, then the condition itself.
      if (joined !== "all" && joined !== "any") return [e("div", { class: "ev-joined" }, ...trees.flatMap(rows))];
      return [e("div", { class: "ev-joined" }, e("p", { class: "ev-group" }, joined === "all" ? "all of" : "any of"), ...trees.flatMap(rows))];
    };
    const joined = tree && (tree.all ? "all" : tree.any ? "any" : null);
    const trees = joined ? tree[joined] : tree !== null && tree !== undefined ? [tree] : places;
    const many = joined && places.length > 1;
    const what = outcome === "success" ? (many ? `Success requires ${joined} of` : "Success requires") : many ? `Fails if ${joined} of` : "Fails if";
    return [e("p", { class: "ev-group" }, what), ...trees.flatMap(rows)];
  }

  showEvents() {
    const track = this.tracks[0];
    const events = track.head.events || [];
    const layout = JSON.stringify(events);
    if (layout === this.eventsLayout) return;
    this.eventsLayout = layout;
    Evalbus.setText(this.eventsTitle, `Events (${events.length})`);
    this.eventsPlace.hidden = events.length === 0;
    // Only the first 400 events are shown, because a list of thousands of collisions would not be readable.
    const shown = events.slice(0, 400);
    this.events.replaceChildren(...shown.map((event) => Evalbus.element("li", {},
      Evalbus.element("button", { type: "button", onclick: () => this.onSeek(event.tick) },
        Evalbus.element("span", { class: "ev-time-of" }, Evalbus.seconds(event.tick * track.tickSeconds)),
        Evalbus.element("span", { class: "ev-name" }, Evalbus.eventText(event))))));
    if (events.length > shown.length) {
      this.events.append(Evalbus.element("li", { class: "ev-note" }, `and ${events.length - shown.length} more`));
    }
  }

  move(ticks) {
    if (!this.tracks) return;
    const [track, other] = this.tracks;
    const tick = Math.floor(ticks[0] + 1e-6);
    const isOver = tick >= track.last && track.head.is_over;
    let isCurrent = true;
    (this.stageRows || []).forEach((row, k) => {
      const stage = track.head.stages[k];
      const isReached = stage && stage.tick !== null && stage.tick <= tick;
      const state = isReached ? "reached" : isCurrent && !isOver ? "current" : "open";
      if (!isReached) isCurrent = false;
      if (row.button.dataset.state !== state) row.button.dataset.state = state;
      const time = (one, at) => (at && at.tick !== null ? Evalbus.seconds(at.tick * one.tickSeconds) : "–");
      Evalbus.setText(row.time, isReached ? time(track, stage) : state === "current" ? "now" : "");
      if (row.otherTime) Evalbus.setText(row.otherTime, other ? time(other, (other.head.stages || [])[k]) : "");
    });
    for (const row of this.criteriaRows || []) {
      // 0: false, 1: true, 2: not known, as at tick 0
      const known = track.holds[row.index] && tick < track.ticks ? track.holds[row.index].data[tick] : 2;
      const holds = known === 1;
      const state = row.criterion.failure ? (holds ? "failed" : "open") : holds ? "holds" : "open";
      if (row.node.dataset.state !== state) row.node.dataset.state = state;
      Evalbus.setText(row.holds, ["not met", "met", "–"][known]);
      if (!row.hasNumber) continue;
      const values = track.criteria[row.criterion.first_row];
      const value = values && tick < track.ticks ? values.data[tick] : NaN;
      Evalbus.setText(row.value, Evalbus.measured(value, row.criterion.unit, row.criterion.threshold, known === 0));
      row.fill.style.transform = `scaleX(${this.partOf(values, value, row.criterion.threshold, holds).toFixed(4)})`;
    }
  }

  // Returns the share of the distance from the first value to the threshold that has been covered, from 0 to 1.
  partOf(values, value, threshold, holds) {
    if (holds) return 1;
    if (!values || Number.isNaN(value) || threshold === null || threshold === undefined) return 0;
    const first = values.data.find((one, k) => k < this.tracks[0].ticks && !Number.isNaN(one));
    const whole = Math.abs(threshold - first), rest = Math.abs(threshold - value);
    return whole > 0 ? Math.max(0, Math.min(1, 1 - rest / whole)) : 0;
  }
};
