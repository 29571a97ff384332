/**
 * What each topic said over a behavior, as lanes over one axis of time: goals as spans from start to result,
 * speech as text, everything else as marks. Dragging, or the arrow keys, moves the moment.
 */

import {button, drawn, element, put, refill} from './dom.js';
import {count, duration, folded, offset, tickStep, withoutNumbers} from './format.js';

const BAR = 28;  // px that what is drawn of a lane takes; a lane is as high, or higher, as style.css has it
const AXIS = 24;
const STEP = 0.1;  // s, an arrow key
const LETTER = 7;  // px, about
const ORDER = ['speech', 'ar', 'body'];  // what people ask about stands first

/** The lanes in the order they are shown. */
function inOrder(lanes) {
  const place = ({role}) => (ORDER.includes(role) ? ORDER.indexOf(role) : ORDER.length);
  return [...lanes].sort((a, b) => Number(a.context) - Number(b.context) || place(a) - place(b));
}

const fits = (text, width) => text.length * LETTER <= width;

function shortened(text, width) {
  if (fits(text, width)) return text;
  const letters = Math.floor(width / LETTER);
  return letters < 3 ? '' : `${text.slice(0, letters - 1)}…`;
}

export class Lanes {
  /**
   * @param {Array} lanes as /api/behaviors/ID has them
   * @param {Array} said [{t, text}]
   * @param {Moment} moment
   * @param {{label: string, onTopic?: function(string)}} how its accessible name; called with a chosen topic
   */
  constructor(lanes, said, moment, {label, onTopic}) {
    this.all = inOrder(lanes);
    const own = this.all.filter((lane) => !lane.context);
    this.lanes = own.length ? own : this.all;
    this.onTopic = onTopic;
    this.said = said || [];
    this.moment = moment;
    this.topics = element('div', {class: 'topics'});
    this.plot = element('div', {class: 'plot'});
    this.head = drawn('line', {class: 'playhead'});
    this.span = drawn('rect', {class: 'chosen-range', y: 0, width: 0});
    this.from = this.wanted = null;
    this.slider = element('div', {class: 'scrub', role: 'slider', tabindex: 0, 'aria-label': label,
      'aria-valuemin': 0, 'aria-valuemax': moment.length.toFixed(2), on: {
        keydown: (event) => this.pressed(event),
        pointerdown: (event) => this.grabbed(event),
        pointermove: (event) => this.dragged(event), pointerup: () => this.dropped(),
        dblclick: () => moment.setRange(null)}}, this.plot);
    this.place = element('div', {class: 'lanes'}, this.topics, this.slider);
    this.chosen = null;
    const rest = this.all.length - this.lanes.length;
    if (rest) {
      this.more = button(`Show ${count(rest, 'topic')} of the surroundings`, () => this.showAll(), {class: 'more'});
      put(this.place, this.more);
    }
    this.name();
    this.watch = new ResizeObserver(() => this.draw());
    this.watch.observe(this.plot);
    moment.follow((seconds) => this.stand(seconds));
    moment.followRange(() => this.draw());
  }

  /** The topics of the recording, too, which the behavior did not ask for itself. */
  showAll() {
    this.lanes = this.all;
    this.more.remove();
    this.name();
    this.draw();
    this.slider.focus();
  }

  name() {
    refill(this.topics, element('div', {class: 'axis-name soft'}, 'seconds'),
      this.lanes.map((lane) => this.topic(lane, this.onTopic)));
    this.choose(this.chosen);
  }

  topic(lane, onTopic) {
    const words = `${lane.topic}, ${lane.type}, ${count(lane.count, 'message')}` +
      (lane.hz ? `, ${lane.hz.toFixed(1)} a second` : '') +
      (lane.why_not ? `; a replay leaves it out: ${lane.why_not}` : '');
    // Of an action the beginning tells it from others, of other topics mostly the end: where it is too long,
    // that is what stays.
    const isAction = lane.topic.endsWith('/goal');
    const inside = [element('span', {class: isAction ? 'topic-name action' : 'topic-name'},
      element('bdi', {dir: 'ltr'}, isAction ? lane.topic.slice(0, -'/goal'.length) : lane.topic)),
      element('small', {class: 'soft'}, lane.count)];
    if (!onTopic) return element('div', {class: `topic ${lane.role}`, title: words}, inside);
    return button(inside, () => onTopic(lane.topic), {class: `topic ${lane.role}`, title: words,
      'aria-pressed': 'false', 'data-topic': lane.topic});
  }

  /** Marks the topic whose messages are shown. */
  choose(topic) {
    this.chosen = topic;
    for (const one of this.topics.querySelectorAll('[data-topic]')) {
      one.setAttribute('aria-pressed', one.dataset.topic === topic ? 'true' : 'false');
    }
  }

  x(seconds) {
    const {from, to} = this.moment.range;
    return to > from ? ((seconds - from) / (to - from)) * this.width : 0;
  }

  draw() {
    this.width = this.plot.clientWidth;
    if (this.width < 10) return;
    this.high = this.topics.querySelector('.topic')?.offsetHeight || BAR;
    const height = AXIS + this.lanes.length * this.high;
    const ticks = [];
    const {from, to} = this.moment.range;
    const step = tickStep(to - from, this.width);
    for (let at = Math.ceil(from / step) * step; at <= to; at += step) {
      const x = this.x(at);
      ticks.push(drawn('line', {class: 'tick', x1: x, x2: x, y1: 18, y2: height}));
      if (x < this.width - 30) {
        ticks.push(drawn('text', {class: 'tick-text', x: x + 3, y: 13},
          step < 1 ? at.toFixed(1) : at < 60 ? Math.round(at) : offset(at).replace(/\.0$/, '')));
      }
    }
    this.head.setAttribute('y2', height);
    this.span.setAttribute('height', height);
    refill(this.plot, drawn('svg', {width: this.width, height, viewBox: `0 0 ${this.width} ${height}`,
      'aria-hidden': 'true'}, ticks, this.lanes.map((lane, at) => this.lane(lane, AXIS + at * this.high)),
    this.span, this.head));
    this.stand(this.moment.seconds);
  }

