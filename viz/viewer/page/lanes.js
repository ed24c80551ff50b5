// Draws the timeline's lanes: stages, grasps, events and pinned curves.
"use strict";

// Returns the stages of an episode in a drawable form: {flags: [{tick, number, name}], bands: [{from, to, name,
// isReached}]}. A band is a period in which `name` was the lowest stage that had not been reached. There is no band between
// stages that were reached at the same tick. Pure.
Evalbus.stageBands = (stages, lastTick) => {
  const flags = stages.filter((stage) => stage.tick !== null)
    .map((stage) => ({ tick: stage.tick, number: stage.index, name: stage.name }))
    .sort((a, b) => a.tick - b.tick || a.number - b.number);
  const byNumber = [...stages].sort((a, b) => a.index - b.index);
  const bands = [];
  const starts = [0, ...new Set(flags.map((flag) => flag.tick).filter((tick) => tick > 0))];
  starts.forEach((from, k) => {
    const to = k + 1 < starts.length ? starts[k + 1] : lastTick;
    const waited = byNumber.find((stage) => stage.tick === null || stage.tick > from);
    if (waited && to > from) bands.push({ from, to, name: waited.name, isReached: waited.tick !== null });
  });
  return { flags, bands };
};

// The function draw(timeline, context, lane) for each kind of lane.
Evalbus.lanes = {
  stages(timeline, context, lane) {
    const { track, top, height } = lane, palette = timeline.palette;
    const { flags, bands } = Evalbus.stageBands(track.head.stages, track.last);
    const seconds = (tick) => tick * track.tickSeconds;
    const size = height - 8;
    // Flags with equal or close ticks are drawn next to each other. A line marks the tick of each.
    let free = -Infinity;
    const places = flags.map((flag) => {
      const x = timeline.xOf(seconds(flag.tick)), left = Math.max(x, free);
      free = left + size + 1;
      return { flag, x, left };
    });
    // Flags at the end of the plot are moved to the left, so that all of them are visible.
    let end = timeline.plotRight + 7;
    for (const place of places.filter(({ x }) => x <= end).reverse()) {
      place.left = Math.min(place.left, end - size);
      end = place.left - 1;
    }
    for (const band of bands) {
      const from = timeline.xOf(seconds(band.from)), to = timeline.xOf(seconds(band.to));
      context.fillStyle = palette.rule;
      context.globalAlpha = 0.55;
      context.fillRect(from, top + height - 7, Math.max(1, to - from), 3);
      context.globalAlpha = 1;
      const covered = places.filter(({ left }) => left < to && left + size > from);
      const begin = Math.max(from, timeline.left, ...covered.map(({ left }) => left + size)) + 5;
      const end = Math.min(to, timeline.plotRight);
      const isUnreached = !band.isReached && track.head.is_over;
      const name = Evalbus.spaced(band.name);
      context.fillStyle = palette.soft;
      const late = isUnreached && end - begin > 180 ? "not reached" : "";
      if (late) {
        context.textAlign = "right";
        context.fillText(late, end - 4, top + height / 2 - 1);
      }
      if (end - begin > 50) {
        context.textAlign = "left";
        context.fillText(Evalbus.shortened(context, `waiting for: ${name}`, end - begin - (late ? 86 : 6)), begin, top + height / 2 - 1);
      }
      timeline.mark(lane, from, to, `waiting for: ${name} · ${isUnreached ? `not reached in ${seconds(band.to).toFixed(2)} s`
        : `from ${seconds(band.from).toFixed(2)} s`}`);
    }
    context.textAlign = "center";
    context.fillStyle = palette.good;
    for (const { x } of places) context.fillRect(x, top + 2, 2, height - 4);
    for (const { flag, left } of places) {
      context.fillStyle = palette.good;
      context.fillRect(left, top + 3, size, size);
      context.fillStyle = palette.page;
      context.font = `bold 11px ${palette.font}`;
      context.fillText(String(flag.number), left + size / 2, top + 3 + size / 2 + 0.5);
      context.font = `11px ${palette.font}`;
      timeline.mark(lane, left, left + size, `stage ${flag.number}: ${Evalbus.spaced(flag.name)} · ${seconds(flag.tick).toFixed(2)} s`, true);
    }
  },

  // Draws the gripper's opening as an area and each grasp as a bar.
  gripper(timeline, context, lane) {
    const { track, gripper, index, top, height } = lane;
    const color = timeline.palette[Evalbus.roleOf(gripper, index, track.head)];
    const opening = track.curve("gripper_opening");
    if (opening && track.ticks > 1) {
      const row = track.rows[opening.first_row + index];
      const [first, last] = timeline.ticksSeen(track);
      const step = Math.max(1, Math.floor((last - first) / 1200));
      context.beginPath();
      context.moveTo(timeline.xOf(first * track.tickSeconds), top + height - 3);
      for (let k = first; row && k <= last; k += step) {
        const value = Math.max(0, Math.min(1, row.data[k] || 0));
        context.lineTo(timeline.xOf(k * track.tickSeconds), top + height - 3 - value * (height - 8));
      }
      context.lineTo(timeline.xOf(last * track.tickSeconds), top + height - 3);
      context.globalAlpha = 0.2;
      context.fillStyle = color;
      context.fill();
      context.globalAlpha = 1;
    }
    for (const grasp of track.head.events) {
      if (grasp.kind !== "grasp" || grasp.gripper !== gripper) continue;
      const begin = grasp.tick * track.tickSeconds;
      const end = grasp.duration_s ? begin + grasp.duration_s : track.last * track.tickSeconds;
      const from = timeline.xOf(begin), to = timeline.xOf(end);
      context.fillStyle = color;
      context.fillRect(from, top + height / 2 - 4, Math.max(2, to - from), 8);
      timeline.mark(lane, from, to, `${Evalbus.spaced(gripper)} grasps ${Evalbus.spaced(grasp.object)} with all fingers`
        + ` · ${begin.toFixed(2)} to ${end.toFixed(2)} s${grasp.duration_s ? "" : ", not released"}`);
    }
  },

  events(timeline, context, lane) {
    const { track, top, height } = lane;
    for (const event of track.head.events) {
      if (!Evalbus.eventMarks[event.kind]) continue;
      const x = timeline.xOf(event.tick * track.tickSeconds);
      Evalbus.eventMarks[event.kind](context, x, top + height / 2, timeline.palette, track);
      timeline.mark(lane, x, x, `${(event.tick * track.tickSeconds).toFixed(2)} s · ${Evalbus.eventText(event)}`, true);
    }
  },

  // Draws a pinned curve of A and, if two episodes are compared, of B.
  curve(timeline, context, lane) {
    const range = lane.card && lane.curves.rangeOf(lane.card);
    if (!range) return;
    const { top, height } = lane, bottom = top + height - 4;
    const y = (value) => bottom - (value - range.low) / (range.high - range.low) * (height - 9);
    lane.curves.drawLines(context, lane.card, (time) => timeline.xOf(time), y, timeline.plotRight - timeline.left);
    context.fillStyle = timeline.palette.soft;
    context.textAlign = "left";
    context.fillText(Evalbus.number(Number(range.high.toPrecision(3))), timeline.left - 5, top + 8);
    context.fillText(Evalbus.number(Number(range.low.toPrecision(3))), timeline.left - 5, bottom - 3);
  },
};

