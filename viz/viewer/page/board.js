// The overview: a table of policies and tasks with success rates and differences from the baseline, the matrix of seeds, and
// the share of episodes that reach each stage. Numbers are from the block "board"; the matrix is filled from the lists of
// episodes.
"use strict";

Evalbus.Board = class {
  // viewer: provides `runs` and `notes`. hover(row, node) shows a tooltip, hover(null) hides it.
  constructor(place, viewer, hover) {
    const e = Evalbus.element;
    this.viewer = viewer;
    this.title = e("h1", { class: "ev-board-title" }, "Overview");
    this.progress = e("p", { class: "ev-note" });
    this.table = e("table", { class: "ev-board-table" });
    this.remarks = e("div");
    this.seeds = new Evalbus.Seeds(viewer, hover);
    this.funnel = e("div", { class: "ev-funnels" });
    this.funnelTitle = e("h2", {}, "How far the episodes get");
    place.append(this.title, this.progress,
      e("div", { class: "ev-scroll", tabindex: "0", role: "region", "aria-label": "success of the policies" }, this.table), this.remarks,
      e("h2", {}, "Seeds"), this.seeds.place, this.funnelTitle, this.funnel);
  }

  hear(head) {
    this.next = head;
  }

  // Replaces the shown block by the newest one as soon as the episodes that it counts have arrived, so that table and matrix
  // show the same episodes. The first block is shown at once. Returns whether the shown block has changed.
  adopt() {
    const { next } = this;
    if (!next || (this.head && !this.hasEpisodesOf(next))) return false;
    this.head = next;
    this.next = null;
    return true;
  }

  // Returns whether the episodes have arrived for which the matrix of the first block waits.
  get isLoaded() {
    return Boolean(this.seeds.isLoading) && this.hasEpisodesOf(this.head);
  }

  // Returns whether all episodes that a block counts have arrived.
  hasEpisodesOf(head) {
    const { runs } = this.viewer;
    return head.policies.every((policy) => policy.runs.every((run, i) => policy.runs_done[i] <= (runs.has(run) ? runs.get(run).episodes.length : 0)));
  }

  // Returns the number of combinations of policy and task, including those of a plan whose runs have not begun.
  get cells() {
    return this.head ? this.head.policies.reduce((sum, policy) => sum + policy.cells.filter(Boolean).length, this.head.waiting_runs) : 0;
  }

  // Returns the rows of a policy's episodes that the table counts, extended by the policy's name and the note on the episode.
  rowsOf(k) {
    const policy = this.head.policies[k];
    return policy.runs.flatMap((run, i) => (this.viewer.runs.has(run) ? this.viewer.runs.get(run).episodes.slice(0, policy.runs_done[i]) : []))
      .map((row) => ({ ...row, policy: policy.name, note: this.viewer.notes.of(row.run, row.episode) }));
  }

  rows() {
    return this.head ? this.head.policies.flatMap((_, k) => this.rowsOf(k)) : [];
  }

  show() {
    if (!this.head) return;
    const { policies } = this.head;
    const done = policies.reduce((sum, policy) => sum + policy.all.done, 0);
    const { planned, is_over, waiting_runs } = this.head;
    const count = (n) => n.toLocaleString("en"), most = Math.max(done, planned);
    Evalbus.setText(this.title, Evalbus.words(this.head.verdict) || this.answer() || "Overview");
    Evalbus.setText(this.progress, `${count(done)}${done < planned ? ` of ${count(planned)}` : ""} ${most === 1 ? "episode" : "episodes"}; ${waiting_runs
      ? `${Evalbus.plural(waiting_runs, "run")} not begun; ` : ""}${is_over ? "95 % intervals (Wilson)"
      : "rates of unfinished policies have anytime-valid intervals, differences are preliminary"}`);
    const problems = this.problems();
    const layout = JSON.stringify([this.head, problems]);
    if (layout !== this.layout) {
      this.layout = layout;
      this.showTable(problems);
      this.showFunnel();
    }
    this.seeds.show(this);
  }

  // Returns the remarks on the runs, such as that a file of a run cannot be read.
  problems() {
    return [...this.viewer.runs.values()].filter(({ info }) => !info.is_replaced)
      .flatMap(({ info }) => (info.remarks || []).map((remark) => `${Evalbus.runName(info)}: ${Evalbus.words(remark)}`));
  }

  // Returns the result of a single policy in one sentence; empty while episodes are missing.
  answer() {
    const { policies: [policy, ...others], is_over, is_sequential } = this.head;
    if (others.length || !is_over || is_sequential || !policy.all.judged) return "";
    const { rate, successes, judged, interval } = policy.all;
    return `${Evalbus.words(policy.name)} succeeds in ${Evalbus.percent(rate)} (${successes.toLocaleString("en")} of ${judged.toLocaleString("en")}), 95 % CI ${Evalbus.percentRange(interval)}`;
  }

  // problems: remarks to show below the table.
  showTable(problems) {
    const e = Evalbus.element, { tasks, policies } = this.head;
    const many = tasks.length > 1;
    const title = (text, hint) => e("th", { scope: "col", title: hint }, text);
    const head = e("tr", {}, title("policy"), title(many ? "all" : Evalbus.spaced(tasks[0].name)),
      policies.length > 1 ? title(`vs ${Evalbus.words(policies[this.head.baseline].name)}`, "difference of the success rates in percentage points, with its 95 % interval; over equal seeds if both have them") : null,
      many ? tasks.map((task) => title(Evalbus.spaced(task.name))) : null,
      // With several tasks, the mean would depend on which tasks a policy solves, so it is not shown.
      many ? null : title("time to success", "mean over the successes"), title("slips per episode", "mean over the complete episodes"));
    this.table.replaceChildren(e("thead", {}, head), e("tbody", {}, policies.map((policy, k) => this.policyRow(policy, k))));
    const remarks = policies.filter((policy) => policy.against && policy.against.remark)
      .map((policy) => `${Evalbus.words(policy.name)}: ${Evalbus.words(policy.against.remark)}`).concat(problems);
    // An interval that counts equal episodes once would contradict the shown counts without a note.
    policies.forEach((policy) => policy.cells.forEach((cell, task) => cell && cell.samples
      && remarks.push(`${Evalbus.words(policy.name)}, ${Evalbus.spaced(this.head.tasks[task].name)}: ${Evalbus.words(cell.samples)}`)));
    if (this.head.is_sequential) remarks.push("The plan tests its results while it runs; its report has the verdicts.");
    this.remarks.replaceChildren(...remarks.map((text) => e("p", { class: "ev-remark" }, text)));
  }

  policyRow(policy, k) {
    const e = Evalbus.element, { tasks } = this.head;
    const many = tasks.length > 1;
    const cell = (label, node, kind) => e("td", { class: kind, "data-label": label }, node);
    const against = policy.against;
    return e("tr", {},
      e("th", { scope: "row" }, e("a", { href: Evalbus.listLink(`policy=${Evalbus.filterValue(policy.name)}`) }, Evalbus.words(policy.name)),
        k < 9 ? e("span", { class: "ev-key", title: `The key ${k + 1} shows the episodes of this policy.` }, "key ", e("kbd", {}, String(k + 1))) : null),
      cell(many ? "all" : "success", this.rate(policy.all, policy, many ? null : tasks[0].name), "ev-all"),
      this.head.policies.length > 1 ? cell("difference", this.difference(against, k), "ev-against") : null,
      many ? policy.cells.map((one, t) => cell(Evalbus.spaced(tasks[t].name), this.rate(one, policy, tasks[t].name))) : null,
      many ? null : cell("time to success", policy.all.time_s === null ? "–" : `${policy.all.time_s.toFixed(2)} s`),
      cell("slips per episode", policy.slips_per_episode === null ? "–" : policy.slips_per_episode.toFixed(2)));
  }

  // Returns whether the folder of a policy's run was removed.
  isGone(policy) {
    return policy.runs.some((run) => this.viewer.runs.has(run) && this.viewer.runs.get(run).info.is_gone);
  }

  // Creates a success rate with its counts, and a bar with its interval.
  rate(counted, policy, task) {
    const e = Evalbus.element;
    if (!counted) return "";
    if (!counted.judged) return e("span", { class: "ev-note" }, !counted.done ? this.isGone(policy) ? "folder not found" : "no episode yet" : counted.complete ? "not judged" : "not scored");
    const [lower, upper] = counted.interval;
    const interval = e("i", { class: "ev-interval" }), mark = e("i", { class: "ev-rate-mark" });
    interval.style.left = `${100 * lower}%`;
    interval.style.width = `${100 * (upper - lower)}%`;
    mark.style.left = `${100 * counted.rate}%`;
    const filter = `policy=${Evalbus.filterValue(policy.name)}${task ? ` task=${Evalbus.filterValue(task)}` : ""}`;
    const range = Evalbus.percentRange([lower, upper]);
    return e("a", { class: "ev-rate-cell", href: Evalbus.listLink(filter), title: `95 % interval ${range}` },
      e("span", {}, e("b", {}, Evalbus.percent(counted.rate)), e("span", { class: "ev-counts" }, `${counted.successes.toLocaleString("en")} of ${counted.judged.toLocaleString("en")}`)),
      e("span", { class: "ev-rate", "aria-hidden": "true" }, interval, mark), e("span", { class: "ev-range" }, range));
  }

  difference(against, k) {
    const e = Evalbus.element;
    if (k === this.head.baseline) return e("span", { class: "ev-note" }, "baseline");
    if (!against || against.remark || against.difference === null) return "–";
    const [lower, upper] = against.interval;
    // The rounding is the same as in results/conclusion.cc.
    const excludes0Closely = (lower > 0 || upper < 0) && Math.min(Math.abs(lower), Math.abs(upper)) < 0.005;
    const isFine = upper - lower < 0.02 || excludes0Closely, points = (share) => Evalbus.points(share, isFine ? 1 : 0);
    const { policies, baseline } = this.head;
    const decimals = isFine ? 1 : Evalbus.pointDecimals(against.difference, policies[k].all.rate, policies[baseline].all.rate);
    const word = against.judgment || (this.head.is_over && !this.head.is_sequential ? "not shown to differ" : "so far");
    // The number of pairs is given, because the rates next to the difference cover all episodes of each policy.
    const only = against.paired && against.trials < this.head.policies[k].all.judged ? `; over ${against.trials.toLocaleString("en")} ${against.trials === 1 ? "pair" : "pairs"}` : "";
    return e("span", {}, e("b", { class: `ev-${against.judgment || "open"}` }, `${Evalbus.points(against.difference, decimals)} points`),
      e("span", { class: "ev-counts" }, `${points(lower)} to ${points(upper)}`),
      e("span", { class: "ev-note" }, `${word}${against.p === null ? "" : `, ${against.is_adjusted ? "adjusted " : ""}${Evalbus.pText(against.p)}`}${only}`));
  }

  // Shows for each task one line per policy, with the share of its episodes that reached each stage.
  showFunnel() {
    const e = Evalbus.element, { tasks, policies } = this.head;
    this.funnel.replaceChildren(...tasks.map((task, t) => {
      const names = new Map(task.stage_names);
      const indices = [...new Set(policies.flatMap((policy) => (policy.cells[t] ? policy.cells[t].stages.map(([index]) => index) : [])))]
        .sort((a, b) => a - b);
      if (!indices.length) return null;
      const bar = (share) => {
        const fill = e("i", {});
        fill.style.transform = `scaleX(${share || 0})`;
        return e("td", {}, e("span", { class: "ev-funnel-bar" }, fill), e("span", {}, Evalbus.percent(share)));
      };
      const line = (policy) => {
        const counted = policy.cells[t];
        if (!counted || !counted.complete) return null;
        const reached = new Map(counted.stages);
        return e("tr", {}, e("th", { scope: "row" }, Evalbus.words(policy.name)),
          indices.map((index) => bar((reached.get(index) || 0) / counted.complete)), bar(counted.rate));
      };
      const stage = (index) => e("th", { scope: "col" }, names.has(index) ? `${index} ${Evalbus.spaced(names.get(index))}` : `stage ${index}`);
      return e("div", { class: "ev-scroll", tabindex: "0", role: "region", "aria-label": `stages of ${Evalbus.spaced(task.name)}` },
        e("table", { class: "ev-funnel" }, e("caption", {}, Evalbus.spaced(task.name)),
          e("thead", {}, e("tr", {}, e("td", {}), indices.map(stage), e("th", { scope: "col" }, "success"))),
          e("tbody", {}, policies.map(line))));
    }).filter(Boolean));
    this.funnelTitle.hidden = !this.funnel.childElementCount;
    if (policies.some((policy) => policy.cells.some((cell) => cell && cell.successes_without_stage)))
      this.funnel.append(e("p", { class: "ev-note" }, "Stages are not conditions of success: some successes did not reach every stage."));
  }
};

// Returns the URL fragment of the list of episodes with a filter.
Evalbus.listLink = (filter) => `#/episodes${filter ? `:${encodeURIComponent(filter)}` : ""}`;
