/** One behavior: what happened in words, in pictures and topic by topic, all at the moment that one drags to. */

import {get} from './api.js';
import {button, element, put, refill, table} from './dom.js';
import {andMore, count, duration, folded, foxglove, localTime, plain} from './format.js';
import {Lanes} from './lanes.js';
import {Moment} from './moment.js';
import {KeyMoments, noPictures, Pictures} from './pictures.js';
import {Sound} from './sound.js';
import {Story} from './story.js';
import {goToLight} from './thumbnails.js';
import {Transport} from './transport.js';
import {Values} from './values.js';

const KEEP_MS = 250;  // how seldom the address is told of the moment

/** "pick success #12 2026-11-23 12:03:20 ...": what every view of a behavior begins with. */
export function heading(one, level = 'h1') {
  return [element(level, {class: 'title'}, one.name, ' ',
    element('span', {class: `pill ${one.look}`}, one.outcome || 'open')),
  element('p', {class: 'under'}, [`#${one.id}`, localTime(one), duration(one.duration),
    count(one.messages, 'message'), one.attempt > 1 && `attempt ${one.attempt}`]
    .filter(Boolean).join(' · '))];
}

export class BehaviorView {
  constructor(view, shell) {
    this.shell = shell;
    this.route = shell.route;
    this.id = this.route.now.ids[0];
    this.parts = [];
    this.abort = new AbortController();
    this.place = element('article', {class: 'behavior'}, element('p', {class: 'soft'}, 'Loading…'));
    put(view, this.place);
    this.reload();
  }

  async reload() {
    try {
      const told = await get(`/api/behaviors/${this.id}`, {}, this.abort.signal);
      this.build(told);
    } catch (problem) {
      if (problem.name === 'AbortError') return;
      if (this.moment) return;  // what is shown stays; the notice says that nobody answers
      refill(this.place, element('h1', {}, `Behavior #${this.id}`),
        element('p', {class: 'note bad'}, problem.message),
        element('p', {}, element('a', {href: this.route.to('find')}, 'All behaviors')));
    }
  }

  build(one) {
    this.closeParts();
    this.behavior = one;
    document.title = `${one.name} #${one.id} · Afterglow`;
    const {params} = this.route.now;
    const moment = this.moment = new Moment(one.duration || 0, Number(params.t) || 0);
    this.look(params);
    const story = this.story = new Story(one.story || [], moment);
    const why = this.shell.whyNoPictures;
    const lit =
        why || params.t !== undefined ? null : goToLight([one.id], moment, this.abort.signal);
    const pictures = why ? null : new Pictures(one.id, moment, lit);
    const sound = new Sound(one.id, one.said || [], moment);
    const lanes = new Lanes(one.lanes || [], one.said, moment, {label: `Moment of ${one.name}`,
      onTopic: (topic) => this.choose(topic)});
    const values = new Values(one.id, one.lanes || [], moment, (topic) => this.choose(topic));
    const keys = why ? null : new KeyMoments(one.id, one.key_moments || [], moment, lit);
    this.lanes = lanes;
    this.values = values;
    this.transport = new Transport(moment, story, sound);
    this.parts = [moment, sound, pictures, lanes, values, keys].filter(Boolean);
    refill(this.place,
      element('header', {}, element('div', {}, heading(one), this.labels(one)), this.actions(one)),
      this.remarks(one), pictures ? pictures.place : noPictures(why), this.transport.place, lanes.place,
      element('div', {class: 'columns'}, story.place, values.place),
      keys?.place, this.parameters(one), this.relatives(one));
    this.choose(this.route.now.params.topic || one.lanes?.[0]?.topic);
    moment.follow((seconds) => this.keep(seconds));
    moment.followRange(({from, to}) => this.route.keep(moment.isWhole ? {from: undefined, to: undefined} :
      {from: from.toFixed(2), to: to.toFixed(2)}));
  }

  /** The part of the time that the address names. */
  look({from, to}) {
    const range = {from: Number(from), to: Number(to)};
    this.moment.setRange(Number.isFinite(range.from) && Number.isFinite(range.to) ? range : null);
  }

  labels(one) {
    if (!one.tree_path && !one.tags?.length) return null;
    return element('p', {class: 'labels'}, one.tree_path && element('span', {class: 'soft'}, one.tree_path),
      (one.tags || []).map((tag) => element('span', {class: 'tag'}, tag)));
  }