// Draws the marks of events. Each kind has its own shape, so that marks can be distinguished without color.
Evalbus.eventMarks = {
  grasp(context, x, y, palette) {
    Evalbus.polygon(context, [[x - 5, y - 4], [x + 5, y - 4], [x, y + 5]], palette.text, true);
  },
  release(context, x, y, palette) {
    Evalbus.polygon(context, [[x - 5, y + 4], [x + 5, y + 4], [x, y - 5]], palette.text, false);
  },
  slip(context, x, y, palette) {
    Evalbus.polygon(context, [[x, y - 6], [x + 6, y], [x, y + 6], [x - 6, y]], palette.warn, true);
  },
  collision(context, x, y, palette) {
    context.strokeStyle = palette.bad;
    context.lineWidth = 2;
    context.beginPath();
    for (const sign of [-1, 1]) {
      context.moveTo(x - 4, y - 4 * sign);
      context.lineTo(x + 4, y + 4 * sign);
    }
    context.stroke();
    context.lineWidth = 1;
  },
  self_collision(context, x, y, palette) {
    Evalbus.eventMarks.collision(context, x, y, palette);
    context.strokeStyle = palette.bad;
    context.beginPath();
    context.arc(x, y, 7, 0, 2 * Math.PI);
    context.stroke();
  },
  // Draws the symbol for a violation of a force limit.
  limit(context, x, y, palette) {
    Evalbus.polygon(context, [[x - 5, y - 5], [x + 5, y - 5], [x + 5, y + 5], [x - 5, y + 5]], palette.bad, false);
  },
  end(context, x, y, palette, track) {
    const outcome = track.outcome();
    context.fillStyle = outcome === "failure" ? palette.bad : outcome === "success" ? palette.good : palette.soft;
    context.fillRect(x - 2, y - 9, 4, 18);
    const sign = { success: "✓", failure: "✕" }[outcome];
    context.font = `bold 13px ${palette.font}`;
    context.textAlign = "right";
    if (sign) context.fillText(sign, x - 5, y + 1);
    context.font = `11px ${palette.font}`;
  },
};

// Returns the text or, if it is too wide, as much of it as fits and an ellipsis.
Evalbus.shortened = (context, text, width) => {
  if (context.measureText(text).width <= width) return text;
  let length = text.length;
  while (length > 0 && context.measureText(`${text.slice(0, length)}…`).width > width) --length;
  return length > 0 ? `${text.slice(0, length).trimEnd()}…` : "";
};

Evalbus.polygon = (context, points, color, isFilled) => {
  context.beginPath();
  points.forEach(([x, y], k) => (k === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
  context.closePath();
  context.fillStyle = context.strokeStyle = color;
  context.lineWidth = 1.5;
  if (isFilled) context.fill();
  else context.stroke();
  context.lineWidth = 1;
};
