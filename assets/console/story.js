/** A behavior's story in words; a line leads to its moment, and the line of the moment is marked. */

import {button, element} from './dom.js';
import {offset} from './format.js';

/** Goals that succeeded one after the other with the same words, but for their times, are one line. */
export function folded(story) {
  const same = (one) => (one.kind === 'goal' && !one.bad ? one.text.replace(/[\d.]+/g, '') : null);
  const lines = [];
  for (const one of story) {
    const last = lines[lines.length - 1];
    if (last && same(one) !== null && same(one) === same(last)) last.times++;
    else lines.push({...one, times: 1});
  }
  return lines;
}

export class Story {
  /** @param {Array<{t, clock, kind, text}>} story @param {Moment} moment */
  constructor(story, moment) {
    this.story = folded(story);
    this.moment = moment;
    this.lines = this.story.map((one) => element('li', {class: `${one.kind}${one.bad ? ' bad' : ''}`},
      button([element('span', {class: 'clock'}, one.clock || offset(one.t)),
        element('span', {class: 'text'}, one.kind === 'said' ? this.said(one.text) : one.text,
        one.times > 1 && element('span', {class: 'soft'}, `, and ${one.times - 1} more like it`))],
      () => moment.set(one.t))));
    this.place = element('section', {class: 'story'}, element('h2', {}, 'Story'),
      element('ol', {}, this.lines));
    moment.follow((seconds) => this.at(seconds));
  }

  said(text) {
    return /^said\b|[“"]/.test(text) ? text : `“${text}”`;
  }

  /** The last line that has happened. */
  lineAt(seconds) {
    let last = -1;
    this.story.forEach((one, at) => { if (one.t <= seconds + 0.005) last = at; });
    return last;
  }

  at(seconds) {
    const now = this.lineAt(seconds);
    this.lines.forEach((line, at) => {
      line.classList.toggle('now', at === now);
      line.classList.toggle('later', at > now);
    });
  }

  /** Goes to the line `by` further. */
  step(by) {
    const {seconds} = this.moment;
    const at = by > 0 ? this.story.find((one) => one.t > seconds + 0.005) :
      [...this.story].reverse().find((one) => one.t < seconds - 0.005);
    if (at) this.moment.set(at.t);
  }
}