  actions(one) {
    const {hasRobot, needsToken} = this.shell;
    const here = () => foxglove(`behavior/${one.id}?t=${this.moment.seconds.toFixed(2)}`);
    return element(
        'div', {class: 'actions'},
        hasRobot &&
            element(
                'a', {class: 'button main-action', href: this.route.to('replay', [one.id])},
                'Replay…'),
        button('Copy link', () => this.copyLink(), {title: 'A link to this moment'}),
        button('Compare with…', () => this.shell.chooseFor(one), {id: 'compare'}),
        element(
            'a', {
              class: 'button',
              href: `/api/behaviors/${one.id}/file`,
              download: `behavior_${one.id}.html`,
              title: 'One file with story and pictures, to mail to somebody'
            },
            'Share as a file'),
        !needsToken &&
            element(
                'a', {
                  class: 'button',
                  href: here(),
                  title: 'Open it in Foxglove, at this moment',
                  on: {click: ({currentTarget}) => currentTarget.setAttribute('href', here())}
                },
                'Foxglove'));
  }

  /** Browsers give the clipboard only to pages that are encrypted, or of this machine. */
  async copyLink() {
    this.tellAddress();
    try {
      await navigator.clipboard.writeText(location.href);
      this.shell.notice.tell('A link to this moment was copied.');
    } catch {
      this.shell.notice.tell(`The link to this moment: ${location.href}`);
    }
  }

  /** What the recorder has to say of it, and what people noted. */
  remarks(one) {
    const lines = [one.remarks, one.notes].flat().filter(Boolean);
    return lines.length ? element('div', {class: 'note'}, element('ul', {}, folded(lines.map(plain), (line) => line)
      .map(({first, times}) => element('li', {}, first, andMore(times))))) : null;
  }

  parameters(one) {
    const entries = Object.entries(one.parameters || {});
    return entries.length ? element('section', {}, element('h2', {}, 'Parameters'),
      table('Parameters', ['parameter', 'value'], entries.map(
        ([key, value]) => ({cells: [key, plain(value)]})))) : null;
  }

  relatives(one) {
    const line = (other, ...more) => element('li', {},
      element('a', {href: this.route.to('behavior', [other.id])}, other.name), ' ',
      element('span', {class: `pill ${other.look}`}, other.outcome || 'open'),
      element('span', {class: 'soft'}, `#${other.id} · ${localTime(other)} · ${duration(other.duration)}`), more);
    const list = (title, lines) => (lines.length ? element('section', {}, element('h2', {}, title),
      element('ul', {class: 'relatives'}, lines)) : null);
    const children = folded(one.children || [], ({name, outcome}) => JSON.stringify([name, outcome]));
    const attempts = (one.attempts || []).filter((other) => other.id !== one.id);
    return [list('Inside it', children.map(({first, times, all}) => [line(first), times > 1 && element('li', {},
      element('details', {}, element('summary', {}, andMore(times).replace(/^, /, '')),
        element('ul', {class: 'relatives'}, all.slice(1).map((other) => line(other)))))])),
      list('Other attempts', attempts.map((other) => line(other, element('a', {class: 'compare',
        href: this.route.to('compare', [one.id, other.id]),
        'aria-label': `Compare #${one.id} with #${other.id}`}, 'compare')))),
      one.parent ? element('p', {}, 'It is part of ',
        element('a', {href: this.route.to('behavior', [one.parent])}, `#${one.parent}`), '.') : null];
  }

  choose(topic) {
    if (!topic || !this.behavior.lanes.some((lane) => lane.topic === topic)) return;
    this.lanes.choose(topic);
    this.values.choose(topic);
    this.route.keep({topic});
  }

  /** The address tells the moment, but not sixty times a second: browsers refuse that. */
  keep(seconds) {
    if (this.latest === undefined && seconds === 0) return;  // nobody has moved it yet
    this.latest = seconds;
    if (this.keeping) return;
    this.keeping = setTimeout(() => this.tellAddress(), KEEP_MS);
  }

  tellAddress() {
    clearTimeout(this.keeping);
    this.keeping = null;
    this.route.keep({t: this.latest === undefined ? undefined : this.latest.toFixed(2)});
  }

  /** Search, moment or range in the address have changed. */
  follow(now) {
    if (!this.moment) return;
    this.look(now.params);
    if (now.params.t !== undefined) this.moment.set(Number(now.params.t) || 0);
  }

  closeParts() {
    for (const part of this.parts) part.close();
    this.parts = [];
    clearTimeout(this.keeping);
    this.keeping = null;
  }

  close() {
    this.abort.abort();
    this.closeParts();
  }
}
