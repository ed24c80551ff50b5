// The views of the page: overview, list of episodes, and player. The URL fragment selects one: #/board, #/episodes:FILTER,
// #/player, or #view:... for an episode in the player.
"use strict";

Evalbus.Views = class {
  constructor(viewer) {
    const e = Evalbus.element;
    this.viewer = viewer;
    this.app = viewer.parts.app;
    this.name = "player";
    const link = (name, text, href) => e("a", { href, "data-view": name }, text);
    this.nav = e("nav", { class: "ev-nav", hidden: "", "aria-label": "views" }, link("board", "Overview", "#/board"),
      link("episodes", "Episodes", "#/episodes"), link("player", "Player", "#/player"));
    this.boardPlace = e("section", { class: "ev-board", "aria-label": "overview" });
    this.listPlace = e("section", { class: "ev-all-episodes", "aria-label": "episodes" });
    this.tip = e("div", { class: "ev-hover", id: "ev-hover", role: "tooltip", hidden: "" });
    viewer.parts.app.querySelector(".ev-head").insertBefore(this.nav, viewer.parts.rate);
    this.app.append(this.boardPlace, this.listPlace, this.tip, viewer.notes.dialog);
    this.thumbnails = viewer.thumbnails;
    const hover = (row, node) => this.hover(row, node);
    this.board = new Evalbus.Board(this.boardPlace, viewer, hover);
    this.episodes = new Evalbus.Episodes(this.listPlace, this.board, this.thumbnails, {
      changed: (filter) => viewer.fragment.write(Evalbus.listLink(filter)),
    });
    this.choose("player");
  }

  get isPlayer() {
    return this.name === "player";
  }

  hearBoard(head) {
    const isFirst = !this.board.head;
    this.board.hear(head);
    const isNew = this.board.adopt();
    this.nav.hidden = false;
    // A page with several combinations of policy and task opens with the overview, unless its URL selects another view or an
    // episode is already shown.
    if (isFirst && this.board.cells > 1 && !location.hash && !this.viewer.tracks.length) {
      history.replaceState(null, "", "#/board");
      this.choose("board");
    }
    this.viewer.showHead();
    if (isNew) this.show();
  }

  // Shows new data at most ten times per second, and a new overview at once.
  update() {
    const isNew = this.board.adopt();
    if (isNew) this.viewer.showHead();
    if (this.isPlayer) return;
    if (isNew || this.board.isLoaded) this.show();
    else if (!this.timer) this.timer = setTimeout(() => this.show(), 100);
  }

  show() {
    clearTimeout(this.timer);
    this.timer = null;
    if (this.name === "board") this.board.show();
    if (this.name === "episodes") this.episodes.show();
  }

  // Returns a summary of all runs in the form of the head of a "run" block, for the head of the page.
  info() {
    const { num_policies, num_tasks, is_over } = this.board.head || { num_policies: 0, num_tasks: 0 };
    return { name: "evalbus", task: `${num_policies} ${num_policies === 1 ? "policy" : "policies"}, ${Evalbus.plural(num_tasks, "task")}`, is_over,
      is_live: this.some("is_live"), is_active: this.some("is_active"), is_gone: this.some("is_gone") };
  }

  some(key) {
    return [...this.viewer.runs.values()].some((run) => run.info[key]);
  }

  choose(name) {
    // A field of the previous view, which is now hidden, must not receive keys for the new view.
    const focused = document.activeElement;
    if (name !== this.name && focused && this.app.contains(focused)) focused.blur();
    this.name = name;
    this.app.dataset.view = name;
    for (const link of this.nav.children) {
      if (link.dataset.view === name) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
    }
    this.hover(null);
    this.show();
    this.viewer.showHead();
    if (name !== "player") return;
    this.viewer.showRun();
    this.viewer.openFirst();
  }

  // Returns whether the URL fragment selects a view other than an episode.
  followHash() {
    let hash = location.hash;
    try {
      hash = decodeURIComponent(hash);
    } catch (error) {
      // The fragment is used as it is, as in Viewer.readHash().
    }
    const match = /^#\/(board|episodes|player)(?::(.*))?$/.exec(hash);
    if (!match) {
      if (hash.startsWith("#view:")) this.choose("player");
      // The browser's back button may return to the URL without a fragment, with which the page was opened.
      if (hash === "" && this.board.head) this.choose(this.board.cells > 1 ? "board" : "player");
      return false;
    }
    if (match[1] === "episodes") this.episodes.setFilter(match[2] || "");
    this.choose(match[1]);
    return true;
  }

  // Shows a row's outcome and its decisive seconds next to a node. hover(null) hides them.
  hover(row, node) {
    const key = row && Evalbus.keyOf(row);
    // If a matrix is redrawn under the pointer, the image must not restart.
    if (key && key === this.hovered) return;
    this.hovered = key;
    clearTimeout(this.hoverTimer);
    if (!row) {
      this.tip.hidden = true;
      this.thumbnails.stop();
      return;
    }
    const e = Evalbus.element;
    const outcome = Evalbus.FILTER_TEXTS.result(row);
    const image = e("div", { class: "ev-tip-image" });
    this.tip.replaceChildren(e("b", {}, `${Evalbus.words(row.policy)} · episode ${row.episode}`),
      e("span", { class: "ev-note" }, `seed ${row.seed}`),
      e("span", {}, Evalbus.words(row.cause_text || row.text) || Evalbus.spaced(outcome)),
      ...(row.note ? [e("span", { class: "ev-noted-text" }, `✎ ${Evalbus.words(row.note)}`)] : []), image);
    this.tip.hidden = false;
    const box = node.getBoundingClientRect(), tip = this.tip.getBoundingClientRect();
    const left = Math.max(8, Math.min(box.left, window.innerWidth - tip.width - 8));
    const isAbove = box.bottom + tip.height + 8 > window.innerHeight && box.top > tip.height + 8;
    this.tip.style.transform = `translate(${left}px, ${isAbove ? box.top - tip.height - 6 : box.bottom + 6}px)`;
    image.hidden = row.has_track === false;
    // The image is loaded only when the pointer rests, because the server must read the episode's log.
    if (!image.hidden) this.hoverTimer = setTimeout(() => this.thumbnails.play(row, image), 250);
  }

  // ---- keys of the page; key() returns whether it has handled the event

  key(event) {
    const { key } = event;
    if (!this.board.head) return false;
    if (key === "Escape" && !this.tip.hidden) {
      this.hover(null);
      return true;
    }
    const actions = {
      j: () => this.goToFailure(1), k: () => this.goToFailure(-1), "/": () => this.search(),
      s: () => this.save(), m: () => this.editNote(), b: () => { location.hash = "#/board"; },
    };
    const policy = /^[1-9]$/.test(key) ? Number(key) - 1 : -1;
    if (policy >= 0 && policy < this.board.head.policies.length) this.goToPolicy(policy);
    else if (Object.hasOwn(actions, key)) actions[key]();
    else return false;
    event.preventDefault();
    return true;
  }

  search() {
    if (this.name !== "episodes") location.hash = Evalbus.listLink(this.episodes.filter.value);
    this.choose("episodes");
    this.episodes.filter.focus();
    this.episodes.filter.select();
  }

  // Finds the next failure that the filter accepts, and selects it in the list. The player opens it; the overview is replaced by
  // the list.
  goToFailure(way) {
    this.episodes.show();
    const shown = this.isPlayer && this.viewer.tracks[0] ? this.viewer.tracks[0].key : this.episodes.selected;
    const row = this.episodes.neighbor(shown, way, Evalbus.isFailure);
    if (!row) return;
    this.episodes.select(row);
    if (this.isPlayer) location.hash = Evalbus.episodeLink(row);
    else if (this.name === "board") location.hash = Evalbus.listLink(this.episodes.filter.value);
    this.episodes.reveal(row);
  }

  // In the player, opens the episode of another policy with the same task and seed. In other views, opens the list of the
  // policy's episodes.
  goToPolicy(k) {
    const track = this.viewer.tracks[0];
    if (!this.isPlayer || !track) {
      location.hash = Evalbus.listLink(`policy=${Evalbus.filterValue(this.board.head.policies[k].name)}`);
      return;
    }
    const row = this.board.rowsOf(k).find((one) => one.seed === track.head.seed && one.task === track.head.task
      && one.variation === track.head.variation && one.has_track !== false);
    if (row) location.hash = Evalbus.episodeLink(row);
  }

  editNote() {
    const key = this.isPlayer ? this.viewer.tracks[0] && this.viewer.tracks[0].key : this.episodes.selected;
    const row = key && this.board.rows().find((one) => Evalbus.keyOf(one) === key);
    if (!row) return;
    if (!this.viewer.notes.canWrite) this.viewer.complain(new Error("notes can be written only from the machine of the server"));
    else this.viewer.notes.edit(row.run, row.episode, `${Evalbus.words(row.policy)}, ${Evalbus.spaced(Evalbus.FILTER_TEXTS.task(row))}, episode ${row.episode}`);
  }

  // Saves an image of the scene, or of the whole view.
  async save() {
    const blob = this.isPlayer ? await this.viewer.imageOfScene() : await Evalbus.imageOf(this.app);
    if (!blob) return;
    const track = this.viewer.tracks[0];
    const name = this.isPlayer ? `${Evalbus.words(track.head.policy)}-episode-${track.episode}-tick-${this.viewer.tick}` : this.name;
    const link = Evalbus.element("a", { href: URL.createObjectURL(blob), download: `${name.replace(/[^\w.-]+/g, "_")}.png` });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }
};

