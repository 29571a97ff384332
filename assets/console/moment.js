/** The moment of a behavior that pictures, lanes, story and values follow together. */

const LEAST_RANGE = 0.1;  // s

export class Moment {
  /** @param {number} length seconds */
  constructor(length, start = 0) {
    this.length = Math.max(length, 0);
    this.seconds = Math.min(Math.max(start, 0), this.length);
    this.listeners = [];
    this.rangeListeners = [];
    this.range = {from: 0, to: this.length};
    this.frame = null;
  }

  /** Whether all of it is shown. */
  get isWhole() {
    return this.range.from === 0 && this.range.to === this.length;
  }

  /** @param {function({from, to})} listener called when another part of the time is looked at */
  followRange(listener) {
    this.rangeListeners.push(listener);
  }

  /** What is looked at: lanes and plots show no more, and watching ends with it. null: all. */
  setRange(range) {
    const within = (seconds) => Math.min(Math.max(seconds, 0), this.length);
    const [from, to] = range ? [within(range.from), within(range.to)] : [0, this.length];
    if (!(to - from >= Math.min(LEAST_RANGE, this.length))) return;
    if (from === this.range.from && to === this.range.to) return;
    this.range = {from, to};
    for (const listener of this.rangeListeners) listener(this.range);
    if (this.seconds < from || this.seconds > to) this.set(from);
  }

  /** Twice as close round the moment, or half. */
  zoom(times) {
    const {from, to} = this.range;
    const half = (to - from) / times / 2;
    const middle = Math.min(Math.max(this.seconds, half), Math.max(this.length - half, half));
    this.setRange({from: middle - half, to: middle + half});
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

  /** Lets the time run as it did, in this page alone; `onEnd` when it stops: true, not by itself. */
  play(onEnd) {
    if (this.isPlaying) return;
    if (this.seconds >= this.range.to || this.seconds < this.range.from) this.set(this.range.from);
    this.onEnd = onEnd;
    let last = performance.now();
    const step = (now) => {
      this.frame = requestAnimationFrame(step);
      this.set(Math.min(this.seconds + Math.max(now - last, 0) / 1000, this.range.to));
      last = now;
      if (this.seconds >= this.range.to) this.stop(false);
    };
    this.frame = requestAnimationFrame(step);
  }

  pause() {
    if (this.isPlaying) this.stop(true);
  }

  stop(isPaused) {
    cancelAnimationFrame(this.frame);
    this.frame = null;
    if (this.onEnd) this.onEnd(isPaused);
  }

  /** Nobody follows any longer. */
  close() {
    this.pause();
    this.listeners = [];
    this.rangeListeners = [];
  }
}
