/** Finding: the search field, its filters and the list of what matches. */

import {get} from './api.js';
import {button, element, put, refill} from './dom.js';
import {count, duration, friendlyTime, localTime} from './format.js';
import {KEPT} from './route.js';
import {Thumbnails} from './thumbnails.js';
import {VirtualList} from './virtual_list.js';

const ROW_HEIGHT = 68;  // px, as style.css has it
const DAY_MS = 86400000;
const OUTCOMES = ['success', 'failure', 'exception', 'halted'];

export class Finder {
  /** @param {HTMLElement} place @param {Route} route @param {Notice} notice */
  constructor(place, route, notice) {
    this.route = route;
    this.notice = notice;
    this.asked = null;
    this.today = '';
    this.compareWith = null;
    this.thumbnails = new Thumbnails();
    this.input = element('input', {type: 'search', id: 'search', placeholder: 'Search: pick, dropped, gear…',
      autocomplete: 'off', spellcheck: 'false', 'aria-describedby': 'matching',
      on: {input: () => route.search({q: this.input.value}), keydown: (event) => this.pressed(event)}});
    this.matching = element('p', {id: 'matching', class: 'matching', role: 'status'});
    this.choosing = element('p', {class: 'choosing', hidden: true});
    this.none = element(
        'p', {class: 'matching', hidden: true}, button('Show all behaviors', () => this.clear()));
    this.filters = this.makeFilters();
    this.scroller = element('div', {class: 'scroller', tabindex: -1});
    put(place, element('h1', {class: 'unseen'}, 'Behaviors'), element('div', {class: 'search'},
      element('label', {for: 'search', class: 'unseen'}, 'Search behaviors'), this.input, this.filters),
    this.matching, this.none, this.choosing, this.scroller);
    this.list = new VirtualList(this.scroller, {rowHeight: ROW_HEIGHT, key: (one) => one.id,
      load: (after, limit, signal) => this.load(after, limit, signal),
      draw: (one, row) => this.draw(one, row)});
  }

  makeFilters() {
    const select = (key, label, options) => {
      const made = element('select', {id: `filter-${key}`,
        on: {change: () => this.route.search({[key]: made.value})}}, options);
      return [element('label', {for: made.id}, label), made];
    };
    this.names = element('optgroup', {label: 'Behaviors'});
    this.day = element('input', {type: 'date', id: 'filter-day',
      on: {change: () => this.route.search({day: this.day.value})}});
    this.where = element('input', {type: 'text', id: 'filter-where', spellcheck: 'false', autocomplete: 'off',
      placeholder: '{"/cmd_vel": {"linear.x": {"$gt": 0.5}}}',
      on: {change: () => this.route.search({where: this.where.value})}});
    return element('details', {class: 'filters'}, element('summary', {}, 'Filters'),
      element('div', {class: 'fields'},
        select('name', 'Name', [element('option', {value: ''}, 'any'), this.names]),
        select('outcome', 'Outcome', [element('option', {value: ''}, 'any'),
          OUTCOMES.map((one) => element('option', {value: one}, one))]),
        element('label', {for: 'filter-day'}, 'Day'), this.day,
        element('label', {for: 'filter-where'}, 'Messages'), this.where,
        button('Clear', () => this.clear(), {class: 'wide'})));
  }

  /** What the store holds has been told, or has changed. */
  about(about) {
    this.today = about.today;
    this.thumbnails.turn(about.can_render !== false);
    this.list.refresh();
    refill(this.names, Object.entries(about.names || {}).map(
      ([name, many]) => element('option', {value: name}, `${name} (${many})`)));
    this.showFilters();
  }

  /** What is looked for or shown has changed. */
  follow(now) {
    if (this.input.value !== (now.params.q || '')) this.input.value = now.params.q || '';
    this.showFilters();
    const asked = JSON.stringify(KEPT.map((key) => now.params[key] || ''));
    if (asked !== this.asked) {
      this.asked = asked;
      this.reload();
    } else {
      this.list.refresh();
    }
  }

  showFilters() {
    const {params} = this.route.now;
    for (const key of ['name', 'outcome']) {
      this.filters.querySelector(`#filter-${key}`).value = params[key] || '';
    }
    this.day.value = params.day || '';
    if (document.activeElement !== this.where) this.where.value = params.where || '';
    const used = KEPT.filter((key) => !['q', 'until'].includes(key) && params[key]);
    this.filters.querySelector('summary').textContent = used.length ? `Filters (${used.length})` : 'Filters';
  }

