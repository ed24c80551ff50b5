// Small 3D images of episodes: the seconds around an episode's decisive moment, and the scene at the time under the pointer.
// A single renderer draws all images, one at a time.
"use strict";

// Returns the decisive moment of an episode (s): the time of its cause, otherwise its end; null if neither is known.
Evalbus.momentOf = (row) => (Number.isFinite(row.cause_time_s) ? row.cause_time_s : row.time_s);

// Returns the time at which links open an episode: one second before its decisive moment.
Evalbus.startOf = (row) => Math.max(0, (Evalbus.momentOf(row) || 0) - 1);

Evalbus.Thumbnails = class {
  // load(run, episode): resolves to a Track. palette(): returns the current colors.
  constructor(source, load, palette) {
    this.source = source;
    this.load = load;
    this.palette = palette;
    this.place = Evalbus.element("div", { class: "ev-thumbnail", "aria-hidden": "true" });
    // While nothing is played, the place is in this element outside the window, because the renderer needs its size.
    this.home = Evalbus.element("div", { class: "ev-thumbnail-home" }, this.place);
    this.tracks = [];  // tracks in the scene
    this.isPlaying = false;
    this.onIdle = () => {};
    this.wake = () => {};  // requests an animation frame for the shown image
    this.queue = Promise.resolve();
  }

  // Creates the renderer if necessary. Returns whether this browser can draw the images.
  begin() {
    if (this.scene || this.isUnable) return Boolean(this.scene);
    try {
      this.scene = new Evalbus.SceneView(this.place, new Evalbus.Assets(this.source), this.palette());
      Object.assign(this.scene.layers, { trails: false, shadows: false, highlight: false, contacts: false });
      this.scene.ratio = 1;
      // The controls of three.js make the canvas a stop of the Tab key, which is not wanted here.
      this.scene.canvas.tabIndex = -1;
    } catch (error) {
      this.isUnable = true;
    }
    return Boolean(this.scene);
  }

  // Shows a row's decisive seconds in `parent`, in a loop, until another call or stop().
  play(row, parent) {
    const from = Evalbus.startOf(row), span = 2;
    const isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    return this.present(parent, () => this.prepare(row), (elapsed_s) => from + (isCalm ? 1 : Math.min(span, elapsed_s % (span + 0.4))), !isCalm);
  }

  // Shows these tracks at the time timeAt() (s), with the camera of the scene `view`, until another call or stop(). wake() must
  // be called when timeAt() has changed.
  follow(view, tracks, isBeside, parent, timeAt) {
    return this.present(parent, async () => {
      if (!await this.showTracks(tracks, isBeside)) return false;
      this.scene.lookLike(view);
      return true;
    }, timeAt, false);
  }

  // prepare(): resolves to whether the scene can be shown. timeAt(elapsed_s): returns the time (s) to show. isMoving: whether
  // this time changes by itself.
  async present(parent, prepare, timeAt, isMoving) {
    const turn = this.turn = (this.turn || 0) + 1;
    this.wake = () => {};
    if (!this.begin()) return;
    this.isPlaying = true;
    parent.append(this.place);
    this.place.classList.remove("ev-ready");
    const isShown = await this.enqueue(() => (turn === this.turn ? prepare() : false));
    if (!isShown || turn !== this.turn) return;
    const begin = performance.now();
    let drawn_s = null, isRequested = false;
    const request = () => {
      if (isRequested || turn !== this.turn) return;
      isRequested = true;
      requestAnimationFrame(frame);
    };
    const frame = (now) => {
      isRequested = false;
      if (turn !== this.turn) return;
      const time_s = timeAt(Math.max(0, now - begin) / 1000);
      if (time_s !== drawn_s) this.draw(time_s);
      drawn_s = time_s;
      this.place.classList.add("ev-ready");
      if (isMoving) request();
    };
    this.wake = request;
    request();
  }

  stop() {
    this.turn = (this.turn || 0) + 1;
    if (!this.isPlaying) return;
    this.isPlaying = false;
    this.place.classList.remove("ev-ready");
    this.home.append(this.place);
    this.onIdle();
  }

  // Draws the decisive moment of a row into a canvas with the aspect ratio of the images. Resolves to false if there is no
  // image, and to null if an image is played or the canvas is no longer on the page.
  still(row, canvas) {
    if (!this.begin()) return Promise.resolve(false);
    return this.enqueue(async () => {
      if (this.isPlaying || !canvas.isConnected) return null;
      if (!await this.prepare(row)) return false;
      if (this.isPlaying) return null;
      this.draw(Evalbus.momentOf(row) || 0);
      canvas.getContext("2d").drawImage(this.scene.canvas, 0, 0, canvas.width, canvas.height);
      return true;
    });
  }

  // Runs jobs one after another, because they share the scene. A failed job resolves to false.
  enqueue(job) {
    const done = this.queue.then(job).catch(() => false);
    this.queue = done;
    return done;
  }

  async prepare(row) {
    const track = await this.load(row.run, row.episode);
    if (!track.head.scene || !await this.showTracks([track], false)) return false;
    this.scene.home();
    return true;
  }

  async showTracks(tracks, isBeside) {
    // Tracks that are in the scene are kept, because creating their bodies takes longer than drawing them.
    const isInScene = tracks.length === this.tracks.length && tracks.every((track, k) => track === this.tracks[k])
      && isBeside === this.isBeside;
    if (isInScene) return true;
    this.tracks = [];
    if (!await this.scene.show(tracks, isBeside)) return false;
    this.tracks = tracks.slice();
    this.isBeside = isBeside;
    this.place.classList.toggle("ev-pair", isBeside);
    this.scene.resize();
    return true;
  }

  draw(time_s) {
    this.scene.update(this.tracks.map((track) => Math.min(time_s / track.tickSeconds, track.last)), this.tracks.map(() => -1));
    this.scene.draw();
  }

  // Frees the graphics memory. The next image allocates it again.
  release() {
    this.stop();
    if (this.scene) this.scene.dispose();
    this.scene = null;
    this.tracks = [];
  }
};
