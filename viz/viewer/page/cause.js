// The cause of a failure and the point of no return: their marks on the timeline, and the time at which a failed episode
// opens.
"use strict";

// A failed episode opens this many seconds before its decisive moment.
Evalbus.BEFORE_CAUSE = 1;

// Returns the time at which an episode opens. head: head of its "episode" block. Successes, and episodes without a cause,
// open at time 0.
Evalbus.openingTime = (head) => (head.failure_reason && Number.isFinite(head.cause_time_s)
  ? Math.max(0, head.cause_time_s - Evalbus.BEFORE_CAUSE) : 0);

// Draws the mark of the last tick from which the expert succeeds.
Evalbus.eventMarks.no_return = (context, x, y, palette) => {
  context.fillStyle = palette.text;
  for (let dy = -12; dy < 12; dy += 5) context.fillRect(x - 1, y + dy, 2, 3);
  Evalbus.polygon(context, [[x + 1, y + 4], [x + 9, y + 8], [x + 1, y + 12]], palette.text, true);
};

Evalbus.eventMarks.cause = (context, x, y, palette) => {
  context.fillStyle = palette.bad;
  context.fillRect(x - 1, y - 12, 2, 24);
  Evalbus.polygon(context, [[x - 6, y - 12], [x + 6, y - 12], [x, y - 4]], palette.bad, true);
};
