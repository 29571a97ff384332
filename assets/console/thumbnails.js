/**
 * Small pictures of behaviors, each at its first lit moment, for the list: loaded one after the other, only what is in
 * sight, and kept.
 */

import {getPicture, Latest} from './api.js';
import {element} from './dom.js';
import {SESSION} from './session.js';

const WIDTH = 160;  // px
const MOST = 200;  // that are kept
const REST_MS = 250;  // a list that is scrolled past wants nothing

/** The server's picture of a behavior's first lit moment, and that moment: null where nothing is lit. */
export async function firstLight(id, signal) {
  const {image, moment} = await getPicture(`/api/behaviors/${id}/picture`,
    {t: 'lit', view: 'bystander', width: WIDTH, viewer: `${SESSION} list`}, signal);
  return {image, moment};
}

/**
 * Whoever came without a moment sees the first at which all these behaviors have been lit, unless
 * they have moved meanwhile.
 */
export async function goToLight(ids, moment, signal) {
  try {
    const lit = Math.max(
        ...(await Promise.all(ids.map((id) => firstLight(id, signal)))).map((one) => one.moment));
    if (lit && moment.seconds === 0 && !moment.isPlaying) moment.set(lit);
  } catch { /* the pictures say why there are none */
  }
}

export class Thumbnails {
  constructor() {
    this.kept = new Map();  // key of a behavior: its picture's address, or '' where there is none
    this.wanted = [];
    this.isOn = false;
    this.loader = new Latest((_, signal) => this.load(signal));
  }

  /** Whether the server draws pictures at all. */
  turn(isOn) {
    this.isOn = isOn;
    this.wanted = [];
  }

  /** An image for a row; empty until its picture is there. */
  of(one) {
    if (!this.isOn) return null;
    const image = element('img', {class: 'thumbnail', alt: '', width: 64, height: 40});
    const key = `${one.id} ${one.end}`;
    const known = this.kept.get(key);
    if (known) image.src = known;
    else if (known === undefined) this.want(one.id, key, image);
    return image;
  }

  want(id, key, image) {
    this.wanted = this.wanted.filter((other) => other.image.isConnected && other.key !== key);
    this.wanted.push({id, key, image});
    clearTimeout(this.resting);
    this.resting = setTimeout(() => this.loader.want(1), REST_MS);
  }

  async load(signal) {
    for (let next = this.next(); next; next = this.next()) {
      let address = '';
      try {
        address = URL.createObjectURL((await firstLight(next.id, signal)).image);
      } catch (problem) {
        if (problem.name === 'AbortError' || problem.status !== 503) return;
      }
      this.keep(next.key, address);
      if (address) next.image.src = address;
    }
  }

  next() {
    let one = this.wanted.shift();
    while (one && (!one.image.isConnected || this.kept.has(one.key))) one = this.wanted.shift();
    return one;
  }

  keep(key, address) {
    this.kept.set(key, address);
    if (this.kept.size <= MOST) return;
    const [oldest, gone] = this.kept.entries().next().value;
    this.kept.delete(oldest);
    URL.revokeObjectURL(gone);
  }
}
