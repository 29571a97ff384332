/** What was done when, on one line of time: each behavior is a bar, those at the same time stand below another. */

import {drawn, element, refill} from './dom.js';
import {count, duration, localTime, secondsBetween, tickStep} from './format.js';

const ROW = 20;  // px
const LEAST = 5;  // px that a bar has at least
const MOST_ROWS = 12;
const LEAST_DRAG = 6;  // px; less is a click

/** Where each bar goes: the first row where it meets no other. */
export function pack(bars) {
  const ends = [];
  return bars.map((bar) => {
    let row = ends.findIndex((end) => end <= bar.x);
    if (row < 0) row = ends.length < MOST_ROWS ? ends.push(0) - 1 : MOST_ROWS - 1;
    ends[row] = bar.x + bar.width + 2;
    return {...bar, row};
  });
}

export class Timeline {
  /** @param {Route} route */
  constructor(route) {
    this.route = route;
    this.behaviors = [];
    this.title = element('h2', {}, 'Timeline');
    this.under = element('p', {class: 'soft'});
    this.plot = element('div', {class: 'timeline', on: {pointerdown: (event) => this.grabbed(event),
      pointermove: (event) => this.dragged(event), pointerup: (event) => this.dropped(event)}});
    this.span = drawn('rect', {class: 'chosen-range', y: 16, width: 0});
    this.from = null;  // px, where a drag began
    this.place = element('section', {}, this.title, this.under, this.plot);
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.plot);
  }

  /** @param {Array} behaviors any order @param {string} words what they are, "of 2026-11-23" */
  show(behaviors, words) {
    this.behaviors = [...behaviors].sort((a, b) => (BigInt(a.begin) < BigInt(b.begin) ? -1 : 1));
    this.under.textContent = words;
    this.draw();
  }

  draw() {
    const width = this.plot.clientWidth;
    if (!this.behaviors.length || width < 10) {
      refill(this.plot, this.behaviors.length ? [] : element('p', {class: 'soft'}, 'None.'));
      return;
    }
    const first = this.behaviors[0];
    const lasts = this.behaviors.map((one) => secondsBetween(first.begin, one.begin) + (one.duration || 0));
    const span = Math.max(...lasts, 1);
    const scale = (width - LEAST) / span;
    const bars = pack(this.behaviors.map((one) => ({one, x: secondsBetween(first.begin, one.begin) * scale,
      width: Math.max((one.duration || 0) * scale, LEAST)})));
    const rows = 1 + Math.max(...bars.map((bar) => bar.row));
    const height = rows * ROW + 26;
    const last = this.behaviors[this.behaviors.length - 1];
    refill(this.plot, drawn('svg', {viewBox: `0 0 ${width} ${height}`, width, height, role: 'img',
      'aria-label': `Timeline of ${count(bars.length, 'behavior')}, ${localTime(first)} to ` +
        `${localTime(last)}. The list has them all.`},
    this.ticks(first, span, scale, height, width), bars.map((bar) => this.bar(bar)), this.span));
    this.span.setAttribute('height', height);
    this.stampAt = (x) => (BigInt(first.begin) + BigInt(Math.round((x / scale) * 1e9))).toString();
  }

  x(event) {
    const {left, width} = this.plot.getBoundingClientRect();
    return Math.min(Math.max(event.clientX - left, 0), width);
  }

  grabbed(event) {
    if (event.button === 0 && this.behaviors.length) this.from = this.x(event);
  }

  dragged(event) {
    if (this.from === null || !(event.buttons & 1)) return;
    const to = this.x(event);
    if (Math.abs(to - this.from) < LEAST_DRAG) return;
    this.plot.setPointerCapture(event.pointerId);  // a bar that is let go over is not opened
    this.span.setAttribute('x', Math.min(this.from, to));
    this.span.setAttribute('width', Math.abs(to - this.from));
  }

  dropped(event) {
    const {from} = this;
    const to = this.x(event);
    this.from = null;
    this.span.setAttribute('width', 0);
    if (from === null || Math.abs(to - from) < LEAST_DRAG) return;
    this.route.search({day: '', since: this.stampAt(Math.min(from, to)), until: this.stampAt(Math.max(from, to))});
  }

  bar({one, x, width, row}) {
    // For pointers; whoever uses keys or a screen reader has the list.
    const made = drawn('g', {class: 'one', on: {click: () => this.route.open('behavior', [one.id])}},
      drawn('title', {}, `#${one.id} ${one.name}, ${one.outcome}, ${localTime(one)}, ${duration(one.duration)}`),
      drawn('rect', {class: `bar ${one.look}`, x, y: 22 + row * ROW, width, height: ROW - 4,
        rx: 2}));
    if (width > one.name.length * 8 + 8) {
      made.append(drawn('text', {class: 'on-bar', x: x + 5, y: 22 + row * ROW + 12}, one.name));
    }
    return made;
  }

  /** Ticks at round local times; what they say is as exact as they are far from another. */
  ticks(first, span, scale, height, width) {
    const step = tickStep(span, width, 100);
    const [day, clock] = localTime(first).split(' ');
    const [hours, minutes, seconds] = clock.split(':').map(Number);
    const sinceMidnight = hours * 3600 + minutes * 60 + seconds;
    const made = [];
    for (let at = Math.ceil(sinceMidnight / step) * step; at <= sinceMidnight + span; at += step) {
      const x = (at - sinceMidnight) * scale;
      if (x > width - 60) break;
      const when = new Date(Date.parse(`${day}T00:00:00Z`) + at * 1000).toISOString();
      const text = step >= 86400 ? when.slice(0, 10) : when.slice(11, step < 60 ? 19 : 16);
      made.push(drawn('line', {class: 'tick', x1: x, x2: x, y1: 16, y2: height}),
        drawn('text', {class: 'tick-text', x: x + 3, y: 12}, text));
    }
    return made;
  }

  close() {
    this.watch.disconnect();
  }
}
