/** The moment of a behavior that pictures, lanes, story and values follow together. */

export class Moment {
  /** @param {number} length seconds */
  constructor(length, start = 0) {
    this.length = Math.max(length, 0);
    this.seconds = Math.min(Math.max(start, 0), this.length);
    this.listeners = [];
    this.frame = null;
  }

  /** @param {function(number)} listener also called at once */
  follow(listener) {
    this.listeners.push(listener);
    listener(this.seconds);
  }

  set(seconds) {
    const within = Math.min(Math.max(seconds, 0), this.length);
    if (within === this.seconds) return;
    this.seconds = within;
    for (const listener of this.listeners) listener(within);
  }

  get isPlaying() {
    return this.frame !== null;
  }

  /** Lets the time run as it did, in this page alone; `onEnd` when it stops, by itself or not. */
  play(onEnd) {
    if (this.isPlaying) return;
    if (this.seconds >= this.length) this.set(0);
    this.onEnd = onEnd;
    let last = performance.now();
    const step = (now) => {
      this.frame = requestAnimationFrame(step);
      this.set(this.seconds + Math.max(now - last, 0) / 1000);
      last = now;
      if (this.seconds >= this.length) this.pause();
    };
    this.frame = requestAnimationFrame(step);
  }

  pause() {
    if (!this.isPlaying) return;
    cancelAnimationFrame(this.frame);
    this.frame = null;
    if (this.onEnd) this.onEnd();
  }

  /** Nobody follows any longer. */
  close() {
    this.pause();
    this.listeners = [];
  }
}
