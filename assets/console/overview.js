/** What is shown while no behavior is: calendar and timeline of what the search finds. */

import {get} from './api.js';
import {Calendar} from './calendar.js';
import {button, element, put} from './dom.js';
import {count, localTime} from './format.js';
import {Timeline} from './timeline.js';

const MOST = 500;  // bars

export class Overview {
  constructor(view, {route, finder}) {
    this.route = route;
    this.finder = finder;
    this.abort = new AbortController();
    this.calendar = new Calendar((day) => route.search({day, since: '', until: ''}));
    this.timeline = new Timeline(route);
    this.whole = button('Whole time', () => route.search({since: '', until: ''}), {class: 'whole-range', hidden: true});
    this.problem = element('p', {class: 'note bad', hidden: true});
    put(view, element('div', {class: 'overview'}, element('h1', {}, 'What was done, and when'),
      element('p', {class: 'under'}, 'Choose a behavior of the list, a day, or a bar; dragging on the timeline chooses a range.'),
      this.problem, this.calendar.place, this.timeline.place, this.whole));
    this.reload();
  }

  /** The search has changed. */
  follow() {
    this.reload();
  }

  async reload() {
    this.abort.abort();
    this.abort = new AbortController();
    const {signal} = this.abort;
    const {day, since, until} = this.route.now.params;
    this.calendar.choose(day);
    try {
      const [calendar, found] = await Promise.all([
        this.finder.days(signal),
        get('/api/behaviors', {...await this.finder.query(), limit: MOST}, signal)]);
      if (signal.aborted) return;
      this.calendar.show(calendar, day);
      const shown = found.behaviors.length;
      this.timeline.show(found.behaviors, (shown < found.matching ?
        `The newest ${shown} of ${count(found.matching, 'behavior')}` : count(shown, 'behavior')) +
        (day ? ` of ${day}` : since ? `, ${localTime({begin: since})} to ${localTime({begin: until})}` : ''));
      this.whole.hidden = !since;
      this.problem.hidden = true;
    } catch (problem) {
      if (problem.name === 'AbortError') return;
      this.problem.textContent = problem.message;
      this.problem.hidden = false;
    }
  }

  close() {
    this.abort.abort();
    this.timeline.close();
  }
}
