// Compares episodes, and the values of a metric over time. All functions are pure.
"use strict";

// Two episodes with the same seed count as diverged if a compared point differs by more than this distance (m).
Evalbus.PARTING_M = 0.02;

// Returns the points that are compared: origins of the bodies of manipulated objects, and wrists. scene: head of a "scene"
// block. The result is [{name, body, position_m}] with positions in the body's frame.
Evalbus.comparedPoints = (scene) => {
  const isObject = (body) => scene.entities[body.entity] && scene.entities[body.entity].kind === "object";
  const objects = scene.bodies.map((body, index) => ({ body, index })).filter(({ body }) => body.moves && isObject(body))
    .map(({ body, index }) => ({ name: body.name, body: index, position_m: [0, 0, 0] }));
  const wrists = (scene.wrists || []).map(({ arm, body, position_m }) => ({ name: `${arm} wrist`, body, position_m }));
  return [...objects, ...wrists];
};

// Returns the position of a point in the world frame at a tick. slot: index of its body in the track's poses.
Evalbus.pointAt = (track, slot, position_m, tick) => {
  const bodies = track.head.bodies.length;
  const p = 3 * (tick * bodies + slot), q = 4 * (tick * bodies + slot);
  const [w, x, y, z] = track.quat.data.subarray(q, q + 4);
  const [a, b, c] = position_m;
  // The rotated vector is v + 2 w (u x v) + 2 u x (u x v), where u = (x, y, z).
  const s = [y * c - z * b, z * a - x * c, x * b - y * a];
  const t = [y * s[2] - z * s[1], z * s[0] - x * s[2], x * s[1] - y * s[0]];
  return position_m.map((one, k) => track.position.data[p + k] + one + 2 * (w * s[k] + t[k]));
};

// Finds where two episodes diverge: the first tick of A at which a point is farther than limit_m from its position in B at
// the same time. Returns {tick, name, distance_m} for the point with the largest distance at this tick, or null if the
// episodes do not diverge in the time that they have in common.
Evalbus.partingOf = (track, other, points, limit_m) => {
  const slots = points.map((point) => ({ ...point, a: track.head.bodies.indexOf(point.body), b: other.head.bodies.indexOf(point.body) }))
    .filter(({ a, b }) => a >= 0 && b >= 0);
  if (!slots.length || !track.hasPoses() || !other.hasPoses()) return null;
  for (let tick = 0; tick < track.ticks; ++tick) {
    const otherTick = Math.round(tick * track.tickSeconds / other.tickSeconds);
    if (otherTick >= other.ticks) return null;
    let farthest = null;
    for (const { name, a, b, position_m } of slots) {
      const p = Evalbus.pointAt(track, a, position_m, tick), q = Evalbus.pointAt(other, b, position_m, otherTick);
      const distance_m = Math.hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]);
      if (distance_m > limit_m && (!farthest || distance_m > farthest.distance_m)) farthest = { tick, name, distance_m };
    }
    if (farthest) return farthest;
  }
  return null;
};

// Returns how much a metric changes, from 0 to 1. Without `other`, this is its range relative to its largest absolute value.
// With `other`, it is the mean absolute difference between the episodes at equal times, relative to the range of both, for
// the part with the largest mean difference. rows, other: one array of values per part. NaN stands for no value. ratio: ticks of
// `other` per tick of `rows`.
Evalbus.changeOf = (rows, other, ratio = 1) => {
  let low = Infinity, high = -Infinity;
  for (const values of [...rows, ...(other || [])]) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (!(high - low > 1e-9 * Math.max(Math.abs(low), Math.abs(high)))) return 0;
  if (!other) return Math.min(1, (high - low) / Math.max(Math.abs(low), Math.abs(high)));
  let most = 0;
  rows.forEach((values, k) => {
    const others = other[k];
    if (!others) return;
    let sum = 0, count = 0;
    for (let i = 0; i < values.length; ++i) {
      const k = Math.round(i * ratio);
      if (k >= others.length) break;
      if (Number.isNaN(values[i]) || Number.isNaN(others[k])) continue;
      sum += Math.abs(values[i] - others[k]);
      ++count;
    }
    if (count) most = Math.max(most, sum / count / (high - low));
  });
  return most;
};

// Returns the values with each NaN replaced by the last value before it, for metrics without a value at each tick.
Evalbus.held = (values) => {
  let last = NaN;
  return Array.from(values, (value) => (last = Number.isNaN(value) ? last : value));
};

// Returns the name of a run on the page. The policy is added unless the name contains it.
Evalbus.runName = (info) => {
  const name = Evalbus.words(info.name) || `run ${info.run}`, policy = Evalbus.words(info.policy);
  return !policy || name.toLowerCase().includes(policy.toLowerCase()) ? name : `${name} (${policy})`;
};
