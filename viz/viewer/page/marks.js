// Marks in the 3D scene: contacts, wrist trajectories, and the line of minimum clearance to geoms that the robot must not
// touch.
"use strict";

Evalbus.Marks = class {
  constructor(world, palette) {
    this.world = world;
    this.track = world.track;
    this.group = new THREE.Group();
    this.shows = { contacts: true, trails: true, clearance: false };
    this.made = [];
    this.instanced = [];
    const keep = (one) => {
      this.made.push(one);
      return one;
    };

    // There is one pin per contact, up to a limit for each kind. Its head is at the contact point. Its shaft is along the
    // normal, and is longer for deeper contacts.
    const limit = Evalbus.Marks.MOST_CONTACTS;
    const colors = { wanted: palette.o2, collision: palette.bad, other: palette.none };
    this.pins = {};
    for (const [kind, color] of Object.entries(colors)) {
      const material = keep(new THREE.MeshBasicMaterial({ color: color, depthTest: false, transparent: true,
        opacity: 0.9 }));
      const make = (geometry) => {
        const mesh = new THREE.InstancedMesh(keep(geometry), material, limit);
        this.instanced.push(mesh);
        mesh.count = 0;
        mesh.frustumCulled = false;
        mesh.renderOrder = 10;
        this.group.add(mesh);
        return mesh;
      };
      this.pins[kind] = {
        head: make(new THREE.SphereBufferGeometry(0.0055, 12, 8)),
        shaft: make(new THREE.CylinderBufferGeometry(0.0018, 0.0018, 1, 6).translate(0, 0.5, 0)),
      };
    }
    this.kindOfGeom = new Map();
    for (const geom of world.head.geoms) {
      if (geom.collision) this.kindOfGeom.set(geom.geom, world.kindOf(geom.body));
    }

    this.trails = (this.track.head.arms || []).map((arm, k) => {
      const geometry = keep(new THREE.BufferGeometry());
      const line = new THREE.Line(geometry, keep(new THREE.LineBasicMaterial({
        color: palette[Evalbus.roleOf(arm, k, world.track.head)], transparent: true, opacity: 0.9 })));
      line.frustumCulled = false;
      this.group.add(line);
      return { line, points: new Evalbus.Growing(Float32Array), filled: 0, place: this.wristOf(arm, k) };
    });

    const ends = keep(new THREE.BufferGeometry());
    ends.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6), 3));
    this.clearance = new THREE.Line(ends, keep(new THREE.LineBasicMaterial({ color: palette.warn, depthTest: false,
      transparent: true })));
    this.clearance.frustumCulled = false;
    this.clearance.renderOrder = 11;
    this.clearance.visible = false;
    this.group.add(this.clearance);
    this.matrix = new THREE.Matrix4();
    this.point = new THREE.Vector3();
    this.along = new THREE.Vector3();
    this.turn = new THREE.Quaternion();
    this.size = new THREE.Vector3();
  }

  // Returns {slot, offset}: the index of the wrist's body in `bodies`, and the wrist's position in the frame of this body.
  wristOf(arm, k) {
    const wrist = (this.world.head.wrists || []).find((one) => one.arm === arm);
    const body = wrist ? wrist.body : (this.track.head.wrist_body || [])[k];
    const slot = this.track.head.bodies.indexOf(body);
    return slot < 0 ? null : { slot, offset: new THREE.Vector3(...(wrist ? wrist.position_m : [0, 0, 0])) };
  }

  // Uses the data of another track, which must have the same bodies and arms.
  follow(track) {
    this.track = track;
    for (const trail of this.trails) trail.filled = 0;
  }

  // Returns the kind of a contact between two geoms: "wanted" (robot and manipulated object), "collision" (all others of the
  // robot), or "other".
  kindOf(a, b) {
    const kinds = [this.kindOfGeom.get(a), this.kindOfGeom.get(b)];
    const robots = kinds.filter((kind) => kind === "robot").length;
    if (robots === 1 && kinds.includes("object")) return "wanted";
    return robots > 0 ? "collision" : "other";
  }

  update(tick) {
    const shown = Math.max(0, Math.min(Math.floor(tick + 1e-6), this.track.last));
    if (!this.track.hasPoses()) return;
    this.updateContacts(shown);
    this.updateTrails(tick, shown);
    this.updateClearance(shown);
  }

  updateContacts(tick) {
    const track = this.track, counts = { wanted: 0, collision: 0, other: 0 };
    const up = Evalbus.Marks.UP;
    const begin = track.contactFrom.data[tick], end = this.shows.contacts ? track.contactFrom.data[tick + 1] : begin;
    for (let c = begin; c < end; ++c) {
      const kind = this.kindOf(track.contactGeoms.data[2 * c], track.contactGeoms.data[2 * c + 1]);
      const k = counts[kind];
      if (k >= Evalbus.Marks.MOST_CONTACTS) continue;
      ++counts[kind];
      this.point.fromArray(track.contactPosition.data, 3 * c);
      this.along.fromArray(track.contactNormal.data, 3 * c).normalize();
      this.turn.setFromUnitVectors(up, this.along);
      // The length is 2 cm, plus 1 cm per 0.5 mm of penetration depth, but at most 10 cm.
      const length = 0.02 + Math.min(0.08, 20 * Math.max(0, track.contactDepth.data[c]));
      this.pins[kind].head.setMatrixAt(k, this.matrix.compose(this.point, this.turn, this.size.set(1, 1, 1)));
      this.pins[kind].shaft.setMatrixAt(k, this.matrix.compose(this.point, this.turn, this.size.set(1, length, 1)));
    }
    for (const [kind, { head, shaft }] of Object.entries(this.pins)) {
      for (const mesh of [head, shaft]) {
        mesh.count = counts[kind];
        mesh.visible = counts[kind] > 0;
        mesh.instanceMatrix.needsUpdate = true;
      }
    }
  }

  updateTrails(tick, shown) {
    for (const trail of this.trails) {
      trail.line.visible = this.shows.trails && trail.place !== null;
      if (!trail.line.visible) continue;
      if (trail.filled < this.track.ticks || trail.version !== this.track.version) {
        trail.version = this.track.version;
        // The last point is computed again, because its tick may have been missing when it was computed.
        const from = Math.max(0, trail.filled - 1);
        const before = trail.points.data;
        trail.points.fit(3 * this.track.ticks);
        for (let k = from; k < this.track.ticks; ++k) {
          this.track.poseAt(trail.place.slot, k, this.point, this.turn);
          this.along.copy(trail.place.offset).applyQuaternion(this.turn).add(this.point);
          this.along.toArray(trail.points.data, 3 * k);
        }
        trail.filled = this.track.ticks;
        if (trail.points.data !== before || !trail.line.geometry.attributes.position) {
          // Frees the buffer of the shorter array.
          trail.line.geometry.dispose();
          trail.line.geometry.setAttribute("position", new THREE.BufferAttribute(trail.points.data, 3));
        }
        trail.line.geometry.attributes.position.needsUpdate = true;
      }
      trail.line.geometry.setDrawRange(0, shown + 1);
    }
  }

  updateClearance(tick) {
    const points = this.track.clearance.data, at = 6 * tick;
    // Logs that were recorded before these points were part of the messages contain zeros.
    const isKnown = at + 6 <= points.length && !Number.isNaN(points[at])
      && points.subarray(at, at + 6).some((one) => one !== 0);
    this.clearance.visible = this.shows.clearance && isKnown && this.track.clearance.data.length > 0;
    if (!this.clearance.visible) return;
    const ends = this.clearance.geometry.attributes.position;
    ends.array.set(points.subarray(at, at + 6));
    ends.needsUpdate = true;
  }

  // Returns the midpoint of the clearance line, or null if no line is shown.
  clearanceMiddle() {
    if (!this.clearance.visible) return null;
    const p = this.clearance.geometry.attributes.position.array;
    return this.point.set((p[0] + p[3]) / 2, (p[1] + p[4]) / 2, (p[2] + p[5]) / 2);
  }

  dispose() {
    for (const mesh of this.instanced) {
      if (mesh.dispose) mesh.dispose();
      // In older versions of three.js, InstancedMesh has no dispose(). A geometry frees the buffers of all its attributes.
      else mesh.geometry.setAttribute("instanceMatrix", mesh.instanceMatrix);
    }
    for (const one of this.made) one.dispose();
  }
};

Evalbus.Marks.MOST_CONTACTS = 256;
Evalbus.Marks.UP = typeof THREE === "undefined" ? null : new THREE.Vector3(0, 1, 0);
