/** Play, pause and step through a recording in this page; nothing is sent to a robot. */

import {button, element} from './dom.js';
import {duration, offset} from './format.js';

export class Transport {
  /** @param {Moment} moment @param {Story|null} story its lines are what one steps by */
  constructor(moment, story = null) {
    this.moment = moment;
    this.toggle = button('Watch', () => this.toggled(), {class: 'main-action', 'data-watch': true,
      title: 'Watch the recording here; the robot does nothing'});
    this.time = element('output', {class: 'time'});
    this.place = element('div', {class: 'transport', role: 'group', 'aria-label': 'Watch the recording'},
      this.toggle,
      story && button('Previous line', () => story.step(-1)),
      story && button('Next line', () => story.step(1)), this.time);
    moment.follow((seconds) => {
      this.time.textContent = `${offset(seconds)} of ${duration(moment.length)}`;
    });
  }

  toggled() {
    if (this.moment.isPlaying) {
      this.moment.pause();
      return;
    }
    this.toggle.textContent = 'Pause';
    this.moment.play(() => { this.toggle.textContent = 'Watch'; });
  }
}
