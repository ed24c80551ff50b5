// Draws the curves of metrics onto the canvases of their cards (curves.js).
"use strict";

// Derived classes set `tracks` (A and, if two episodes are compared, B), `timeline` (its time axis is shared) and `palette`,
// and implement moveCard(card), which places the cursor.
Evalbus.CurvePlots = class {
  rangeOf(card) {
    let low = Infinity, high = -Infinity;
    const look = (track, parts) => {
      for (const { row } of parts) {
        const values = track.rows[row].data;
        for (let k = 0; k < track.ticks; ++k) {
          if (values[k] < low) low = values[k];
          if (values[k] > high) high = values[k];
        }
      }
    };
    look(this.tracks[0], card.parts);
    if (this.tracks[1]) look(this.tracks[1], card.otherParts);
    if (low > high) return null;
    // The axis begins at zero if no value is negative and the lowest value is below 60 % of the highest.
    if (low >= 0 && low < 0.6 * high) low = 0;
    // The range of an almost constant curve is extended, so that rounding errors are not enlarged.
    const size = Math.max(Math.abs(low), Math.abs(high));
    if (size < Evalbus.CurvePlots.NOTHING) return { low: 0, high: this.isWhole(card) ? 1 : Evalbus.CurvePlots.NOTHING };
    if (high - low < 1e-3 * size) {
      high += 0.5 * size;
      low = low > 0 ? 0 : low - 0.5 * size;
    }
    return { low, high };
  }

  drawCard(card) {
    if (!card.isSeen || !this.tracks) return;
    card.from = this.timeline.from;
    card.to = this.timeline.to;
    const range = this.rangeOf(card);
    Evalbus.drawOn(card.canvas, (context, width, height) => {
      const bottom = card.isLarge ? height - 16 : height - 3, top = 6;
      context.font = `10.5px ${this.palette.font}`;
      card.left = 0;
      context.textBaseline = "middle";
      card.most = range ? Math.max(Math.abs(range.low), Math.abs(range.high)) : 0;
      card.isWhole = range && this.isWhole(card);
      if (!range) {
        context.fillStyle = this.palette.soft;
        context.textAlign = "left";
        context.fillText(this.tracks[0].head.is_over ? "no value" : "no value yet", 0, height / 2);
        card.right = width;
        return;
      }
      // If there would be only one tick, a smaller step is used.
      const few = Evalbus.ticksOf(range.low, range.high, card.isLarge ? 4 : 1.6);
      const marks = few.length > 1 ? few : Evalbus.ticksOf(range.low, range.high, 2.5);
      const texts = Evalbus.axisTexts(marks);
      card.left = Math.ceil(Math.max(...texts.map((text) => context.measureText(text).width))) + 8;
      card.right = width - 6;
      const y = (value) => bottom - (value - range.low) / (range.high - range.low) * (bottom - top);
      const x = (time) => card.left + (time - card.from) / (card.to - card.from) * (card.right - card.left);
      context.textAlign = "right";
      marks.forEach((mark, k) => {
        context.strokeStyle = this.palette.rule;
        context.beginPath();
        context.moveTo(card.left, Math.round(y(mark)) + 0.5);
        context.lineTo(card.right, Math.round(y(mark)) + 0.5);
        context.stroke();
        context.fillStyle = this.palette.soft;
        context.fillText(texts[k], card.left - 5, Math.max(6, Math.min(y(mark), bottom - 4)));
      });
      if (card.isLarge) {
        context.textAlign = "center";
        for (const time of Evalbus.ticksOf(card.from, card.to, (card.right - card.left) / 70)) {
          context.fillText(`${Number(time.toPrecision(6))} s`, Math.min(x(time), card.right - 8), height - 6);
        }
      }
      context.save();
      context.beginPath();
      context.rect(card.left, 0, card.right - card.left + 6, height);
      context.clip();
      this.drawLines(context, card, x, y, card.right - card.left);
      context.restore();
    });
    this.moveCard(card);
  }

  // Draws the curves of A and, dashed, of B, and shades their difference. x(time), y(value): coordinates in the plot. width:
  // width of the plot.
  drawLines(context, card, x, y, width) {
    const [track, other] = this.tracks;
    if (other) {
      card.parts.forEach((part, k) => card.otherParts[k] && this.shade(context, card, part, card.otherParts[k], x, y, width));
      context.setLineDash([3, 3]);
      card.otherParts.forEach((part) => this.line(context, other, part, x, y, width, card.curve.sparse));
      context.setLineDash([]);
    }
    card.parts.forEach((part) => this.line(context, track, part, x, y, width, card.curve.sparse));
  }

  // Fills the area between A and B.
  shade(context, card, part, otherPart, x, y, width) {
    const [track, other] = this.tracks;
    const [first, last] = this.timeline.ticksSeen(track);
    const step = Math.max(1, Math.floor((last - first) / Math.max(50, width)));
    const points = [];
    const fill = () => {
      if (points.length > 1) {
        context.beginPath();
        points.forEach(([at, a]) => context.lineTo(at, a));
        points.reverse().forEach(([at, , b]) => context.lineTo(at, b));
        context.fill();
      }
      points.length = 0;
    };
    context.fillStyle = this.palette.b;
    context.globalAlpha = 0.25;
    for (let k = first; k <= last; k += step) {
      const tick = Math.round(k * track.tickSeconds / other.tickSeconds);
      const a = this.valueOf(track, card, part, k), b = this.valueOf(other, card, otherPart, tick);
      if (Number.isNaN(a) || Number.isNaN(b)) fill();
      else points.push([x(k * track.tickSeconds), y(a), y(b)]);
    }
    fill();
    context.globalAlpha = 1;
  }

  // Draws the minimum and the maximum of each group of ticks, so that peaks remain visible. There is about one group per
  // pixel.
  line(context, track, part, x, y, width, isSparse) {
    const values = track.rows[part.row].data;
    const [first, last] = this.timeline.ticksSeen(track);
    const step = Math.max(1, Math.floor((last - first + 1) / Math.max(50, width)));
    context.strokeStyle = this.palette[part.color];
    context.lineWidth = 1.6;
    context.lineJoin = "round";
    context.beginPath();
    let isDown = false;
    const to = (tick) => {
      const place = [x(tick * track.tickSeconds), y(values[tick])];
      if (isDown) context.lineTo(...place);
      else context.moveTo(...place);
      isDown = true;
    };
    for (let k = first; k <= last; k += step) {
      let low = -1, high = -1;
      for (let i = k; i < Math.min(k + step, last + 1); ++i) {
        if (Number.isNaN(values[i])) continue;
        if (low < 0 || values[i] < values[low]) low = i;
        if (high < 0 || values[i] > values[high]) high = i;
      }
      if (low < 0) {
        if (!isSparse) isDown = false;
        continue;
      }
      to(Math.min(low, high));
      if (low !== high) to(Math.max(low, high));
    }
    context.stroke();
    context.lineWidth = 1;
  }

  // Returns whether all values of A are integers. They are then shown without decimals.
  isWhole(card) {
    return card.parts.every(({ row }) => {
      const { data } = this.tracks[0].rows[row];
      for (let k = 0; k < this.tracks[0].ticks; ++k) {
        if (!Number.isNaN(data[k]) && !Number.isInteger(data[k])) return false;
      }
      return true;
    });
  }

  valueOf(track, card, part, tick) {
    return card.curve.sparse ? track.lastValueAt(part.row, tick) : track.valueAt(part.row, tick);
  }
};

// If all values of a curve are closer to zero than this, its axis ends here. This applies to every displayed unit, such as m,
// rad, s and mm.
Evalbus.CurvePlots.NOTHING = 1e-3;