  /** The search as the server takes it: a day, before a range, is one of the robot's, wherever the browser is. */
  async query() {
    const {q, name, outcome, day, since, until, where} = this.route.now.params;
    if (!day) return {q, name, outcome, where, from: since, to: until};
    if (!this.zones) await this.days();
    const from = Date.parse(`${day}T00:00:00${this.zones.get(day) ?? ''}`);
    const ns = (ms) => `${ms}000000`;
    return Number.isNaN(from) ? {q, name, outcome, where} :
      {q, name, outcome, where, from: ns(from), to: ns(from + DAY_MS)};
  }

  /** The calendar's days, whose zones a day's search needs. */
  async days(signal) {
    const days = await get('/api/calendar', {}, signal);
    this.zones = new Map(days.map((one) => [one.day, one.zone]));
    return days;
  }

  /** Loads anew; `stay`: without scrolling, as something was recorded meanwhile. */
  async reload(stay = false) {
    try {
      await this.list.reload(stay);
    } catch (problem) {
      if (problem.name !== 'AbortError') this.say(problem.message, true);
    }
  }

  async load(after, limit, signal) {
    const answer = await get('/api/behaviors', {...await this.query(), before: after?.id, limit}, signal);
    this.say(answer.matching === answer.total ? count(answer.total, 'behavior') :
      `${count(answer.matching, 'behavior')} of ${answer.total.toLocaleString('en-US')}`);
    this.none.hidden = answer.matching > 0 || answer.total === 0;
    return {total: answer.matching, rows: answer.behaviors};
  }

  say(words, isBad = false) {
    this.matching.textContent = words;
    this.matching.classList.toggle('bad', isBad);
  }

  /** A step that the back key undoes: a filter may have been long to write. */
  clear() {
    this.route.clear();
    this.input.focus();
  }

  /** The next one that is clicked is compared with this one; null: is opened again. */
  chooseFor(behavior) {
    this.compareWith = behavior;
    this.choosing.hidden = !behavior;
    document.body.toggleAttribute('data-choosing', Boolean(behavior));  // on a phone the list comes back
    refill(this.choosing, behavior && [`Choose what to compare #${behavior.id} ${behavior.name} with. `,
      button('Cancel', () => this.chooseFor(null))]);
    this.list.refresh();
    if (behavior) this.input.focus();
  }

  draw(one, row) {
    const shown = this.route.now.ids.includes(one.id);
    const {compareWith} = this;
    row.href = compareWith && compareWith.id !== one.id ?
      this.route.to('compare', [compareWith.id, one.id]) : this.route.to('behavior', [one.id]);
    row.className = `row ${one.look}`;
    if (shown) row.setAttribute('aria-current', 'page');
    else row.removeAttribute('aria-current');
    const said = (one.said || [])[0];
    refill(row, this.thumbnails.of(one), element('span', {class: 'told'},
      element('span', {class: 'line'}, element('b', {class: 'name'}, one.name),
        element('span', {class: `pill ${one.look}`}, one.outcome || 'open')),
      element('span', {class: 'line soft'},
        element('span', {class: 'when'}, `${friendlyTime(localTime(one), this.today)} · ${duration(one.duration)}`,
          one.attempt > 1 && ` · attempt ${one.attempt}`),
        element('span', {class: 'id'}, `#${one.id}`)),
      element('span', {class: 'line quote'},
        said ? `“${said}”` : (one.tags || []).join(', ') || one.tree_path || '')));
  }

  pressed(event) {
    if (event.key === 'ArrowDown') {
      event.preventDefault();
      this.list.focus(Math.floor(this.scroller.scrollTop / ROW_HEIGHT));
    }
    if (event.key === 'Enter' && this.list.item(0)) {
      location.hash = this.list.shown.get(0)?.hash || this.route.to('behavior', [this.list.item(0).id]);
    }
    if (event.key === 'Escape' && this.compareWith) this.chooseFor(null);
  }

  /** The behavior `step` rows below (or above) the one that is shown. */
  beside(id, step) {
    const at = this.list.find(id);
    return this.list.item(at < 0 ? 0 : at + step);
  }
}