  lane(lane, y) {
    const group = drawn('g', {class: `lane ${lane.role}`, transform: `translate(0 ${y + (this.high - BAR) / 2})`},
      drawn('line', {class: 'rule', x1: 0, x2: this.width, y1: (this.high + BAR) / 2, y2: (this.high + BAR) / 2}));
    const {from, to} = this.moment.range;
    const goals = (lane.spans || []).filter((span) => span.from <= to && this.end(span) >= from);
    if (lane.role === 'speech' && this.said.length) return put(group, this.speech());
    if (lane.marks?.length) {
      const tall = goals.length ? '20v5' : '7v14';
      const path = lane.marks.map((t) => `M${this.x(t).toFixed(1)} ${tall}`);
      group.append(drawn('path', {class: 'marks', d: path.join('')}));
    }
    const runs = folded(goals, ({text}) => withoutNumbers(text));
    return put(group, runs.map((run, at) => this.goals(run, runs[at + 1])));
  }

  /** Goals that ended alike: each where it was, with one name for them all, which may stand beside them. */
  goals({first, last, times, all}, next) {
    const from = Math.max(this.x(first.from), 0);
    const room = (next ? this.x(next.first.from) : this.width) - from - 8;
    const inside = Math.min(this.x(this.end(last)), this.width) - from - 8;
    const ended = first.outcome || 'no result';
    const short = times > 1 ? count(times, 'goal') : first.text.split(':')[0];
    const words = times > 1 ? `${short}: ${ended}` : first.text;
    const name = fits(words, inside) ? words : fits(short, room) ? short : '';
    return drawn('g', {class: `goal ${first.look}`},
      drawn('title', {}, times > 1 ? `${words}, in ${duration(this.end(last) - first.from)}` : this.told(first)),
      all.map((span) => this.bar(span)), drawn('text', {x: from + 4, y: 15}, name));
  }

  end(span) {
    return span.to ?? this.moment.length;
  }

  told(span) {
    return `${span.text}, ${span.to === null || span.to === undefined ? 'no result' : duration(span.to - span.from)}`;
  }

  bar(span) {
    const from = this.x(span.from);
    return drawn('rect', {x: from, y: 4, width: Math.max(this.x(this.end(span)) - from, 3), height: 15, rx: 3},
      drawn('title', {}, this.told(span)));
  }

  speech() {
    const {from: begin} = this.moment.range;
    const runs = folded(this.said, ({text}) => text)
      .filter((_, at, all) => at + 1 === all.length || all[at + 1].first.t > begin);
    return runs.map(({first, times, all}, at) => {
      const from = Math.max(this.x(first.t), 0);
      const room = (at + 1 < runs.length ? this.x(runs[at + 1].first.t) : this.width) - from;
      const words = times > 1 ? `${count(times, 'time')}: ${first.text}` : first.text;
      return drawn('g', {class: 'saying'}, drawn('title', {}, words),
        drawn('path', {class: 'marks', d: all.map(({t}) => `M${this.x(t).toFixed(1)} 5v18`).join('')}),
        drawn('text', {x: from + 5, y: 18}, shortened(words, room - 10)));
    });
  }

  stand(seconds) {
    this.slider.setAttribute('aria-valuenow', seconds.toFixed(2));
    this.slider.setAttribute('aria-valuetext', `${offset(seconds)} of ${duration(this.moment.length)}`);
    const x = this.width ? this.x(seconds) : 0;
    this.head.setAttribute('x1', x);
    this.head.setAttribute('x2', x);
    this.head.setAttribute('y1', 0);
  }

  pressed(event) {
    const {seconds, length} = this.moment;
    const step = event.shiftKey ? 1 : STEP;
    const to = {ArrowLeft: seconds - step, ArrowRight: seconds + step, ArrowDown: seconds - step,
      ArrowUp: seconds + step, PageDown: seconds - length / 10, PageUp: seconds + length / 10,
      Home: 0, End: length}[event.key];
    if (to === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    this.moment.pause();
    this.moment.set(to);
  }

  grabbed(event) {
    if (event.button !== 0) return;
    this.slider.setPointerCapture(event.pointerId);
    this.moment.pause();
    const {from, to} = this.moment.range;
    const share = (event.clientX - this.plot.getBoundingClientRect().left) / this.width;
    this.from = event.shiftKey ? from + share * (to - from) : null;
    this.dragged(event);
  }

  dragged(event) {
    if (!(event.buttons & 1) || !this.width) return;
    const left = this.plot.getBoundingClientRect().left;
    const {from, to} = this.moment.range;
    const seconds = from + Math.min(Math.max((event.clientX - left) / this.width, 0), 1) * (to - from);
    if (this.from === null) this.moment.set(seconds);
    else this.choosing(this.from, seconds);
  }

  /** With Shift, dragging chooses a range. */
  choosing(a, b) {
    this.wanted = {from: Math.min(a, b), to: Math.max(a, b)};
    this.span.setAttribute('x', this.x(this.wanted.from));
    this.span.setAttribute('width', this.x(this.wanted.to) - this.x(this.wanted.from));
  }

  dropped() {
    const {wanted} = this;
    this.from = this.wanted = null;
    this.span.setAttribute('width', 0);
    if (wanted) this.moment.setRange(wanted);
  }

  close() {
    this.watch.disconnect();
  }
}
