/** What was said, heard while one watches: each sentence at its time, spoken by the server as films have it. */

import {withQuery} from './api.js';

const LATE_S = 1;  // a moment that came so much further was jumped to, not watched

export class Sound {
  /** @param {number} id of the behavior @param {Array<{t, text}>} said @param {Moment} moment */
  constructor(id, said, moment) {
    this.moment = moment;
    this.said = said.map(({t}, n) => ({t, address: withQuery(`/api/behaviors/${id}/sound`, {n: `${n}`})}));
    this.heard = moment.seconds;
    this.now = null;
    this.isOn = true;
    moment.follow((seconds) => this.at(seconds));
  }

  at(seconds) {
    const before = this.heard;
    this.heard = seconds;
    if (!this.moment.isPlaying || seconds < before || seconds - before > LATE_S) return;
    const one = this.said.find(({t}) => t > before && t <= seconds);
    if (one) this.play(one.address);
  }

  play(address) {
    this.stop();
    if (!this.isOn) return;
    this.now = new Audio(address);
    this.now.play().catch(() => {});  // without a voice on the server, or a loudspeaker here: the words stand there
  }

  /** The last one to ask goes on until its end; another sentence, or a pause, ends it. */
  stop() {
    this.now?.pause();
    this.now = null;
  }

  turn(isOn) {
    this.isOn = isOn;
    if (!isOn) this.stop();
  }

  close() {
    this.stop();
  }
}
