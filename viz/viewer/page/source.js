// Sources of blocks: a server (LiveSource) or the page itself (PackedSource). Both call {run, episodes, connection} of
// `listener`; LiveSource also calls {log, track, ticks, board, notes, judge}. Scenes and finished episodes are loaded on demand.
"use strict";

// Cache of asynchronously created values by key. Failures are not cached.
Evalbus.Once = class {
  constructor(make) {
    this.make = make;
    this.made = new Map();
  }

  get(key) {
    if (!this.made.has(key)) {
      const promise = this.make(key);
      promise.catch(() => this.made.delete(key));
      this.made.set(key, promise);
    }
    return this.made.get(key);
  }
};

Evalbus.NOT_SENT = "There is no connection to the server. Save again when the connection is back.";

Evalbus.LiveSource = class {
  constructor(listener) {
    this.listener = listener;
    this.tracks = new Map();  // tracks of the episodes in progress, by run
    this.pause_ms = 500;
    this.blocks = new Evalbus.Once((id) => this.fetchBlock(`block/${encodeURIComponent(id)}`));
    // URLs are relative, because the path of the page may contain the access token.
    this.address = (path) => new URL(path, location.href);
  }

  start() {
    this.connect();
  }

  connect() {
    const address = this.address("live");
    address.protocol = address.protocol === "https:" ? "wss:" : "ws:";
    const socket = new WebSocket(address);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("open", () => {
      this.pause_ms = 500;
      this.tracks.clear();
      this.listener.connection("open");
    });
    socket.addEventListener("message", (event) => this.hear(event.data));
    socket.addEventListener("close", () => {
      this.socket = null;
      this.listener.connection("lost");
      setTimeout(() => this.connect(), this.pause_ms);
      this.pause_ms = Math.min(5000, 1.6 * this.pause_ms);
    });
    this.socket = socket;
  }

  hear(data) {
    const block = new Evalbus.Block(data);
    const run = block.head.run;
    if (block.kind === "run") this.listener.run(block.head);
    if (block.kind === "episodes") this.listener.episodes(block.head);
    if (block.kind === "log") this.listener.log(block.head);
    if (block.kind === "board") this.listener.board(block.head);
    if (block.kind === "notes") this.listener.notes(block.head);
    if (block.kind === "judge") this.listener.judge(block.head);
    if (block.kind === "episode") {
      const track = new Evalbus.Track(block);
      this.tracks.set(run, track);
      this.listener.track(track);
    }
    if (block.kind === "ticks") {
      const track = this.tracks.get(run);
      // If append() fails because ticks are missing, the server sends the whole episode again.
      if (track && track.isOf(block) && track.append(block)) this.listener.ticks(track);
    }
  }

  watch(run) {
    this.send({ watch: run });
  }

  // Sends a message. Returns false if there is no connection; callers then show Evalbus.NOT_SENT.
  send(message) {
    if (!this.socket || this.socket.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  async fetchBlock(path) {
    let answer;
    try {
      answer = await fetch(this.address(path));
    } catch (error) {
      throw new Error("the server does not answer");
    }
    if (!answer.ok) throw new Error(Evalbus.words((await answer.text()).slice(0, 200)) || `error ${answer.status}`);
    return new Evalbus.Block(await answer.arrayBuffer());
  }

  block(id) {
    return this.blocks.get(id);
  }

  async episode(run, episode) {
    return new Evalbus.Track(await this.fetchBlock(`episode/${run}/${episode}`));
  }

  // Returns whether the source can provide an episode.
  has() {
    return true;
  }
};

Evalbus.PackedSource = class {
  constructor(listener) {
    this.listener = listener;
    this.places = new Map();
    for (const script of document.querySelectorAll("script[type='application/x-evalbus']")) {
      this.places.set(script.dataset.block, script);
    }
    this.blocks = new Evalbus.Once((id) => this.unpack(id));
  }

  async start() {
    if (typeof DecompressionStream === "undefined") {
      this.listener.connection("unsupported");
      return;
    }
    for (const kind of ["run", "episodes"]) {
      for (const id of this.places.keys()) {
        if (id.startsWith(`${kind}/`)) this.listener[kind]((await this.unpack(id)).head);
      }
    }
    this.listener.connection("packed");
  }

  async unpack(id) {
    const place = this.places.get(id);
    if (!place) throw new Error("this page does not contain this episode");
    const text = atob(place.textContent.trim());
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Evalbus.Block(await new Response(stream).arrayBuffer());
  }

  watch() {}

  block(id) {
    return this.blocks.get(id);
  }

  async episode(run, episode) {
    return new Evalbus.Track(await this.unpack(`episode/${run}/${episode}`));
  }

  has(run, episode) {
    return this.places.has(`episode/${run}/${episode}`);
  }
};
