/** A calendar of what was recorded: how much on a day, and how much of it failed. */

import {button, element, refill} from './dom.js';
import {count} from './format.js';

const DAYS = ['Mo', 'Tu', 'We', 'Th', 'Fr', 'Sa', 'Su'];
const MONTHS = ['January', 'February', 'March', 'April', 'May', 'June', 'July', 'August', 'September',
  'October', 'November', 'December'];

/** Months as one number each, so that one can count. */
const monthOf = (day) => Number(day.slice(0, 4)) * 12 + Number(day.slice(5, 7)) - 1;

/** How many months are shown: on a phone one, or the newest would be far below. */
const monthsShown = () => (window.matchMedia('(max-width: 760px)').matches ? 1 : 3);

export class Calendar {
  /** @param {function(string)} onDay called with a day, "2026-11-23", or '' */
  constructor(onDay) {
    this.onDay = onDay;
    this.days = new Map();
    this.chosen = '';
    this.last = null;
    this.months = element('div', {class: 'months'});
    this.earlier = button('Earlier', () => this.turn(-1));
    this.later = button('Later', () => this.turn(1));
    this.place = element('section', {class: 'calendar'},
      element('header', {class: 'bar'}, element('h2', {}, 'Calendar'), this.earlier, this.later), this.months);
  }

  /** @param {Array<{day, count, failed}>} days */
  show(days, chosen) {
    this.days = new Map(days.map((one) => [one.day, one]));
    this.chosen = chosen || '';
    const known = [...this.days.keys()].sort();
    this.first = known.length ? monthOf(known[0]) : null;
    this.end = known.length ? monthOf(known[known.length - 1]) : null;
    if (this.last === null || this.last > this.end) this.last = this.end;
    if (this.chosen && monthOf(this.chosen) <= this.last - monthsShown()) this.last = monthOf(this.chosen);
    this.draw();
  }

  choose(day) {
    this.chosen = day || '';
    this.draw();
  }

  turn(by) {
    this.last += by;
    this.draw();
  }

  draw() {
    if (this.last === null) {
      refill(this.months, element('p', {class: 'soft'}, 'Nothing has been recorded yet.'));
      this.earlier.hidden = this.later.hidden = true;
      return;
    }
    const from = Math.max(this.last - monthsShown() + 1, Math.min(this.first, this.last));
    this.earlier.disabled = from <= this.first;
    this.later.disabled = this.last >= this.end;
    this.earlier.hidden = this.later.hidden = this.earlier.disabled && this.later.disabled;
    const most = Math.max(1, ...[...this.days.values()].map((one) => one.count));
    const shown = [];
    for (let month = from; month <= this.last; month++) shown.push(this.month(month, most));
    refill(this.months, shown);
  }

  month(month, most) {
    const year = Math.floor(month / 12);
    const before = (new Date(Date.UTC(year, month % 12, 1)).getUTCDay() + 6) % 7;
    const length = new Date(Date.UTC(year, (month % 12) + 1, 0)).getUTCDate();
    const cells = Array.from({length: before}, () => element('span', {}));
    for (let day = 1; day <= length; day++) {
      const name = `${year}-${String((month % 12) + 1).padStart(2, '0')}-${String(day).padStart(2, '0')}`;
      cells.push(this.day(name, day, most));
    }
    return element('section', {class: 'month', 'aria-label': `${MONTHS[month % 12]} ${year}`},
      element('h3', {}, `${MONTHS[month % 12]} ${year}`),
      element('div', {class: 'week-days', 'aria-hidden': 'true'}, DAYS.map((one) => element('span', {}, one))),
      element('div', {class: 'days'}, cells));
  }

  day(name, number, most) {
    const told = this.days.get(name);
    if (!told) return element('span', {class: 'day empty'}, number);
    const level = Math.min(4, 1 + Math.floor((4 * (told.count - 1)) / most));
    const words = `${name}: ${count(told.count, 'behavior')}` + (told.failed ? `, ${told.failed} failed` : '');
    return button([element('span', {class: 'number'}, number), element('small', {}, told.count)],
      () => this.onDay(name === this.chosen ? '' : name),
      {class: `day level-${level}${told.failed ? ' failed' : ''}`, title: words, 'aria-label': words,
        'aria-pressed': name === this.chosen ? 'true' : 'false'});
  }
}
