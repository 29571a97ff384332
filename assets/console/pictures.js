/** The projector's picture and the room at the moment, rendered by the server from what was recorded. */

import {getPicture, Latest} from './api.js';
import {button, element, put, refill} from './dom.js';
import {offset} from './format.js';
import {SESSION} from './session.js';

const AGAIN_MS = 1000;  // after a failure: mostly the next moment has no picture for the same reason

const VIEWS = {
  projector: {title: 'What the projector showed', alt: 'The projector\'s picture'},
  bystander: {title: 'The room, as a bystander sees it', alt: 'The room'},
};

/** One view that follows the moment: the newest wanted is loaded, what was passed over is not. */
export class Picture {
  /**
   * @param {number} id of the behavior
   * @param {string} view projector or bystander
   * @param {{title?: string, limit?: number, width?: number, place?: string, tellsDark?: boolean}} how `limit`: the
   *   behavior's length, s; `place`: where on the page, as the server draws only the newest wish of each;
   *   `tellsDark`: below it stands what is not lit, and why
   */
  constructor(id, view, how = {}) {
    this.id = id;
    this.view = view;
    this.limit = how.limit ?? Infinity;
    this.width = how.width || 640;
    this.viewer = `${SESSION} ${how.place || 'large'}`;
    this.image = element('img', {alt: `${VIEWS[view].alt}, not loaded yet`, hidden: true});
    this.problem = element('p', {class: 'no-picture'}, 'Loading…');
    this.frame = element('div', {class: 'frame'}, this.image, this.problem);
    this.dark = element('ul', {class: 'dark', hidden: true});
    this.place = element('figure', {class: `picture ${view}`}, this.frame,
      element('figcaption', {}, how.title || VIEWS[view].title, how.tellsDark && this.dark));
    this.shown = null;
    this.quietUntil = 0;
    this.again = null;
    this.loader = new Latest((seconds, signal) => this.load(seconds, signal));
  }

  at(seconds) {
    const within = Math.min(seconds, this.limit);
    if (this.shown === within) return;
    this.shown = within;
    this.loader.want(within);
  }

  /** Asks for what is wanted then. */
  later() {
    this.again = this.again || setTimeout(() => {
      this.again = null;
      if (this.shown !== null) this.loader.want(this.shown);
    }, AGAIN_MS);
  }

  async load(seconds, signal) {
    if (performance.now() < this.quietUntil) {
      this.later();
      return;
    }
    try {
      const {image, dark} = await getPicture(`/api/behaviors/${this.id}/picture`,
        {t: seconds.toFixed(3), view: this.view, width: this.width, viewer: this.viewer}, signal);
      const address = URL.createObjectURL(image);
      this.image.src = address;
      await this.image.decode().catch(() => {});
      URL.revokeObjectURL(address);
      const {naturalWidth, naturalHeight} = this.image;
      if (naturalHeight) {  // beside each other they are equally high
        this.frame.style.aspectRatio = `${naturalWidth} / ${naturalHeight}`;
        this.place.style.flexGrow = naturalWidth / naturalHeight;
      }
      this.image.alt = `${VIEWS[this.view].alt} at ${offset(seconds)}`;
      this.image.hidden = false;
      this.problem.hidden = true;
      this.tell(dark);
    } catch (problem) {
      if (problem.name === 'AbortError') return;
      this.quietUntil = performance.now() + AGAIN_MS;
      if (this.shown === seconds) this.shown = null;  // is asked for again by the next moment, also if it is the same
      this.image.hidden = true;
      this.tell([]);
      this.problem.hidden = false;
      this.problem.textContent = problem.message;
    }
  }

  tell(dark) {
    this.dark.hidden = !dark.length;
    refill(this.dark, dark.map((line) => element('li', {}, line)));
  }

  close() {
    clearTimeout(this.again);
    this.loader.close();
  }
}

/** The views show the moment; they wait until `ready` is settled, or the moment has moved. */
export function follow(views, moment, ready) {
  const begin = moment.seconds;
  const show = () => views.forEach((view) => view.at(moment.seconds));
  let waits = Boolean(ready);
  moment.follow((seconds) => {
    waits = waits && seconds === begin;
    if (!waits) show();
  });
  ready?.then(show);
}

/** In place of pictures: why this console makes none. */
export function noPictures(why) {
  return element('p', {class: 'note'}, `No pictures: ${why}`);
}

/** Both views beside each other, following a moment. */
export class Pictures {
  /** @param {Promise|null} ready they wait until it is settled, or the moment has moved */
  constructor(id, moment, ready = null) {
    this.views = Object.keys(VIEWS).map((view) => new Picture(id, view,
      {limit: moment.length, tellsDark: view === 'projector'}));
    this.place = element('div', {class: 'pictures'}, this.views.map((view) => view.place));
    follow(this.views, moment, ready);
  }

  close() {
    for (const view of this.views) view.close();
  }
}

/** Small pictures of the key moments, which lead there. Loaded one after the other. */
export class KeyMoments {
  /** @param {Promise|null} ready they wait until it is settled */
  constructor(id, seconds, moment, ready = null) {
    this.strip = element('div', {class: 'strip', role: 'group', 'aria-label': 'Key moments'});
    this.place = element('section', {hidden: !seconds.length}, element('h2', {}, 'Key moments'), this.strip);
    this.views = seconds.map((t) => {
      const view = new Picture(id, 'bystander', {title: offset(t), width: 320, place: 'small'});
      put(this.strip, button(view.place, () => moment.set(t), {class: 'key-moment',
        'aria-label': `Go to ${offset(t)}`}));
      return {t, view};
    });
    this.load(ready);
  }

  async load(ready) {
    await ready;  // the large pictures are asked for first
    for (const {t, view} of this.views) await view.loader.want(t);
  }

  close() {
    for (const {view} of this.views) view.close();
  }
}
