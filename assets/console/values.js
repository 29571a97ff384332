/** What a topic says: its numbers over time as a plot, and its newest message at the moment, a line a field. */

import {get, Latest} from './api.js';
import {element, refill} from './dom.js';
import {offset, plain} from './format.js';
import {ValuePlot} from './value_plot.js';

const MOST_LINES = 400;

/** [path, value] of every leaf, in order; `lines` is filled up to MOST_LINES. */
export function flattened(value, path = '', lines = []) {
  if (lines.length >= MOST_LINES) return lines;
  const isShortList = Array.isArray(value) && value.every((one) => typeof one !== 'object') && value.length <= 16;
  if (value === null || typeof value !== 'object' || isShortList) {
    lines.push([path, isShortList ? `[${value.map(plain).join(', ')}]` : plain(value)]);
    return lines;
  }
  const entries = Array.isArray(value) ? value.map((one, at) => [`[${at}]`, one]) :
    Object.entries(value).map(([key, one]) => [path ? `.${key}` : key, one]);
  if (!entries.length) lines.push([path, Array.isArray(value) ? '[]' : '{}']);
  for (const [key, one] of entries) flattened(one, path + key, lines);
  return lines;
}

export class Values {
  /** @param {number} id of the behavior @param {Array} lanes @param {Moment} moment */
  constructor(id, lanes, moment, onTopic) {
    this.id = id;
    this.lanes = lanes;
    this.moment = moment;
    this.select = element('select', {id: 'values-topic', on: {change: () => onTopic(this.select.value)}},
      lanes.map((lane) => element('option', {value: lane.topic}, lane.topic)));
    this.plot = new ValuePlot(id, moment);
    this.under = element('p', {class: 'soft'});
    this.body = element('tbody', {});
    this.place = element('section', {class: 'values'}, element('h2', {}, 'Values'),
      element('label', {for: 'values-topic', class: 'unseen'}, 'Topic'), this.select, this.plot.place, this.under,
      element('div', {class: 'scrolls tall', tabindex: 0, role: 'region', 'aria-label': 'Values of the message'},
        element('table', {class: 'fields-table'}, element('thead', {class: 'unseen'}, element('tr', {},
          element('th', {scope: 'col'}, 'field'), element('th', {scope: 'col'}, 'value'))), this.body)));
    this.loader = new Latest((wanted, signal) => this.load(wanted, signal));
    this.place.hidden = !lanes.length;
    moment.follow((seconds) => this.at(seconds));
  }

  get topic() {
    return this.select.value;
  }

  choose(topic) {
    this.select.value = topic;
    this.plot.choose(topic);
    this.at(this.moment.seconds);
  }

  at(seconds) {
    if (this.topic) this.loader.want({topic: this.topic, t: seconds});
  }

  /** Which message is the newest then, as far as the lane tells: the same word for the same message. */
  newest(lane, t) {
    if (!lane) return `${t}`;
    if (t >= lane.last) return `${lane.topic} last`;
    if (lane.marks?.length !== lane.count) return `${lane.topic} ${t}`;
    return `${lane.topic} ${lane.marks.filter((mark) => mark <= t).length}`;
  }

  async load({topic, t: exactly}, signal) {
    const lane = this.lanes.find((one) => one.topic === topic);
    const t = Number(exactly.toFixed(6));
    const newest = this.newest(lane, t);
    if (newest === this.shown) return;
    this.shown = null;
    if (lane && lane.first > t) {
      this.say(`${lane.type}: its first message comes at ${offset(lane.first)}`, []);
      return;
    }
    try {
      const told = await get(`/api/behaviors/${this.id}/message`, {topic, t: t.toFixed(6)}, signal);
      this.say(told.problem || `${told.type}, of ${offset(told.t)}`, told.value ? flattened(told.value) : []);
      this.shown = newest;
    } catch (problem) {
      if (problem.name !== 'AbortError') this.say(problem.message, []);
    }
  }

  say(words, lines) {
    this.under.textContent = words;
    const rows = this.body.rows;
    const same = rows.length === lines.length && lines.every(([path], at) => rows[at].dataset.path === path);
    if (same) {  // the usual case while scrubbing: only the values differ
      lines.forEach(([, value], at) => {
        const cell = rows[at].cells[1];
        if (cell.textContent !== value) cell.textContent = value;
      });
      return;
    }
    refill(this.body, lines.map(([path, value]) => element('tr', {'data-path': path},
      element('th', {scope: 'row'}, path), element('td', {}, value))));
    if (lines.length >= MOST_LINES) {
      this.body.append(element('tr', {}, element('td', {colspan: 2}, 'The rest is left out.')));
    }
  }

  close() {
    this.plot.close();
    this.loader.close();
  }
}
