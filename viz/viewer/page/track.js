// The data of an episode by tick. It is created from an "episode" block and extended by "ticks" blocks.
"use strict";

// A typed array that grows while the episode is running.
Evalbus.Growing = class {
  constructor(Type) {
    this.data = new Type(256);
  }

  // Ensures capacity for `count` values. Existing values are kept.
  fit(count) {
    if (count <= this.data.length) return;
    const larger = new this.data.constructor(Math.max(count, 2 * this.data.length));
    larger.set(this.data);
    this.data = larger;
  }
};

Evalbus.Track = class {
  constructor(block) {
    this.head = block.head;
    this.ticks = 0;
    const rowsOf = (name) => (block.has(name) ? block.shape(name)[0] : 0);
    const rows = (name, Type) => Array.from({ length: rowsOf(name) }, () => new Evalbus.Growing(Type));
    // Values are ordered by tick, then by body, so that the data of one frame is contiguous in memory.
    this.position = new Evalbus.Growing(Float32Array);
    this.quat = new Evalbus.Growing(Float32Array);
    this.rows = rows("curves", Float32Array);
    this.criteria = rows("criteria", Float32Array);
    this.holds = rows("criteria_hold", Uint8Array);
    this.clearance = new Evalbus.Growing(Float32Array);  // 6 numbers per tick
    this.contactFrom = new Evalbus.Growing(Uint32Array);
    this.contactGeoms = new Evalbus.Growing(Uint16Array);  // 2 numbers per contact
    this.contactPosition = new Evalbus.Growing(Float32Array);
    this.contactNormal = new Evalbus.Growing(Float32Array);
    this.contactDepth = new Evalbus.Growing(Float32Array);
    this.missing = new Set();
    this.images = [];  // for each camera: ascending ticks, and one JPEG per tick
    this.version = 0;
    this.take(block, 0);
  }

  get run() { return this.head.run; }
  get episode() { return this.head.episode; }
  get attempt() { return this.head.attempt; }
  get tickSeconds() { return this.head.tick_s; }
  get last() { return Math.max(0, this.ticks - 1); }
  get key() { return `${this.run}/${this.episode}`; }

  isOf(block) {
    return block.head.run === this.run && block.head.episode === this.episode && block.head.attempt === this.attempt;
  }

  // Appends a "ticks" block. Returns false if ticks before it are missing. In this case, the whole episode must be sent
  // again.
  append(block) {
    if (block.head.from > this.ticks) return false;
    for (const [name, value] of Object.entries(block.head)) {
      if (!["block", "arrays", "from"].includes(name)) this.head[name] = value;
    }
    this.take(block, block.head.from);
    return true;
  }

  take(block, from) {
    const count = block.head.ticks - from;
    const bodies = this.head.bodies.length;
    if (count > 0 && block.has("position_m") && bodies > 0) {
      this.transpose(block.values("position_m"), this.position, from, count, 3 * bodies);
      this.transpose(block.values("quat"), this.quat, from, count, 4 * bodies);
    }
    if (count > 0) {
      this.copyRows(block, "curves", this.rows, from, count);
      this.copyRows(block, "criteria", this.criteria, from, count);
      this.copyRows(block, "criteria_hold", this.holds, from, count);
      if (block.has("clearance_points_m")) {
        this.transpose(block.values("clearance_points_m"), this.clearance, from, count, 6);
      }
      this.takeContacts(block, from, count);
    }
    if (block.has("image_jpeg")) this.takeImages(block);
    if (block.has("missing")) block.raw("missing").forEach((tick) => this.missing.add(tick));
    this.ticks = Math.max(this.ticks, block.head.ticks);
    ++this.version;
  }

  // Adds the images of a block. An image that arrived between two blocks may be contained in both.
  takeImages(block) {
    const cameras = block.raw("image_camera"), ticks = block.raw("image_tick"), from = block.raw("image_from");
    const jpeg = block.raw("image_jpeg");
    cameras.forEach((camera, k) => {
      const images = this.images[camera] = this.images[camera] || { ticks: [], jpegs: [] };
      if (images.ticks.length && images.ticks[images.ticks.length - 1] >= ticks[k]) return;
      images.ticks.push(ticks[k]);
      images.jpegs.push(jpeg.slice(from[k], from[k + 1]));
    });
    // Whenever the images of an episode exceed 64 MB, every second image of each camera is dropped.
    const bytes = () => this.images.flatMap((one) => one.jpegs).reduce((sum, one) => sum + one.length, 0);
    while (bytes() > 64e6 && this.images.some((one) => one.ticks.length > 2)) {
      // A camera without images has no element.
      for (const images of this.images.filter(Boolean)) {
        images.ticks = images.ticks.filter((_, k) => k % 2 === 0);
        images.jpegs = images.jpegs.filter((_, k) => k % 2 === 0);
      }
    }
  }

  // Returns the latest image of a camera at this tick, or null if there is none yet.
  imageAt(camera, tick) {
    const images = this.images[camera];
    if (!images) return null;
    let low = 0, high = images.ticks.length;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (images.ticks[middle] <= tick) low = middle + 1;
      else high = middle;
    }
    return low > 0 ? images.jpegs[low - 1] : null;
  }

  transpose(values, growing, from, count, width) {
    growing.fit((from + count) * width);
    for (let row = 0; row < width; ++row) {
      for (let i = 0; i < count; ++i) growing.data[(from + i) * width + row] = values[row * count + i];
    }
  }

  copyRows(block, name, rows, from, count) {
    if (!block.has(name)) return;
    const values = block.raw(name);
    rows.forEach((row, k) => {
      row.fit(from + count);
      row.data.set(values.subarray(k * count, (k + 1) * count), from);
    });
  }

  takeContacts(block, from, count) {
    this.contactFrom.fit(from + count + 1);
    const base = from > 0 ? this.contactFrom.data[from] : 0;
    if (!block.has("contact_from")) {
      this.contactFrom.data.fill(base, from, from + count + 1);
      return;
    }
    const starts = block.raw("contact_from");
    for (let i = 0; i <= count; ++i) this.contactFrom.data[from + i] = base + starts[i];
    const contacts = starts[count];
    this.transpose(block.raw("contact_geoms"), this.contactGeoms, base, contacts, 2);
    this.transpose(block.values("contact_position_m"), this.contactPosition, base, contacts, 3);
    this.transpose(block.values("contact_normal"), this.contactNormal, base, contacts, 3);
    this.transpose(block.values("contact_depth_m"), this.contactDepth, base, contacts, 1);
  }

  // Interpolates the pose of a body between two ticks. slot: index in `bodies`.
  poseAt(slot, tick, position, quaternion) {
    const bodies = this.head.bodies.length;
    const before = Math.max(0, Math.min(Math.floor(tick), this.last)), after = Math.min(before + 1, this.last);
    const part = Math.max(0, Math.min(1, tick - before));
    let a = 3 * (before * bodies + slot), b = 3 * (after * bodies + slot);
    const p = this.position.data;
    position.set(p[a] + part * (p[b] - p[a]), p[a + 1] + part * (p[b + 1] - p[a + 1]),
      p[a + 2] + part * (p[b + 2] - p[a + 2]));
    a = 4 * (before * bodies + slot);
    b = 4 * (after * bodies + slot);
    const q = this.quat.data;
    const sign = q[a] * q[b] + q[a + 1] * q[b + 1] + q[a + 2] * q[b + 2] + q[a + 3] * q[b + 3] < 0 ? -1 : 1;
    const mix = (k) => q[a + k] + part * (sign * q[b + k] - q[a + k]);
    quaternion.set(mix(1), mix(2), mix(3), mix(0)).normalize();
  }

  hasPoses() {
    return this.ticks > 0 && this.head.bodies.length > 0 && this.position.data.length >= 3 * this.head.bodies.length;
  }

  valueAt(row, tick) {
    const growing = this.rows[row];
    return growing && tick >= 0 && tick < this.ticks ? growing.data[tick] : NaN;
  }

  // Returns the latest value that is not NaN, for curves that do not have a value at each tick.
  lastValueAt(row, tick) {
    const growing = this.rows[row];
    for (let k = Math.min(tick, this.last); growing && k >= 0; --k) {
      if (!Number.isNaN(growing.data[k])) return growing.data[k];
    }
    return NaN;
  }

  curve(name) {
    return this.head.curves.find((curve) => curve.name === name);
  }

  // Returns "success", "failure", "incomplete", "unjudged" or, while the episode is running or not scored yet, "running".
  outcome() {
    if (!this.head.is_over) return "running";
    if (this.head.complete === false) return "incomplete";
    if (this.head.failure_reason === "not_judged") return "unjudged";
    if (this.head.success === null || this.head.success === undefined) return "running";
    return this.head.success ? "success" : "failure";
  }

  title() {
    const seed = this.head.seed === null || this.head.seed === undefined ? "" : ` · seed ${this.head.seed}`;
    return `episode ${this.episode}${seed}`;
  }
};
