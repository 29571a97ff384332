/** A picture that comes again and again, of what is published now: the projector's, a camera's. */

import {getPicture, Latest} from './api.js';
import {element} from './dom.js';

const PICTURE_MS = 300;
const AGAIN_MS = 2000;  // after a failure: a publisher that is there and says nothing

export class LiveImage {
  /** @param {string} address of the newest picture @param {string} alt what it shows */
  constructor(address, alt) {
    this.address = address;
    this.image = element('img', {alt, hidden: true});
    this.dark = element('p', {class: 'no-picture'}, 'Loading…');
    this.place = element('figure', {class: 'picture'}, element('div', {class: 'frame'}, this.image, this.dark));
    this.loader = new Latest((_, signal) => this.look(signal));
    this.published = false;  // until a state tells of it
    this.quietUntil = 0;
    this.timer = setInterval(() => this.want(), PICTURE_MS);
  }

  /** Asks only while somebody publishes what would be shown. */
  want() {
    if (this.published && !document.hidden && performance.now() >= this.quietUntil) this.loader.want(1);
  }

  async look(signal) {
    try {
      const {image} = await getPicture(this.address, {}, signal);
      if (!image.size || !this.published) return;  // the first is still on its way, or the last one was
      const address = URL.createObjectURL(image);
      this.image.src = address;
      await this.image.decode().catch(() => {});
      URL.revokeObjectURL(address);
      this.image.hidden = false;
      this.dark.hidden = true;
    } catch (problem) {
      if (problem.name === 'AbortError' || !this.published) return;
      this.quietUntil = performance.now() + AGAIN_MS;
      this.say(problem.message);
    }
  }

  say(words) {
    this.image.hidden = true;
    this.dark.hidden = false;
    this.dark.textContent = words;
  }

  /**
   * @param {{topic: string, published: boolean}|null} image of the state; null while the robot is not heard
   * @param {string} why nobody publishes it, where that is known
   */
  heard(image, why = '') {
    const published = Boolean(image?.published);
    const unpublished = image ? why || `Nobody publishes ${image.topic}.` : 'The robot is not heard.';
    const words = published ? 'Loading…' : unpublished;
    if (words === this.waitsFor) return;
    this.waitsFor = words;
    this.published = published;
    this.say(words);
    this.want();
  }

  close() {
    clearInterval(this.timer);
    this.loader.close();
  }
}
