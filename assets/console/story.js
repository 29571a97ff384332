/** A behavior's story in words; a line leads to its moment, and the line of the moment is marked. */

import {button, element} from './dom.js';
import {andMore, folded, offset, sameInStory} from './format.js';

export class Story {
  /** @param {Array<{t, clock, kind, text}>} story @param {Moment} moment */
  constructor(story, moment) {
    const runs = folded(story, sameInStory);
    this.story = runs.map(({first}) => first);
    this.moment = moment;
    this.lines = runs.map(({first: one, times}) => element('li', {class: `${one.kind}${one.bad ? ' bad' : ''}`},
      button([element('span', {class: 'clock'}, one.clock || offset(one.t)),
        element('span', {class: 'text'}, one.kind === 'said' ? this.said(one.text) : one.text,
        times > 1 && element('span', {class: 'soft'}, andMore(times)))],
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