// Renders an element as PNG. A copy of the element and the style sheets are put into an SVG image.
Evalbus.imageOf = async (node) => {
  const width = node.clientWidth, height = node.scrollHeight;
  const copy = node.cloneNode(true);
  const canvases = copy.querySelectorAll("canvas");
  node.querySelectorAll("canvas").forEach((canvas, k) => {
    canvases[k].replaceWith(Evalbus.element("img", { src: canvas.toDataURL(), width: canvas.clientWidth, height: canvas.clientHeight }));
  });
  const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]).map((rule) => rule.cssText).join("\n");
  const outer = Evalbus.element("div", { class: "evalbus-viewer ev-whole-page" }, Evalbus.element("style", {}, rules), copy);
  const markup = new XMLSerializer().serializeToString(outer);
  const svg = `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}">`
    + `<foreignObject width="100%" height="100%">${markup}</foreignObject></svg>`;
  const image = new Image();
  image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`;
  await image.decode();
  const canvas = Evalbus.element("canvas", { width, height });
  const context = canvas.getContext("2d");
  context.fillStyle = getComputedStyle(node).backgroundColor;
  context.fillRect(0, 0, width, height);
  context.drawImage(image, 0, 0);
  return new Promise((done) => canvas.toBlob(done, "image/png"));
};
