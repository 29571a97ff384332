/** Play, pause and step through a recording in this page; nothing is sent to a robot. */

import {button, element} from './dom.js';
import {duration, offset} from './format.js';

export class Transport {
  /**
   * @param {Moment} moment @param {Story|null} story its lines are what one steps by
   * @param {Sound|null} sound what is heard meanwhile
   */
  constructor(moment, story = null, sound = null) {
    this.moment = moment;
    this.sound = sound;
    this.voice = sound?.said.length ? button('Sound', () => this.turn(), {'aria-pressed': 'true', 'data-sound': true,
      title: 'What was said, spoken while one watches'}) : null;
    this.toggle = button('Watch', () => this.toggled(), {class: 'main-action', 'data-watch': true,
      title: 'Watch the recording here; the robot does nothing'});
    this.whole = button('Whole length', () => moment.setRange(null), {class: 'whole-range', hidden: true});
    this.time = element('output', {class: 'time'});
    this.place = element('div', {class: 'transport', role: 'group', 'aria-label': 'Watch the recording'},
      this.toggle, this.voice,
      story && button('Previous line', () => story.step(-1)),
      story && button('Next line', () => story.step(1)), this.whole, this.time);
    const showWhole = () => { this.whole.hidden = moment.isWhole; };
    showWhole();
    moment.followRange(showWhole);
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
    this.moment.play((isPaused) => {
      this.toggle.textContent = 'Watch';
      if (isPaused) this.sound?.stop();
    });
  }

  turn() {
    this.sound.turn(!this.sound.isOn);
    this.voice.setAttribute('aria-pressed', this.sound.isOn ? 'true' : 'false');
  }
}
