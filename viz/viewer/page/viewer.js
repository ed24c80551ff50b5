// The viewer: selects the run, episode and time that are shown, and updates the other parts of the page.
"use strict";

Evalbus.Viewer = class {
  constructor(place) {
    this.place = place;
    place.classList.add("evalbus-viewer");
    this.isPacked = place.dataset.from === "page";
    place.classList.toggle("ev-whole-page", !this.isPacked);
    this.parts = Evalbus.makeLayout(place);
    this.palette = Evalbus.paletteOf(place);
    this.player = new Evalbus.Player();
    this.runs = new Map();
    this.shownRun = null;
    this.tracks = [];  // A and, if compared, B
    this.isBeside = false;
    this.recent = new Map();  // tracks of finished episodes, newest last
    this.problem = "";
    this.isOpening = null;  // number of the episode that is being loaded
    this.openingRun = null;  // run of this episode
    this.missed = null;  // arguments of an open() that failed while the connection was lost
    this.connectionState = "connecting";
    const seek = (tick) => this.seek(tick);
    this.timeline = new Evalbus.Timeline(this.parts.lanes, seek, () => this.curves.redraw(), (place) => this.showPointed(place));
    this.conditions = new Evalbus.Conditions(this.parts.conditions, seek);
    this.curves = new Evalbus.Curves(this.parts.curves, this.timeline, () => this.showTimeline());
    this.images = new Evalbus.Images(this.parts.images);
    this.runPanel = new Evalbus.RunPanel(this.parts.run, {
      open: (row) => this.open(row.run, row.episode).then(() => this.writeHash()),
      compare: (row) => this.compare(row.run, row.episode).then(() => this.writeHash()),
      chooseRun: (run) => this.chooseRun(run),
      canOpen: (row) => row.has_track !== false && this.source.has(row.run, row.episode),
    });
    const Source = this.isPacked ? Evalbus.PackedSource : Evalbus.LiveSource;
    this.source = new Source({
      run: (head) => this.hearRun(head), episodes: (head) => this.hearEpisodes(head), log: (head) => this.hearLog(head),
      track: (track) => this.hearTrack(track), ticks: (track) => this.hearTicks(track),
      board: (head) => this.views && this.views.hearBoard(head), notes: (head) => this.hearNotes(head),
      judge: (head) => this.judge.hear(head),
      connection: (state) => this.hearConnection(state),
    });
    this.assets = new Evalbus.Assets(this.source);
    this.thumbnails = new Evalbus.Thumbnails(this.source, (run, episode) => this.trackOf(run, episode), () => this.palette);
    this.parts.app.append(this.thumbnails.home);
    this.judge = new Evalbus.Judge(this);
    this.fragment = new Evalbus.FragmentWriter();
    this.comparison = 0;  // number of calls of compare()
    this.notes = new Evalbus.Notes((note) => this.source.send({ note }));
    // A report has neither an overview nor a list of several runs.
    this.views = this.isPacked ? null : new Evalbus.Views(this);
    this.bindParts();
    // data-open: selection that the page opens if its URL contains none.
    this.wanted = this.readHash() || this.readHash(place.dataset.open);
    if (this.views) this.views.followHash();
    this.player.isFollowing = !this.isPacked && !this.wanted;
    this.player.isPlaying = this.player.isFollowing;
    // The viewer renders only while it is visible. In a report, it also frees its GPU memory while it is not.
    new IntersectionObserver((entries) => this.setSeen(entries[entries.length - 1].isIntersecting)).observe(this.parts.view);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.palette = Evalbus.paletteOf(place);
      if (this.scene) this.scene.palette = this.palette;
      this.showTracks();
      this.buildScene();
    });
    window.addEventListener("hashchange", () => this.followHash());
    this.showAll();
    Promise.resolve(this.source.start()).catch((error) => this.complain(error));
    this.last = performance.now();
    this.wake();
  }

  bindParts() {
    const p = this.parts;
    p.play.addEventListener("click", () => this.togglePlay());
    p.first.addEventListener("click", () => this.seek(0));
    p.end.addEventListener("click", () => this.seek(this.player.last));
    p.before.addEventListener("click", () => this.step(-1));
    p.after.addEventListener("click", () => this.step(1));
    p.rateChoice.value = "1";
    p.rateChoice.addEventListener("change", () => { this.player.rate = Number(p.rateChoice.value); });
    p.follow.addEventListener("click", () => this.follow());
    p.mode.addEventListener("click", () => this.toggleBeside());
    p.uncompare.addEventListener("click", () => this.uncompare());
    p.sameSeed.addEventListener("click", () => this.compareSameSeed());
    p.help.addEventListener("click", () => p.keys.showModal());
    p.camera.addEventListener("change", () => {
      if (this.scene) this.scene.setCamera(p.camera.value === "" ? null : p.camera.value);
    });
    const layers = [["contacts", "contacts"], ["trails", "wrist trajectories"], ["highlight", "highlight target object"],
      ["shadows", "shadows"], ["collision", "collision shapes"], ["clearance", "clearance"]];
    this.layers = { contacts: true, trails: true, highlight: true, shadows: true, collision: false, clearance: false };
    p.layerList.append(...layers.map(([name, text]) => {
      const box = Evalbus.element("input", { type: "checkbox", name });
      box.checked = this.layers[name];
      box.addEventListener("change", () => this.setLayer(name, box.checked));
      return Evalbus.element("label", {}, box, ` ${text}`);
    }));
    const target = this.isPacked ? p.app : document;
    if (this.isPacked) p.app.tabIndex = -1;
    target.addEventListener("keydown", (event) => this.key(event));
  }

  setLayer(name, isShown) {
    this.layers[name] = isShown;
    if (this.scene) {
      this.scene.setLayer(name, isShown);
      this.moved();
    }
  }

  // ---- updates from the source

  runOf(number) {
    // changes: counts the updates that removed episodes.
    if (!this.runs.has(number)) this.runs.set(number, { info: { run: number }, episodes: [], changes: 0, lines: [], track: null });
    return this.runs.get(number);
  }

  hearRun(head) {
    this.wake();
    const run = this.runOf(head.run);
    // A restarted server may use the number for a different run. While a server runs, task and policy may become known later.
    const keys = run.isStale ? ["name", "policy", "task", "variation"] : ["name"];
    if (run.info.name !== undefined && keys.some((key) => run.info[key] !== head[key])) {
      this.forget(head.run);
      Object.assign(run, { episodes: [], changes: run.changes + 1, lines: [], track: null });
    }
    // A list without episodes is not sent to a page that connects.
    if (run.isStale && head.done === 0) Object.assign(run, { episodes: [], changes: run.changes + 1 });
    run.isStale = false;
    const isLiveChanged = run.info.is_live !== head.is_live;
    run.info = head;
    if (isLiveChanged) this.showConditions();
    if (this.shownRun === null) this.shownRun = head.run;
    this.showRun();
    this.showHead();
    if (this.views) this.views.update();
  }

  hearNotes(head) {
    this.notes.hear(head);
    if (this.views) this.views.update();
    this.showTracks();
  }

  hearEpisodes(head) {
    const run = this.runOf(head.run);
    // The episodes that are removed from the list may have been repeated (--resume), or the folder contains a different run.
    const removed = run.episodes.splice(head.from);
    for (const row of removed) this.recent.delete(Evalbus.keyOf(row));
    if (removed.length) ++run.changes;
    for (const row of head.episodes) run.episodes.push({ ...row, run: head.run });
    this.showRun();
    if (this.views) this.views.update();
    this.openFirst();
  }

  hearLog(head) {
    const run = this.runOf(head.run);
    run.lines = run.lines.concat(head.lines).slice(-500);
    this.showRun();
  }

  hearTrack(track) {
    this.wake();
    const run = this.runOf(track.run);
    const before = run.track;
    run.track = track;
    if (before && before.head.is_over) this.keep(before);
    const shown = this.tracks[0];
    if (shown && shown.key === track.key && shown.attempt === track.attempt) {
      // The track contains more complete data of the attempt that is shown.
      this.tracks[0] = track;
      this.setLength();
      this.showTracks();
      if (!this.scene || !this.isSceneReady || !this.scene.exchange(shown, track)) this.buildScene();
      return;
    }
    this.followNewest();
    this.openFirst();
  }

  hearTicks(track) {
    this.wake();
    if (this.tracks[0] !== track) return;
    this.setLength();
    this.areNumbersOld = true;
  }

  hearConnection(state) {
    this.connectionState = state;
    if (state === "packed") this.openFirst();
    if (state === "open") {
      this.problem = "";
      for (const run of this.runs.values()) run.isStale = true;
      // The next server may have different runs with the same numbers.
      this.recent.clear();
      this.removeStaleLater();
      this.judge.reconnect();
      if (this.missed) this.open(...this.missed);
      this.showEmpty();
    }
    if (state === "unsupported") this.complain(new Error("this browser cannot unpack the episodes (it has no DecompressionStream); newer browsers can"));
    this.showHead();
    if (this.tracks.length === 0) this.showEmpty();
  }

  // Removes the tracks of a run, including those that are shown.
  forget(run) {
    for (const key of [...this.recent.keys()]) {
      if (key.startsWith(`${run}/`)) this.recent.delete(key);
    }
    if (!this.tracks.some((track) => track.run === run)) return;
    ++this.comparison;
    if (this.tracks[0].run !== run) {
      this.setTracks(this.tracks.slice(0, 1));
      return;
    }
    this.tracks = [];
    if (this.scene) {
      this.scene.hide();
      this.isSceneReady = false;
    }
    const p = this.parts;
    p.lanes.hidden = p.images.hidden = true;
    p.labels.replaceChildren();
    for (const one of [p.clockTime, p.clockTick]) Evalbus.setText(one, "");
    this.showEmpty();
  }

  // Right after the connection opens, a restarted server sends the runs that it has. 1 s later, all others are removed.
  removeStaleLater() {
    clearTimeout(this.staleTimer);
    this.staleTimer = setTimeout(() => {
      const stale = [...this.runs].filter(([, run]) => run.isStale).map(([number]) => number);
      if (this.connectionState !== "open" || !stale.length) return;
      if (stale.length === this.runs.size) {
        // The server has not read its folders yet.
        this.removeStaleLater();
        return;
      }
      for (const number of stale) {
        this.forget(number);
        this.runs.delete(number);
      }
      if (!this.runs.has(this.shownRun)) this.shownRun = this.runs.keys().next().value;
      this.showAll();
      if (this.views) this.views.update();
      this.openFirst();
    }, 1000);
  }

  // While following, switches to a new episode after the end of the previous one has been shown for 0.9 s.
  followNewest() {
    if (!this.player.isFollowing) return;
    const run = this.runs.get(this.shownRun);
    const next = run && run.track;
    const shown = this.tracks[0];
    if (!next || next === shown || next.ticks === 0) return;
    const isSeen = !shown || shown.run !== next.run || (this.player.tick >= this.player.last && this.player.rested_s > 0.9);
    if (!isSeen) return;
    this.setTracks([next]);
    this.player.tick = 0;
    this.player.rested_s = 0;
  }

  // ---- selection of what is shown

  keep(track) {
    this.recent.delete(track.key);
    this.recent.set(track.key, track);
    if (this.recent.size > 12) this.recent.delete(this.recent.keys().next().value);
  }

  async trackOf(run, episode) {
    const key = `${run}/${episode}`;
    const live = this.runs.has(run) && this.runs.get(run).track;
    if (live && live.key === key) return live;
    if (this.recent.has(key)) return this.recent.get(key);
    const track = await this.source.episode(run, episode);
    this.keep(track);
    return track;
  }

  // Opens an episode at time_s (s) or, by default, at Evalbus.openingTime, and plays it unless isPlaying is false.
  async open(run, episode, time_s, isPlaying = true) {
    const turn = this.turn = (this.turn || 0) + 1;
    this.wanted = this.missed = null;
    this.isOpening = episode;
    this.openingRun = run;
    this.showHead();
    this.showRun();
    this.showEmpty();
    try {
      const track = await this.trackOf(run, episode);
      if (turn !== this.turn) return;
      this.problem = "";
      this.player.pause();
      this.shownRun = run;
      this.setTracks([track]);
      this.player.seek((time_s === undefined ? Evalbus.openingTime(track.head) : time_s) / track.tickSeconds);
      if (isPlaying && !this.player.isCalm) this.player.play();
    } catch (error) {
      if (turn !== this.turn) return;
      // Opening is retried when the connection is restored.
      if (this.connectionState === "lost") this.missed = [run, episode, time_s, isPlaying];
      this.complainOf(run, episode, error);
    } finally {
      if (turn === this.turn) this.isOpening = null;
    }
    this.showAll();
  }

  // Shows a second episode for comparison. compare(null) ends the comparison.
  async compare(run, episode, isBeside) {
    if (run === null) {
      ++this.comparison;
      this.setTracks(this.tracks.slice(0, 1));
      this.showAll();
      return;
    }
    const turn = this.turn, comparison = ++this.comparison;
    // The user may open or compare another episode in the meantime.
    const isOutdated = () => turn !== this.turn || comparison !== this.comparison;
    try {
      const track = await this.trackOf(run, episode);
      if (isOutdated() || !this.tracks.length) return;
      if (isBeside !== undefined) this.isBeside = isBeside;
      this.player.isFollowing = false;
      this.setTracks([this.tracks[0], track]);
    } catch (error) {
      if (!isOutdated()) this.complainOf(run, episode, error);
    }
    this.showAll();
  }

  // Returns the episode with the same task, variation and seed in another run, or null if there is none.
  twin() {
    const track = this.tracks[0];
    if (!track || this.runs.size < 2) return null;
    for (const [number, run] of this.runs) {
      if (number === track.run) continue;
      const row = run.episodes.find((one) => one.seed === track.head.seed && one.task === track.head.task
        && one.variation === track.head.variation && this.source.has(number, one.episode) && one.has_track !== false);
      if (row) return { ...row, name: Evalbus.runName(run.info) };
    }
    return null;
  }

  compareSameSeed() {
    const twin = this.twin();
    if (twin) this.compare(twin.run, twin.episode).then(() => this.writeHash());
  }

  uncompare() {
    this.compare(null).then(() => this.writeHash());
  }

  toggleBeside() {
    this.isBeside = !this.isBeside;
    this.setTracks(this.tracks);
    this.showAll();
    this.writeHash();
  }

  chooseRun(run) {
    this.wanted = null;
    this.shownRun = run;
    this.source.watch(run);
    if (this.player.isFollowing) this.followNewest();
    else if (!this.isPacked) this.follow();
    this.showAll();
  }

  follow() {
    if (this.isPacked) return;
    this.player.follow();
    // The address must not select the episode that was shown before.
    if (location.hash.startsWith("#view:")) this.fragment.write("#/player");
    const run = this.runs.get(this.shownRun);
    if (run && run.track) {
      this.setTracks([run.track]);
      this.player.tick = this.player.last;
    }
    this.showAll();
  }

  // Opens an episode if none is shown: the episode that the URL or data-open selects. Without a selection, this is the live
  // episode while following, otherwise the first failure or, if there is none, the first episode.
  openFirst() {
    if (this.tracks.length || this.isOpening !== null || (this.views && !this.views.isPlayer)) return;
    if (this.wanted) {
      const { run, episode, time, other } = this.wanted;
      const row = this.runs.has(run) && this.runs.get(run).episodes.find((one) => one.episode === episode);
      const live = this.runs.has(run) && this.runs.get(run).track;
      if (!row && !(live && live.episode === episode)) {
        this.showEmpty();
        return;
      }
      this.open(run, episode, time, false).then(() => other && this.compare(other[0], other[1], other[2]));
      return;
    }
    if (this.player.isFollowing) {
      this.followNewest();
      const run = this.runs.get(this.shownRun);
      // No process of an interrupted run or of a run in one process sends ticks.
      const isGoingOn = !run || run.track || (!run.info.is_over && run.info.is_live);
      if (this.tracks.length || isGoingOn) return;
    } else if (this.isPacked && this.connectionState !== "packed") {
      return;
    }
    for (const [number, run] of this.runs) {
      const rows = run.episodes.filter((row) => row.has_track !== false && this.source.has(number, row.episode));
      const row = rows.find((one) => Evalbus.resultOf(one) === "failure") || rows[0];
      if (!row) continue;
      const isAtEnd = this.isPacked && (row.success || row.cause_text === null);
      this.open(number, row.episode, isAtEnd ? Infinity : undefined, !this.isPacked).then(() => {
        const twin = this.isPacked && this.twin();
        if (twin) this.compare(twin.run, twin.episode);
      });
      return;
    }
  }

  setTracks(tracks) {
    this.tracks = tracks;
    if (!tracks.length) return;
    this.setLength();
    this.findParting().catch((error) => this.complain(error));
    this.showTracks();
    this.buildScene();
  }

  // Sets the length of the player to that of the longer track.
  setLength() {
    const [track, other] = this.tracks;
    const ticks = other ? Math.max(track.ticks, Math.ceil(other.ticks * other.tickSeconds / track.tickSeconds)) : track.ticks;
    this.player.setLength(ticks, track.tickSeconds);
  }

  ticksShown() {
    const [track, other] = this.tracks;
    const tick = this.player.tick;
    const own = Math.min(tick, track.last);
    return other ? [own, Math.min(tick * track.tickSeconds / other.tickSeconds, other.last)] : [own];
  }

  // Returns the index of the object of the first unreached stage: the only object, or the object that the stage's name
  // contains. Returns -1 if there is none.
  litObject(track, tick) {
    const objects = track.head.objects || [];
    const stage = (track.head.stages || []).find((one) => one.tick === null || one.tick > tick);
    if (!stage || !objects.length || (track.head.is_over && tick >= track.last)) return -1;
    if (objects.length === 1) return 0;
    return objects.findIndex((name) => `_${stage.name}_`.includes(`_${name}_`));
  }

  // ---- 3D image

  setSeen(isSeen) {
    this.wake();
    this.isSeen = isSeen;
    if (isSeen && !this.scene && !this.sceneProblem) this.buildScene();
    if (!isSeen && this.scene && this.isPacked) {
      this.scene.dispose();
      this.scene = null;
      this.assets = new Evalbus.Assets(this.source);
      this.isSceneReady = false;
      this.thumbnails.release();
    }
  }

  async buildScene() {
    if (!this.isSeen || !this.tracks.length) return;
    if (this.sceneProblem) {
      this.noteScene(this.sceneProblem);
      return;
    }
    const tracks = this.tracks.filter((track) => track.head.scene);
    if (!tracks.length) {
      this.noteScene("no image: the model files of this run are missing or have changed");
      return;
    }
    try {
      if (typeof THREE === "undefined") throw new Error("three.js was not loaded");
      if (!this.scene) {
        this.scene = new Evalbus.SceneView(this.parts.view, this.assets, this.palette);
        this.scene.onDirty = () => this.wake();
        this.scene.onCamera = (name) => { this.parts.camera.value = name || ""; };
        Object.assign(this.scene.layers, this.layers);
        if (this.isPacked) this.scene.zoomOnFocus();
        this.scene.onSlow = () => {
          this.setLayer("shadows", false);
          this.parts.layerList.querySelector("[name=shadows]").checked = false;
        };
      }
    } catch (error) {
      this.sceneProblem = `no image: ${error.message}; numbers and timeline are complete`;
      this.noteScene(this.sceneProblem);
      return;
    }
    const scene = this.scene;
    try {
      this.isSceneReady = false;
      // Until its first episode is loaded, the scene has no image.
      if (!scene.views.length) this.noteScene(Evalbus.LOADING);
      if (!await scene.show(tracks, this.isBeside)) return;
      this.isSceneReady = true;
      this.noteScene("");
      this.showCameras();
      this.moved();
    } catch (error) {
      this.noteScene(`no image: ${error.message}`);
    }
  }

  // Shows the scene at the time under the pointer in `place`, an element above the timeline. If `place` is null, hides it.
  showPointed(place) {
    const isShown = this.isPointing && place;
    this.isPointing = Boolean(place);
    if (isShown) {
      this.thumbnails.wake();
      return;
    }
    clearTimeout(this.pointTimer);
    this.thumbnails.stop();
    if (!place || !this.isSceneReady) return;
    // The delay avoids drawing images for a pointer that only crosses the timeline.
    this.pointTimer = setTimeout(() => {
      place.hidden = false;
      this.thumbnails.follow(this.scene, this.tracks, this.scene.isBeside, place, () => this.timeline.pointed);
    }, 150);
  }

  // Resolves to a PNG of the scene as it is shown, or to null if there is no 3D image.
  imageOfScene() {
    if (!this.scene || !this.isSceneReady) return Promise.resolve(null);
    // The scene is drawn again, because the browser may clear the canvas after showing it.
    this.scene.isDirty = true;
    this.scene.draw();
    return new Promise((done) => this.scene.canvas.toBlob(done, "image/png"));
  }

  noteScene(text) {
    Evalbus.setText(this.parts.note, Evalbus.words(text));
    this.parts.note.hidden = text === "";
  }

  showCameras() {
    const names = this.scene.cameras;
    const layout = JSON.stringify(names);
    if (layout !== this.camerasLayout) {
      this.camerasLayout = layout;
      this.parts.camera.replaceChildren(Evalbus.element("option", { value: "" }, "free camera"),
        ...names.map((name) => Evalbus.element("option", { value: name }, Evalbus.words(name))));
    }
    this.parts.camera.value = this.scene.cameraName || "";
  }

  // ---- update of the panels

  showAll() {
    this.showHead();
    this.showRun();
    this.showTransport();
    this.showEmpty();
  }

  // Returns the run that the page's head and the run's panel show: while a link is being opened, the run of the link.
  get headRun() {
    const { wanted } = this;
    const opened = this.isOpening !== null ? this.openingRun : wanted && !this.tracks.length ? wanted.run : null;
    return this.runs.get(this.runs.has(opened) ? opened : this.shownRun);
  }

  showHead() {
    const run = this.headRun;
    const info = this.views && !this.views.isPlayer ? this.views.info() : run ? run.info : {};
    const p = this.parts;
    const name = Evalbus.words(info.name);
    Evalbus.setText(p.title, name || (this.isPacked ? "Episodes" : "evalbus"));
    const task = [Evalbus.words(info.task), Evalbus.words(info.variation)].filter(Boolean).join("/");
    if (!this.isPacked) this.showTitle(name === "evalbus" ? "" : name);
    Evalbus.setText(p.subtitle, [task, Evalbus.words(info.policy), Evalbus.words(info.clock)].filter(Boolean).join(" · "));
    Evalbus.setText(p.rate, info.judged ? `${info.successes} of ${info.judged} · ${Evalbus.percent(info.rate)}` : "");
    // If the shown run has finished and others have not, the state of all runs together is shown.
    const several = Boolean(this.views) && this.views.board.cells > 1;
    const shown = several && info.is_over ? this.views.info() : info;
    const states = {
      connecting: ["wait", "connecting"], unsupported: ["gone", "cannot be unpacked"], packed: ["still", "recorded run"],
      lost: ["gone", this.runs.size ? "connection lost; reconnecting" : "no connection yet; retrying"],
      open: shown.is_over ? ["still", shown.is_live !== false ? "run ended" : several ? "finished" : "finished run"]
        : shown.is_live === false ? shown.is_active ? ["live", "running"] : shown.is_gone ? ["gone", "folder not found"] : ["still", "interrupted (no process on this machine)"] : ["live", Evalbus.words(shown.phase) === "running" || !shown.phase ? "live" : `live · ${Evalbus.words(shown.phase)}`],
    };
    const [kind, text] = states[this.connectionState];
    p.state.dataset.kind = kind;
    Evalbus.setText(p.state, text);
    p.follow.hidden = this.isPacked || info.is_live === false;
  }

  // Sets the title of the browser's tab.
  showTitle(name) {
    const title = name ? `${name} – evalbus` : "evalbus";
    if (document.title !== title) document.title = title;
  }

  showRun() {
    // In the other views, the panel is hidden. Views.choose() calls this function when the player is shown.
    if (!this.headRun || this.isRunDue || (this.views && !this.views.isPlayer)) return;
    // The panel is updated at most once per animation frame.
    this.isRunDue = true;
    requestAnimationFrame(() => {
      this.isRunDue = false;
      const now = this.headRun;
      if (now) this.runPanel.show([...this.runs.values()].filter((one) => !one.info.is_replaced), now, this.tracks[0] && this.tracks[0].key, this.tracks[1] && this.tracks[1].key);
    });
  }

  showEmpty() {
    const text = this.problem || (this.tracks.length ? "" : this.isOpening !== null
      ? `Loading episode ${this.isOpening}.` : this.connectionState === "lost" ? "The server does not answer. This page retries automatically." : this.whatIsAwaited());
    const run = this.headRun, remarks = run && run.info.remarks || [];
    if (!this.tracks.length) this.noteScene(this.problem || (this.isOpening !== null ? Evalbus.LOADING : remarks.join(" ")));
    Evalbus.setText(this.parts.empty, text);
    this.parts.empty.hidden = text === "";
    this.parts.episodeBody.hidden = this.tracks.length === 0;
  }

  whatIsAwaited() {
    if (!this.wanted || this.runs.size === 0) return "No episode has begun yet.";
    const run = this.runs.get(this.wanted.run);
    if (!run) return `This page has no run ${this.wanted.run}.`;
    if (run.info.is_gone) return `The folder of ${Evalbus.runName(run.info)} no longer exists.`;
    return run.info.is_over ? `${Evalbus.runName(run.info)} has no episode ${this.wanted.episode}.` : `Episode ${this.wanted.episode} has not begun yet.`;
  }

  // Reports that an episode could not be loaded.
  complainOf(run, episode, error) {
    const isKnown = this.runs.has(run) || this.runs.size === 0;
    this.complain(new Error(isKnown ? `episode ${episode} cannot be shown: ${error.message}` : `This page has no run ${run}.`));
  }

  complain(error) {
    this.problem = Evalbus.words(error.message);
    this.showEmpty();
  }

  showTracks() {
    if (!this.tracks.length) return;
    this.areNumbersOld = false;
    this.parts.lanes.hidden = false;
    this.showConditions();
    this.curves.prepare(this.tracks, this.palette);
    this.showTimeline();
    this.curves.redraw();
    const labels = this.tracks.map((track, k) => {
      const run = this.runs.get(track.run);
      const name = this.tracks.length > 1 && this.runs.size > 1 && run ? `${Evalbus.runName(run.info)} · ` : "";
      const letter = this.tracks.length > 1 ? Evalbus.element("b", { class: k === 0 ? null : "ev-b" }, k === 0 ? "A" : "B") : null;
      const ghost = k > 0 && !this.isBeside ? " · ghost" : "";
      // The label of B is short where both have the same seed.
      const isSameSeed = k > 0 && Number.isFinite(track.head.seed) && track.head.seed === this.tracks[0].head.seed;
      const title = isSameSeed ? `episode ${track.episode} · same seed` : track.title();
      return Evalbus.element("span", { class: "ev-label-chip" }, letter, `${name}${title}${ghost}`);
    });
    this.parts.labels.replaceChildren(...labels);
    this.parts.view.classList.toggle("ev-beside", this.isBeside && this.tracks.length > 1);
    this.showEmpty();
    this.moved();
    this.showTransport();
    this.showRun();
  }

  showTimeline() {
    this.timeline.show(this.tracks, this.palette, { curves: this.curves, pins: this.curves.pins, parting: this.parting });
  }

  // Finds where A and B diverge, if they have the same seed.
  async findParting() {
    this.parting = null;
    const [track, other] = this.tracks;
    const key = this.partingKey = this.tracks.map((one) => `${one.key} ${one.ticks}`).join();
    if (!other || track.head.seed !== other.head.seed || !track.head.scene || track.head.scene !== other.head.scene) return;
    const scene = (await this.source.block(track.head.scene)).head;
    if (key !== this.partingKey) return;
    const found = Evalbus.partingOf(track, other, Evalbus.comparedPoints(scene), Evalbus.PARTING_M);
    if (!found) return;
    const limit_cm = 100 * Evalbus.PARTING_M;
    this.parting = { ...found, text: `A and B diverge at ${(found.tick * track.tickSeconds).toFixed(2)} s: the positions of `
      + `${Evalbus.spaced(found.name)} differ by more than ${limit_cm} cm` };
    this.showTimeline();
  }

  showConditions() {
    const run = this.tracks.length && this.runs.get(this.tracks[0].run);
    if (run) this.conditions.show(this.tracks, run.info.is_live !== false);
  }

  // Updates the parts that depend on the current time.
  moved() {
    if (!this.tracks.length) return;
    const ticks = this.ticksShown();
    this.timeline.move(this.player.tick);
    this.conditions.move(ticks);
    this.curves.move(ticks);
    const track = this.tracks[0];
    this.images.show(track, ticks[0]);
    Evalbus.setText(this.parts.clockTime, `${(this.player.shown * track.tickSeconds).toFixed(2)} s`);
    Evalbus.setText(this.parts.clockTick, `tick ${this.player.shown} of ${this.player.last}`);
    if (this.scene && this.isSceneReady) {
      this.scene.update(ticks, this.tracks.map((one, k) => this.litObject(one, ticks[k])));
    }
  }

  showTransport() {
    this.wake();
    const p = this.parts, player = this.player;
    const isPlaying = this.isPlaying();
    if (p.play.dataset.playing !== String(isPlaying)) {
      p.play.dataset.playing = String(isPlaying);
      p.play.replaceChildren(Evalbus.icon(Evalbus.ICONS[isPlaying ? "pause" : "play"], true));
      p.play.setAttribute("aria-label", isPlaying ? "pause" : "play");
      p.play.title = `${isPlaying ? "pause" : "play"} (space)`;
    }
    p.follow.setAttribute("aria-pressed", String(player.isFollowing));
    p.rateChoice.value = String(player.rate);
    const isCompared = this.tracks.length > 1;
    p.mode.hidden = p.uncompare.hidden = !isCompared;
    Evalbus.setText(p.mode, this.isBeside ? "Show as ghost" : "Side by side");
    const twin = isCompared ? null : this.twin();
    p.sameSeed.hidden = !twin;
    if (twin) Evalbus.setText(p.sameSeed, `Same seed in ${twin.name}`);
  }

  // Requests an animation frame. Must be called after every change that frame() handles, because a page at rest requests no
  // frames.
  wake() {
    this.isWoken = true;
    if (this.isAwake) return;
    this.isAwake = true;
    const now = performance.now();
    // Playback does not continue during a rest, but the end of an episode remains on the screen.
    if (this.player.tick >= this.player.last) this.player.rested_s += (now - this.last) / 1000;
    this.last = now;
    requestAnimationFrame((next) => this.frame(next));
  }

  // Returns whether the next animation frame shows something new even if nothing calls wake().
  isBusy() {
    const { player } = this;
    if (this.hasDrawn || this.areNumbersOld) return true;
    if (!player.isFollowing) return player.isPlaying;
    const run = this.runs.get(this.shownRun), next = run && run.track;
    return player.tick < player.last || Boolean(next && next !== this.tracks[0] && next.ticks > 0);
  }

  frame(now) {
    this.isWoken = false;
    try {
      this.advance(now);
    } finally {
      // An exception must not end the animation.
      this.isAwake = this.isWoken || this.isBusy();
      if (this.isAwake) requestAnimationFrame((next) => this.frame(next));
    }
  }

  advance(now) {
    const elapsed_s = Math.max(0, now - this.last) / 1000;
    if (this.hasDrawn && this.scene) this.scene.adapt(now - this.last);
    this.last = now;
    const hasMoved = this.player.advance(elapsed_s);
    // Live numbers are updated at most ten times per second.
    if (this.areNumbersOld && now - (this.shownAt || 0) > 100) {
      this.shownAt = now;
      this.showTracks();
    } else if (hasMoved) {
      this.moved();
    }
    if (this.parts.play.dataset.playing !== String(this.isPlaying())) this.showTransport();
    if (this.player.isFollowing) this.followNewest();
    this.hasDrawn = Boolean(this.scene && this.isSeen && this.scene.draw());
  }

  // ---- user actions

  seek(tick) {
    this.player.pause();
    this.player.seek(tick);
    this.moved();
    this.showTransport();
    this.writeHash();
  }

  step(ticks) {
    this.player.step(ticks);
    this.moved();
    this.showTransport();
    this.writeHash();
  }

  // Returns whether playback continues. Following ends when the run has finished and the end of its last episode has been
  // shown.
  isPlaying() {
    const run = this.tracks.length && this.runs.get(this.tracks[0].run);
    const isDone = run && run.info.is_over && this.tracks[0].head.is_over && this.player.tick >= this.player.last;
    return this.player.isPlaying && !(this.player.isFollowing && isDone);
  }

  togglePlay() {
    if (this.isPlaying()) {
      this.player.pause();
      this.moved();
      this.writeHash();
    } else {
      this.player.isFollowing = false;
      this.player.play();
    }
    this.showTransport();
  }

  changeRate(way) {
    const rates = Evalbus.Player.RATES;
    this.player.isFollowing = false;
    this.player.rate = rates[Math.max(0, Math.min(rates.length - 1, rates.indexOf(this.player.rate) + way))];
    this.showTransport();
  }

  jump(way) {
    const track = this.tracks[0];
    if (!track) return;
    const ticks = track.head.events.map((event) => event.tick).sort((a, b) => a - b);
    const next = way > 0 ? ticks.find((tick) => tick > this.player.shown) : ticks.reverse().find((tick) => tick < this.player.shown);
    if (next !== undefined) this.seek(next);
  }

  openNeighbor(way) {
    const run = this.runs.get(this.shownRun), track = this.tracks[0];
    if (!run || !track) return;
    const rows = this.runPanel.list.rows.filter((row) => row.has_track !== false && this.source.has(row.run, row.episode));
    const at = rows.findIndex((row) => row.episode === track.episode && row.run === track.run);
    const row = at < 0 ? rows[way > 0 ? 0 : rows.length - 1] : rows[at + way];
    if (!row) return;
    this.open(row.run, row.episode).then(() => this.writeHash());
    this.runPanel.list.reveal(row);
  }

  nextCamera() {
    if (!this.scene || !this.isSceneReady) return;
    const names = [null, ...this.scene.cameras];
    this.scene.setCamera(names[(names.indexOf(this.scene.cameraName) + 1) % names.length]);
    this.parts.camera.value = this.scene.cameraName || "";
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const at = event.target;
    if (at instanceof HTMLInputElement && at.type !== "checkbox" || at instanceof HTMLSelectElement || at instanceof HTMLTextAreaElement || this.parts.app.querySelector("dialog[open]")) return;
    if (this.judge.key(event)) return;
    if (this.views && (this.views.key(event) || (!this.views.isPlayer && event.key !== "?"))) return;
    // Space and Enter activate the focused control, so they are not handled here.
    if ((event.key === " " || event.key === "Enter") && at instanceof Element && at.closest("button, summary, input, a")) return;
    const actions = {
      " ": () => this.togglePlay(), ArrowLeft: () => this.step(event.shiftKey ? -10 : -1),
      ArrowRight: () => this.step(event.shiftKey ? 10 : 1), Home: () => this.seek(0), End: () => this.seek(this.player.last),
      "[": () => this.jump(-1), "]": () => this.jump(1), "<": () => this.changeRate(-1), ">": () => this.changeRate(1),
      l: () => this.follow(), p: () => this.openNeighbor(-1), n: () => this.openNeighbor(1), c: () => this.nextCamera(),
      v: () => this.tracks.length > 1 && this.toggleBeside(), x: () => this.uncompare(), "?": () => this.parts.keys.showModal(),
      "+": () => this.timeline.zoom(0.5), "-": () => this.timeline.zoom(2), 0: () => this.timeline.setView(null),
    };
    if (!Object.hasOwn(actions, event.key)) return;
    event.preventDefault();
    actions[event.key]();
  }

  // ---- URL fragment: #view:run=0,episode=3,t=1.24,other=1/3 (ghost) or other=1/3/beside (side by side)

  readHash(hash = location.hash) {
    try {
      hash = decodeURIComponent(hash);
    } catch (error) {
      // A fragment that is not validly percent-encoded is used as it is. The viewer does not write such fragments.
    }
    const match = /^#view:(.*)$/.exec(hash);
    if (!match) return null;
    const values = Object.fromEntries(match[1].split(",").map((pair) => pair.split("=")));
    const run = Number(values.run || 0), episode = Number(values.episode || NaN);
    if (![run, episode].every((one) => Number.isInteger(one) && one >= 0)) return null;
    const other = /^(\d+)\/(\d+)(?:\/(beside))?$/.exec(values.other || "");
    return { run, episode, time: values.t === undefined ? undefined : Number(values.t) || 0,
      other: other && [Number(other[1]), Number(other[2]), Boolean(other[3])] };
  }

  followHash() {
    if (this.views && this.views.followHash()) return;
    const wanted = this.readHash();
    if (!wanted) return;
    this.open(wanted.run, wanted.episode, wanted.time, false).then(async () => {
      if (!wanted.other) return;
      const turn = this.turn;
      await this.compare(wanted.other[0], wanted.other[1], wanted.other[2]);
      // The second episode may be longer than the first.
      if (turn === this.turn && wanted.time !== undefined && this.tracks.length > 1) this.seek(wanted.time / this.tracks[0].tickSeconds);
    });
  }

  writeHash() {
    const [track, other] = this.tracks;
    if (!track) return;
    const time = (this.player.shown * track.tickSeconds).toFixed(3);
    const more = other ? `,other=${other.key}${this.isBeside ? "/beside" : ""}` : "";
    this.fragment.write(`#view:run=${track.run},episode=${track.episode},t=${time}${more}`);
  }

  // ---- access for tests

  get tick() {
    return this.player.shown;
  }

  // Returns the pose of a body in the world frame as it is drawn: {position_m, quat_wxyz}. which: 0 for A, 1 for B.
  pose(name, which = 0) {
    const world = this.scene.views[which].world;
    const index = world.head.bodies.findIndex((body) => body.name === name);
    const matrix = world.placeOf(index, [0, 0, 0], [1, 0, 0, 0], new THREE.Matrix4());
    const position = new THREE.Vector3(), quat = new THREE.Quaternion(), size = new THREE.Vector3();
    matrix.decompose(position, quat, size);
    return { position_m: position.toArray(), quat_wxyz: [quat.w, quat.x, quat.y, quat.z] };
  }

  values() {
    return this.curves.values();
  }

  summary() {
    const run = this.runs.get(this.shownRun);
    return { connection: this.connectionState, info: run && run.info, episodes: run ? run.episodes.length : 0,
      shown: this.tracks.map((track) => track.key), heads: this.tracks.map((track) => track.head), tick: this.tick,
      isPlaying: this.player.isPlaying, isFollowing: this.player.isFollowing, hasImage: Boolean(this.scene && this.isSceneReady),
      problem: this.problem, note: this.parts.note.textContent };
  }
};

for (const place of document.querySelectorAll("[data-from]")) {
  const begin = () => { window.evalbusViewer = new Evalbus.Viewer(place); };
  if (place.dataset.from !== "page") {
    begin();
  } else {
    // In a report, the viewer starts when it comes near the visible part of the page.
    const watch = new IntersectionObserver((entries) => {
      if (entries.some((entry) => entry.isIntersecting)) start();
    }, { rootMargin: "300px" });
    const isAskedFor = () => location.hash.startsWith("#view:");
    const start = () => {
      if (window.evalbusViewer) return;
      watch.disconnect();
      begin();
    };
    watch.observe(place);
    const look = () => {
      if (!isAskedFor()) return;
      start();
      place.scrollIntoView();
    };
    window.addEventListener("hashchange", look);
    look();
  }
}
