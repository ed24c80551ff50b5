// The current time within an episode, in ticks. The player is paused, plays the episode, or follows a live episode.
"use strict";

Evalbus.Player = class {
  constructor() {
    this.tick = 0;
    this.last = 0;
    this.tickSeconds = 0.02;
    this.rate = 1;
    this.isPlaying = false;
    this.isFollowing = false;
    // Wall time for which the end has been shown.
    this.rested_s = 0;
    this.isCalm = matchMedia("(prefers-reduced-motion: reduce)").matches;
  }

  // Returns the tick whose numbers are shown.
  get shown() {
    return Math.min(Math.floor(this.tick + 1e-6), this.last);
  }

  setLength(ticks, tickSeconds) {
    this.last = Math.max(0, ticks - 1);
    this.tickSeconds = tickSeconds;
    this.tick = Math.min(this.tick, this.last);
  }

  seek(tick) {
    this.isFollowing = false;
    this.tick = Math.max(0, Math.min(this.last, Math.round(tick)));
  }

  step(ticks) {
    this.pause();
    this.seek(this.shown + ticks);
  }

  play() {
    if (this.tick >= this.last && !this.isFollowing) this.tick = 0;
    this.isPlaying = true;
  }

  pause() {
    this.isPlaying = false;
    this.isFollowing = false;
    this.tick = Math.max(0, Math.min(this.last, Math.round(this.tick)));
  }

  follow() {
    this.isFollowing = true;
    this.isPlaying = true;
    this.rate = 1;
  }

  // Advances by seconds of wall time. Returns whether the current time has changed. Playback advances by at most 0.25 s of wall
  // time, so that it does not skip what a slow frame or a hidden page has missed. Following has no such limit, because it
  // could not catch up otherwise.
  advance(elapsed_s) {
    const before = this.tick;
    if (this.isFollowing) {
      // Ticks may arrive in bursts. They are smoothed with a delay of about 0.1 s.
      const part = this.isCalm ? 1 : 1 - Math.exp(-elapsed_s / 0.12);
      this.tick = this.last - this.tick < 0.02 ? this.last : this.tick + (this.last - this.tick) * part;
    } else if (this.isPlaying) {
      this.tick = Math.min(this.last, this.tick + Math.min(0.25, elapsed_s) * this.rate / this.tickSeconds);
      if (this.tick >= this.last) this.isPlaying = false;
    }
    // rested_s counts from the first frame that shows the end.
    this.rested_s = before >= this.last ? this.rested_s + elapsed_s : 0;
    return this.tick !== before;
  }
};

Evalbus.Player.RATES = [0.1, 0.25, 0.5, 1, 2, 4];
