// Page of `evalbus judge`. It plays the episodes one after the other and sends the operator's verdicts.
"use strict";

Evalbus.Judge = class {
  constructor(viewer) {
    const e = Evalbus.element;
    this.viewer = viewer;
    this.head = null;  // the latest "judge" block
    this.item = null;  // number of the episode that is shown
    this.outcome = null;
    this.stages = null;
    this.saved = null;  // number of the shown episode if its verdict was sent, otherwise null
    this.isStale = false;  // whether the connection was opened after the latest "judge" block
    const button = (text, key, action) => this.button(key, action, text, " ", e("kbd", {}, key));
    this.outcomes = new Map([["success", "Success", "s"], ["failure", "Failure", "f"], ["abstain", "Abstain", "a"]].map(
      ([name, text, key]) => [name, button(text, key, () => this.choose(name))]));
    this.progress = e("p", { class: "ev-note", role: "status" });
    this.stageList = e("div", { class: "ev-judge-stages" });
    this.rubric = e("input", { type: "number", min: "0", max: "10", step: "0.5", "aria-label": "rubric, 0 to 10" });
    this.rubric.addEventListener("keydown", (event) => {
      if (event.key === "Enter") this.save();
    });
    this.saveButton = button("Save, next", "Enter", () => this.save());
    this.backButton = button("Back", "Backspace", () => this.back());
    this.problem = e("p", { class: "ev-problem", role: "alert" });
    this.form = e("div", {}, e("h2", {}, "Your verdict"), e("div", { class: "ev-judge-row" }, ...this.outcomes.values()),
      e("h2", {}, "Stages reached (optional)"), this.stageList, e("h2", {}, "Rubric, 0 to 10 (optional)"), this.rubric,
      e("div", { class: "ev-judge-row" }, this.saveButton, this.backButton));
    this.title = e("h2", {});
    this.results = e("div", { hidden: "" });
    this.place = e("section", { class: "ev-judge", "aria-label": "verdict" }, this.title, this.progress, this.form, this.problem, this.results);
  }

  // Creates a button. After a click with the pointer, it does not keep the focus: Enter then saves and does not press it again.
  button(key, action, ...children) {
    return Evalbus.element("button", { type: "button", title: `key ${key}`, onclick: (event) => {
      if (event.detail > 0) event.currentTarget.blur();
      action();
    } }, ...children);
  }

  // Must be called when the connection opens. The server may be a different one, with different numbers for the episodes.
  reconnect() {
    this.isStale = true;
  }

  hear(head) {
    if (!this.head) {
      this.viewer.place.classList.add("ev-judging");
      this.viewer.parts.app.append(this.place);
    }
    this.head = head;
    const count = head.verdicts.length, judged = head.verdicts.filter(Boolean).length;
    Evalbus.setText(this.progress, `${judged} of ${count} judged by ${Evalbus.words(head.operator)}`);
    Evalbus.setText(this.problem, Evalbus.words(head.error));
    this.form.hidden = Boolean(head.results);
    this.results.hidden = !head.results;
    this.results.replaceChildren(...(head.results || []).map((line) =>
      Evalbus.element(line.startsWith(" ") ? "p" : "h2", {}, Evalbus.words(line))));
    const isKept = this.saved !== null && this.saved === this.item && head.verdicts[this.item] && !head.error;
    const isStale = this.isStale;
    this.isStale = false;
    if (head.results) Evalbus.setText(this.title, "Results");
    else if (this.item === null || isKept || this.item >= count) this.show(head.verdicts.indexOf(null));
    else if (isStale) this.showAgain();
  }

  // Loads the shown episode again. If the server has a different episode with this number, the choices are reset.
  async showAgain() {
    const { item, outcome, stages } = this, rubric = this.rubric.value, before = this.viewer.tracks[0];
    // Until the episode is loaded, no verdict can be saved.
    this.viewer.forget(0);
    await this.show(item);
    const now = this.viewer.tracks[0];
    if (this.item !== item || !before || !now || !Evalbus.Judge.areEqual(before, now)) return;
    Object.assign(this, { outcome, stages });
    this.rubric.value = rubric;
    this.showChoices();
  }

  // Returns whether two tracks have the same motion.
  static areEqual(a, b) {
    const count = 3 * a.ticks * a.head.bodies.length;
    return a.episode === b.episode && a.ticks === b.ticks && a.head.scene === b.head.scene && a.head.bodies.length === b.head.bodies.length
      && a.position.data.subarray(0, count).every((value, k) => Object.is(value, b.position.data[k]));
  }

  // item: number of the episode to judge; negative if there is none. Resolves when the episode is shown.
  async show(item) {
    this.item = item < 0 ? null : item;
    this.saved = null;
    this.form.hidden = item < 0;
    if (item < 0) {
      Evalbus.setText(this.title, "Waiting for the end of the next episode");
      return;
    }
    const given = this.head.verdicts[item];
    this.outcome = given && given.outcome;
    this.stages = given && given.stages;
    this.rubric.value = given && given.rubric !== null ? String(given.rubric) : "";
    Evalbus.setText(this.title, `Episode ${item + 1} of ${this.head.verdicts.length}`);
    this.showChoices();
    await this.viewer.open(0, item, 0);
    Evalbus.setText(this.problem, this.viewer.problem);
    this.showChoices();
  }

  // Returns whether the episode to judge is shown. False while it is being loaded, or if loading it has failed.
  get isShown() {
    const track = this.viewer.tracks[0];
    return Boolean(track) && track.episode === this.item;
  }

  stageNames() {
    return this.isShown ? (this.viewer.tracks[0].head.stages || []).map((stage) => Evalbus.spaced(stage.name)) : [];
  }

  showChoices() {
    for (const [name, button] of this.outcomes) button.setAttribute("aria-pressed", String(name === this.outcome));
    const names = ["none", ...this.stageNames()];
    // The buttons are replaced only if their names change, because a replaced button loses the focus.
    if (names.join("\n") !== this.listedStages) {
      this.listedStages = names.join("\n");
      this.stageList.replaceChildren(...names.map((name, k) => this.button(k, () => this.chooseStages(k), Evalbus.element("kbd", {}, String(k)), ` ${name}`)));
    }
    [...this.stageList.children].forEach((one, k) => one.setAttribute("aria-pressed", String(this.stages === k)));
    this.saveButton.disabled = !this.outcome || !this.isShown;
    this.backButton.disabled = !this.item;
  }

  choose(outcome) {
    this.outcome = outcome;
    this.showChoices();
  }

  chooseStages(count) {
    this.stages = this.stages === count ? null : count;
    this.showChoices();
  }

  save() {
    if (!this.outcome || !this.isShown || !this.rubric.reportValidity()) return;
    const rubric = this.rubric.value === "" ? null : Number(this.rubric.value);
    this.rubric.blur();
    this.saved = this.item;
    const isSent = this.viewer.source.send({ verdict: { episode: this.item, outcome: this.outcome, stages: this.stages, rubric } });
    Evalbus.setText(this.problem, isSent ? "" : Evalbus.NOT_SENT);
  }

  back() {
    if (this.item) this.show(this.item - 1);
  }

  // Handles a key. Returns whether it is a key of this page.
  key(event) {
    if (!this.head || this.head.results || this.item === null) return false;
    const actions = { s: () => this.choose("success"), f: () => this.choose("failure"), a: () => this.choose("abstain"),
      Enter: () => this.save(), Backspace: () => this.back() };
    // These keys of the player have no effect on this page.
    if (["l", "?"].includes(event.key)) return true;
    // Enter activates the focused control.
    if (event.key === "Enter" && event.target instanceof Element && event.target.closest("button, summary, input, a")) return false;
    const stages = /^[0-9]$/.test(event.key) && Number(event.key) <= this.stageNames().length ? Number(event.key) : null;
    if (stages !== null) this.chooseStages(stages);
    else if (Object.hasOwn(actions, event.key)) actions[event.key]();
    else return false;
    event.preventDefault();
    return true;
  }
};
