// Checks the pure functions of the page (viz/viewer/page) and evaluates to a list of complaints. check_viewer.py runs it in the
// page. Expected values were computed by hand.
(() => {
  const wrong = [];
  const expect = (what, got, expected) => {
    const [a, b] = [got, expected].map((one) => JSON.stringify(one));
    if (a !== b) wrong.push(`${what}: ${a}, not ${b}`);
  };

  // Stages 1 and 3 are reached at the same tick, and stage 2 never.
  const stages = [{ name: "a", index: 1, tick: 10 }, { name: "b", index: 2, tick: null }, { name: "c", index: 3, tick: 10 }];
  expect("stage flags and bands", Evalbus.stageBands(stages, 50), {
    flags: [{ tick: 10, number: 1, name: "a" }, { tick: 10, number: 3, name: "c" }],
    bands: [{ from: 0, to: 10, name: "a", isReached: true }, { from: 10, to: 50, name: "b", isReached: false }],
  });
  expect("a stage at the start, all reached", Evalbus.stageBands([{ name: "a", index: 1, tick: 0 }], 50),
    { flags: [{ tick: 0, number: 1, name: "a" }], bands: [] });

  expect("axis", Evalbus.axisTexts([5, 5.2, 5.4]), ["5.0", "5.2", "5.4"]);
  expect("axis from zero", Evalbus.axisTexts([0, 0.5]), ["0", "0.5"]);
  expect("axis around zero", Evalbus.axisTexts([-20, 0, 20]), ["−20", "0", "20"]);
  expect("axis with a rounding error", Evalbus.axisTexts([0.25, 0.1 + 0.2]), ["0.25", "0.30"]);

  expect("texts of events", [{ kind: "slip", text: "blue_cube slips from left" }, { kind: "collision", text: "left_pad touches table" }].map(Evalbus.eventText),
    ["blue cube slips from left", "left_pad touches table"]);

  const outcomeOf = (head) => Evalbus.Track.prototype.outcome.call({ head });
  expect("outcome without a score", outcomeOf({ is_over: true, complete: null, success: null, failure_reason: null }), "running");
  expect("outcome without a verdict", outcomeOf({ is_over: true, complete: true, success: null, failure_reason: "not_judged" }), "unjudged");
  expect("outcome of a failure", outcomeOf({ is_over: true, complete: true, success: false, failure_reason: "stall" }), "failure");
  expect("result without a verdict", Evalbus.resultOf({ complete: true, success: false, failure_reason: "not_judged" }), "unjudged");

  // A zoom by 2 around 6 of 10 s shows 3 to 8 s. The test also zooms back.
  expect("zoom in", Evalbus.zoomed(null, 10, 6, 0.5, 0.2), { from: 3, to: 8 });
  expect("zoom in at the end", Evalbus.zoomed({ from: 6, to: 10 }, 10, 10, 0.5, 0.2), { from: 8, to: 10 });
  expect("zoom beyond the least span", Evalbus.zoomed({ from: 4, to: 6 }, 10, 5, 0.01, 1), { from: 4.5, to: 5.5 });
  expect("zoom out", Evalbus.zoomed({ from: 3, to: 8 }, 10, 6, 2, 0.2), null);

  // Tracks A and B contain the bodies 3 and 7. In the first B, body 7 moves by 0.01 m per tick along y and is rotated by
  // 180 deg about x, which does not move its point at x = 1 m. Body 3 does not move.
  const head = { bodies: [3, 7], tick_s: 0.02 };
  const track = (step, quat, ticks, tick_s = 0.02) => ({ head: { ...head, tick_s }, tickSeconds: tick_s, ticks, hasPoses: () => true,
    position: { data: Float32Array.from({ length: 6 * ticks }, (_, k) => (k % 6 === 4 ? step * Math.floor(k / 6) : 0)) },
    quat: { data: Float32Array.from({ length: 8 * ticks }, (_, k) => (k % 8 < 4 ? [1, 0, 0, 0][k % 8] : quat[k % 8 - 4])) } });
  const points = [{ name: "still", body: 3, position_m: [0, 0, 0] }, { name: "moving", body: 7, position_m: [1, 0, 0] },
    { name: "elsewhere", body: 9, position_m: [0, 0, 0] }];
  const a = track(0, [1, 0, 0, 0], 20);
  const part = (b, limit_m) => {
    const found = Evalbus.partingOf(a, b, points, limit_m);
    return found && [found.tick, found.name, Number(found.distance_m.toFixed(4))];
  };
  expect("parting", part(track(0.01, [0, 1, 0, 0], 20), 0.025), [3, "moving", 0.03]);
  // The same time has passed, but B has one tick for two of A's ticks.
  expect("parting at half the rate", part(track(0.01, [1, 0, 0, 0], 20, 0.04), 0.025), [5, "moving", 0.03]);
  expect("no parting in the common time", part(track(0.01, [1, 0, 0, 0], 3), 0.025), null);
  // Rotated by 90 deg about z, the point is at y = 1 instead of x = 1.
  expect("parting by rotation", part(track(0, [Math.SQRT1_2, 0, 0, Math.SQRT1_2], 20), 0.025), [0, "moving", 1.4142]);

  // The range is relative to the largest absolute value, and the mean difference is relative to the range.
  expect("change of a constant", Evalbus.changeOf([[2, 2, NaN]], null), 0);
  expect("change of nothing", Evalbus.changeOf([[NaN]], null), 0);
  expect("change", Evalbus.changeOf([[2, 3, 4]], null), 0.5);
  expect("change of B", Evalbus.changeOf([[0, 0]], [[1, 3]]), 2 / 3);
  expect("change of equal episodes", Evalbus.changeOf([[0, 1]], [[0, 1]]), 0);
  // Both rise by 1 in 0.04 s: A in one tick, B in two ticks or, in the second pair, the reverse.
  expect("change of equal episodes with other periods", [Evalbus.changeOf([[0, 1, 2]], [[0, 0.5, 1, 1.5, 2]], 2),
    Evalbus.changeOf([[0, 0.5, 1, 1.5, 2]], [[0, 1, 2]], 0.5)], [0, 0.1]);
  expect("held values", Evalbus.held([NaN, 1, NaN, NaN, 3]), [NaN, 1, 1, 1, 3]);

  const arms = { arms: ["left", "right"] };
  expect("colors", ["left", "right_gripper_to_pot", "lift_distance", "leftover", ""].map((name, k) => Evalbus.roleOf(name, k, arms)),
    ["left", "right", "o2", "o3", "o0"]);
  expect("names of runs", [{ run: 2 }, { name: "lift_pot-position", policy: "noisy" }, { name: "noisy/lift_pot", policy: "noisy" }]
    .map(Evalbus.runName), ["run 2", "lift_pot-position (noisy)", "noisy/lift_pot"]);
  expect("points", [-0.125, 0.125, 0.005, -0.004, 0, 0.375].map((share) => Evalbus.points(share)), ["−13", "+13", "+1", "0", "0", "+38"]);
  expect("points with a decimal", [0.0125, -0.0125].map((share) => Evalbus.points(share, 1)), ["+1.3", "−1.3"]);
  expect("decimals of points", [[0.625, 1, 0.375], [1 / 3, 2 / 3, 1 / 3], [0.5, 0.75, 0.25], [-0.625, 0.375, 1]].map((one) => Evalbus.pointDecimals(...one)), [1, 1, 0, 1]);
  expect("texts of B", [["success", "Success at 6.16 s: the pot is lifted"], ["failure", "The pot slipped"], ["success", ""]]
    .map((one) => Evalbus.textOfB(...one)), ["B: success at 6.16 s: the pot is lifted", "B: failure. The pot slipped", "B: success"]);
  const rounded = (k, n) => Math.floor((200 * k + n) / (2 * n));
  const contradictions = [];
  for (let n = 1; n <= 200; ++n) {
    for (let a = 0; a <= n; ++a) {
      for (let b = 0; b <= a; ++b) {
        const expected = rounded(a - b, n) === rounded(a, n) - rounded(b, n) ? 0 : 1;
        if (Evalbus.pointDecimals(a / n - b / n, a / n, b / n) !== expected) contradictions.push([a, b, n]);
      }
    }
  }
  expect("points that contradict the rates", contradictions, []);
  expect("p values", [0.0625, 0.3125, 0.0009, 0.001, 0.9996, 0.04996, 0.05].map(Evalbus.pText), ["p = 0.063", "p = 0.313", "p < 0.001", "p = 0.001", "p = 1.000", "p = 0.0499", "p = 0.050"]);
  expect("values of conditions", [[1.0964, "m", 1.096], [1.09594, "m", 1.096, true], [1.09594, "m", 1.1, true], [-0.0001, "m", 0], [0.032, "deg", 20], [27.44, "deg", 20], [0.85, "1", 0.05], [NaN, "m", 1]]
    .map((one) => Evalbus.measured(...one)), ["1.096", "1.0959", "1.096", "0.000", "0.03", "27.4", "0.850", "–"]);
  expect("intervals", [[0.401, 0.892], [0.985, 1]].map(Evalbus.percentRange), ["40 to 89 %", "98.5 to 100.0 %"]);
  return wrong;
})()
