/**
 * The numbers of a topic over time, as lines: dragging chooses a range of time, a click a moment. Small and our own;
 * Debian has no uPlot.
 */

import {get, Latest} from './api.js';
import {button, drawn, element, put, refill} from './dom.js';
import {plain, tickStep} from './format.js';

const HEIGHT = 180;  // px
const LEFT = 52;
const BOTTOM = 22;
const MOST_SHOWN = 6;  // lines at first; the looks that style.css has for them
const LEAST_DRAG = 4;  // px; less is a click

/** [least, most] of the numbers; of none, or of one alone, with room around it. */
export function extent(numbers) {
  const known = numbers.filter(Number.isFinite);
  const least = Math.min(...known);
  const most = Math.max(...known);
  if (!known.length) return [0, 1];
  const room = most > least ? (most - least) * 0.05 : Math.max(Math.abs(most) * 0.1, 0.1);
  return [least - room, most + room];
}

function changes(numbers) {
  const known = numbers.filter(Number.isFinite);
  return known.some((one) => one !== known[0]);
}

/** Fields in the order of what they tell: those that change first. */
export function inOrder(fields) {
  return Object.keys(fields).sort((a, b) => Number(changes(fields[b])) - Number(changes(fields[a])));
}

export class ValuePlot {
  /** @param {number} id of the behavior @param {Moment} moment */
  constructor(id, moment) {
    this.id = id;
    this.moment = moment;
    this.shown = new Set();
    this.values = {t: [], fields: {}};
    this.plot = element('div', {class: 'value-plot', on: {
      pointerdown: (event) => this.grabbed(event), pointermove: (event) => this.dragged(event),
      pointerup: (event) => this.dropped(event), dblclick: () => this.moment.setRange(null)}});
    this.head = drawn('line', {class: 'playhead', y1: 0, y2: HEIGHT - BOTTOM});
    this.chosen = drawn('rect', {class: 'chosen-range', y: 0, height: HEIGHT - BOTTOM, width: 0});
    this.fields = element('div', {class: 'plot-fields', role: 'group', 'aria-label': 'Lines of the plot'});
    this.under = element('p', {class: 'soft'});
    this.place = element('div', {class: 'plotted'}, this.plot, this.fields, this.under);
    this.loader = new Latest((wanted, signal) => this.load(wanted, signal));
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.plot);
    moment.follow((seconds) => this.stand(seconds));
    moment.followRange(() => this.reload());
  }

  choose(topic) {
    if (topic === this.topic) return;
    this.topic = topic;
    this.shown = new Set();
    this.reload();
  }

  reload() {
    if (this.topic) this.loader.want({topic: this.topic, ...this.moment.range});
  }

  async load({topic, from, to}, signal) {
    try {
      const values = await get(`/api/behaviors/${this.id}/values`,
        {topic, from: from.toFixed(3), to: to.toFixed(3)}, signal);
      if (topic !== this.topic) return;
      this.values = values;
      this.order = inOrder(values.fields);
      if (!this.shown.size) {
        const changing = this.order.filter((field) => changes(values.fields[field]));
        (changing.length ? changing : this.order).slice(0, MOST_SHOWN).forEach((field) => this.shown.add(field));
      }
      this.under.textContent = !this.order.length ? 'This topic has no numbers to plot.' : values.whole ? '' :
        'Some of its many messages; a shorter range shows more.';
      this.offer();
      this.draw();
    } catch (problem) {
      if (problem.name !== 'AbortError') this.under.textContent = problem.message;
    }
  }

  /** A button a field: which lines are shown. */
  offer() {
    this.plot.hidden = !this.order.length;
    const whole = button('Whole length', () => this.moment.setRange(null), {class: 'whole-range'});
    whole.hidden = this.moment.isWhole;
    refill(this.fields, whole, this.order.map((field) => button([element('i', {class: this.look(field)}), field],
      () => this.toggle(field), {'aria-pressed': this.shown.has(field) ? 'true' : 'false'})));
  }

  look(field) {
    return `line-${this.order.indexOf(field) % MOST_SHOWN}`;
  }

  toggle(field) {
    if (!this.shown.delete(field)) this.shown.add(field);
    this.offer();
    this.draw();
  }

  x(seconds) {
    const {from, to} = this.moment.range;
    return LEFT + ((seconds - from) / Math.max(to - from, 1e-9)) * (this.width - LEFT);
  }

  secondsAt(event) {
    const {from, to} = this.moment.range;
    const share = (event.clientX - this.plot.getBoundingClientRect().left - LEFT) / (this.width - LEFT);
    return from + Math.min(Math.max(share, 0), 1) * (to - from);
  }

  draw() {
    this.width = this.plot.clientWidth;
    if (this.width < 2 * LEFT) return;
    const lines = (this.order || []).filter((field) => this.shown.has(field));
    const [least, most] = extent(lines.flatMap((field) => this.values.fields[field]));
    const bottom = HEIGHT - BOTTOM;
    const y = (value) => bottom - ((value - least) / (most - least)) * bottom;
    refill(this.plot, drawn('svg', {width: this.width, height: HEIGHT, viewBox: `0 0 ${this.width} ${HEIGHT}`,
      role: 'img', 'aria-label': `${lines.join(', ') || 'Nothing'} of ${this.topic} over time`},
    drawn('defs', {}, drawn('clipPath', {id: 'plot-inside'},
      drawn('rect', {x: LEFT, y: 0, width: this.width - LEFT, height: bottom}))),
    this.levels(least, most, y), this.ticks(bottom),
    drawn('g', {'clip-path': 'url(#plot-inside)'}, this.chosen, lines.map((field) => drawn('path',
      {class: `value-line ${this.look(field)}`, d: this.path(this.values.fields[field], y)})), this.head)));
    this.stand(this.moment.seconds);
  }

  path(numbers, y) {
    let isDown = false;
    return numbers.map((value, at) => {
      if (!Number.isFinite(value)) {
        isDown = false;
        return '';
      }
      const step = `${isDown ? 'L' : 'M'}${this.x(this.values.t[at]).toFixed(1)} ${y(value).toFixed(1)}`;
      isDown = true;
      return step;
    }).join('') + (numbers.length === 1 ? 'h3' : '');
  }

  levels(least, most, y) {
    const step = 10 ** Math.floor(Math.log10((most - least) / 2));
    const made = [];
    const every = step * ([1, 2, 5].find((times) => (most - least) / (step * times) <= 5) || 10);
    for (let value = Math.ceil(least / every) * every; value <= most; value += every) {
      made.push(drawn('line', {class: 'tick', x1: LEFT, x2: this.width, y1: y(value), y2: y(value)}),
        drawn('text', {class: 'tick-text', x: LEFT - 6, y: Math.max(y(value) + 4, 10), 'text-anchor': 'end'},
          plain(Number(value.toPrecision(3)))));
    }
    return made;
  }

  ticks(bottom) {
    const {from, to} = this.moment.range;
    const step = tickStep(to - from, this.width - LEFT);
    const made = [];
    for (let at = Math.ceil(from / step) * step; at <= to; at += step) {
      if (this.x(at) > this.width - 24) break;
      made.push(drawn('text', {class: 'tick-text', x: this.x(at), y: bottom + 16}, `${Number(at.toFixed(2))} s`));
    }
    return made;
  }

  stand(seconds) {
    if (!this.width) return;
    this.head.setAttribute('x1', this.x(seconds));
    this.head.setAttribute('x2', this.x(seconds));
  }

  grabbed(event) {
    if (event.button !== 0) return;
    this.plot.setPointerCapture(event.pointerId);
    this.from = {x: event.clientX, seconds: this.secondsAt(event)};
  }

  dragged(event) {
    if (!this.from) return;
    const [a, b] = [this.x(this.from.seconds), this.x(this.secondsAt(event))];
    this.chosen.setAttribute('x', Math.min(a, b));
    this.chosen.setAttribute('width', Math.abs(a - b));
  }

  dropped(event) {
    if (!this.from) return;
    const {x, seconds} = this.from;
    const to = this.secondsAt(event);
    this.from = null;
    this.chosen.setAttribute('width', 0);
    if (Math.abs(event.clientX - x) >= LEAST_DRAG) {
      this.moment.setRange({from: Math.min(seconds, to), to: Math.max(seconds, to)});
    } else {
      this.moment.pause();
      this.moment.set(to);
    }
  }

  close() {
    this.loader.close();
    this.watch.disconnect();
  }
}
