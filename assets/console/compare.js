/** Two behaviors side by side, in step: the same time since their beginnings, with what differs marked. */

import {get} from './api.js';
import {heading} from './behavior.js';
import {button, element, put, refill, table} from './dom.js';
import {andMore, duration, folded, offset, plain, sameInStory} from './format.js';
import {Lanes} from './lanes.js';
import {Moment} from './moment.js';
import {follow, noPictures, Picture} from './pictures.js';
import {goToLight} from './thumbnails.js';
import {Transport} from './transport.js';

export class CompareView {
  constructor(view, shell) {
    this.shell = shell;
    this.route = shell.route;
    this.parts = [];
    this.abort = new AbortController();
    this.place = element('article', {class: 'compared'}, element('p', {class: 'soft'}, 'Loading…'));
    put(view, this.place);
    this.reload();
  }

  async reload() {
    const [a, b] = this.route.now.ids;
    const {signal} = this.abort;
    try {
      const [one, other] =
          await Promise.all([a, b].map((id) => get(`/api/behaviors/${id}`, {}, signal)));
      // The server reads each once, as long as nobody asks for it twice at a time.
      this.build(one, other, await get('/api/compare', {a, b}, signal));
    } catch (problem) {
      if (problem.name === 'AbortError' || this.moment) return;
      refill(this.place, element('h1', {}, `#${a} and #${b}`), element('p', {class: 'note bad'}, problem.message));
    }
  }

  build(one, other, differences) {
    this.closeParts();
    document.title = `#${one.id} and #${other.id} · Afterglow`;
    const moment = this.moment = new Moment(Math.max(one.duration || 0, other.duration || 0),
      Number(this.route.now.params.t) || 0);
    this.transport = new Transport(moment);
    this.parts = [moment];
    this.pictures = element('div', {class: 'pictures'});
    this.behaviors = [one, other];
    const why = this.shell.whyNoPictures;
    this.lit = why || this.route.now.params.t !== undefined ?
        null :
        goToLight([one.id, other.id], moment, this.abort.signal);
    refill(this.place,
      element('h1', {}, one.name === other.name ? `${one.name}, twice` : `${one.name} and ${other.name}`),
      element('p', {class: 'under'}, this.summary(one, other)),
      element('div', {class: 'actions'}, button('Swap sides',
        () => this.route.open('compare', [other.id, one.id])), !why && this.views()),
      element('div', {class: 'sides'}, this.side(one), this.side(other)), why ? noPictures(why) : this.pictures,
      this.transport.place, this.lanesOf(one, moment), this.lanesOf(other, moment),
      this.story(differences.story || []), this.topics(differences.topics || []),
      this.parameters(differences.parameters || []));
    if (!why) this.look(this.route.now.params.view === 'projector' ? 'projector' : 'bystander');
  }

  summary(one, other) {
    const longer = Math.abs(one.duration - other.duration);
    const said = one.outcome === other.outcome ? `Both ended as ${one.outcome}. ` :
      `The left one ended as ${one.outcome}, the right one as ${other.outcome}. `;
    if (longer < 0.05) return `${said}They took equally long.`;
    return `${said}The ${one.duration > other.duration ? 'left' : 'right'} one took ${duration(longer)} longer.`;
  }

  side(one) {
    return element('section', {class: 'side'}, heading(one, 'h2'),
      element('p', {}, element('a', {href: this.route.to('behavior', [one.id])}, 'Open alone')));
  }

  /** Which of the two pictures is shown for each side. */
  views() {
    this.choices = ['bystander', 'projector'].map((view) => button(
      view === 'bystander' ? 'The room' : 'The projector', () => this.look(view),
      {'data-look': view, 'aria-pressed': 'false'}));
    return element('div', {class: 'choice', role: 'group', 'aria-label': 'Picture'}, this.choices);
  }

  look(view) {
    for (const choice of this.choices) {
      choice.setAttribute('aria-pressed', choice.dataset.look === view ? 'true' : 'false');
    }
    this.parts.filter((part) => part instanceof Picture).forEach((part) => part.close());
    this.parts = this.parts.filter((part) => !(part instanceof Picture));
    const shown = this.behaviors.map((one) => new Picture(one.id, view,
      {title: `#${one.id} ${one.name}`, limit: one.duration, tellsDark: true}));
    this.parts.push(...shown);
    refill(this.pictures, shown.map((picture) => picture.place));
    follow(shown, this.moment, this.lit);
    this.route.keep({view: view === 'bystander' ? undefined : view});
  }

  lanesOf(one, moment) {
    const lanes = new Lanes(one.lanes || [], one.said, moment, {label: `Moment of #${one.id} ${one.name}`});
    this.parts.push(lanes);
    return element('section', {class: 'lanes-of'}, element('h2', {}, `#${one.id} ${one.name}`), lanes.place);
  }

  story(lines) {
    if (!lines.length) return null;
    const when = (one) => (one ? button(offset(one.t), () => this.moment.set(one.t), {class: 'at'}) : '–');
    const text = ({a, b}) => (a && b && a.text !== b.text ? [a.text, element('br'), b.text] : (a || b).text);
    const [left, right] = this.behaviors;
    const same = ({a, b, differs}) => {
      const told = [a, b].filter(Boolean).map(sameInStory);
      return told.includes(null) ? null : [Boolean(a), Boolean(b), differs, ...told].join(' ');
    };
    const rows = folded(lines, same).map(({first: line, times}) => ({class: line.differs ? 'differs' : null, cells: [
      when(line.a), [text(line), andMore(times)], when(line.b),
      !line.a ? 'only right' : !line.b ? 'only left' : this.later(line)]}));
    return element('section', {}, element('h2', {}, 'Both stories'), table('Both stories',
      [`#${left.id}`, 'what happened', `#${right.id}`, 'difference'], rows));
  }

  later(line) {
    const late = line.b.t - line.a.t;
    if (Math.abs(late) < 0.1) return '';
    return `${duration(Math.abs(late))} ${late > 0 ? 'later' : 'earlier'} on the right`;
  }

  topics(topics) {
    if (!topics.length) return null;
    return element('section', {}, element('h2', {}, 'Topics'), table('Messages by topic',
      ['topic', `#${this.behaviors[0].id}`, `#${this.behaviors[1].id}`, 'difference'],
      topics.map((topic) => ({class: topic.differs ? 'differs' : null, cells: [topic.topic,
        topic.a || '–', topic.b || '–', !topic.a ? 'only right' : !topic.b ? 'only left' :
          topic.a === topic.b ? '' : `${topic.b > topic.a ? '+' : ''}${topic.b - topic.a}`]})), [1, 2]));
  }

  parameters(parameters) {
    if (!parameters.length) return null;
    return element('section', {}, element('h2', {}, 'Parameters'), table('Parameters',
      ['parameter', `#${this.behaviors[0].id}`, `#${this.behaviors[1].id}`, 'difference'],
      parameters.map((one) => ({class: one.differs ? 'differs' : null,
        cells: [one.key, plain(one.a), plain(one.b), one.differs ? 'differs' : '']}))));
  }

  follow(now) {
    if (this.moment && now.params.t !== undefined) this.moment.set(Number(now.params.t) || 0);
  }

  closeParts() {
    for (const part of this.parts) part.close();
    this.parts = [];
  }

  close() {
    this.abort.abort();
    this.closeParts();
  }
}
