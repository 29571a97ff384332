/** What happens now: the projector's picture, its layers, what diagnostics say, and the recorder. */

import {getPicture, Latest, post} from './api.js';
import {button, element, put, refill, table} from './dom.js';

const PICTURE_MS = 300;
const AGAIN_MS = 2000;  // after a failure: a publisher that is there and says nothing
const LEVELS = ['fine', 'careful', 'wrong', 'silent'];

/** "fine", "careful" of diagnostics' numbers or words. */
const level = (said) => LEVELS[said] || String(said).toLowerCase();

export class LiveView {
  constructor(view, shell) {
    this.notice = shell.notice;
    this.place = element('article', {class: 'live'}, element('h1', {}, 'Now'));
    put(view, this.place);
    document.title = 'Now · Afterglow';
    if (!shell.robot) {
      put(this.place, element('p', {class: 'note'}, 'This console reads a store; it has no robot.'));
      return;
    }
    this.image = element('img', {alt: 'What the projector shows now', hidden: true});
    this.dark = element('p', {class: 'no-picture'}, 'Loading…');
    this.light = element('p', {class: 'soft'});
    this.layers = element('div', {});
    this.diagnostics = element('ul', {class: 'diagnostics'});
    this.recorder = element('p', {});
    put(this.place, element('div', {class: 'columns'},
      element('section', {}, element('h2', {}, 'Projector'), element('figure', {class: 'picture'},
        element('div', {class: 'frame'}, this.image, this.dark)), this.light, this.layers),
      element('div', {}, element('section', {}, element('h2', {}, 'Diagnostics'), this.diagnostics),
        element('section', {}, element('h2', {}, 'Recorder'), this.recorder, this.form()))));
    this.loader = new Latest((_, signal) => this.look(signal));
    this.published = false;  // until a state tells of it
    this.quietUntil = 0;
    this.timer = setInterval(() => this.wantPicture(), PICTURE_MS);
    this.unfollow = shell.robot.follow((state, isHeard) => this.show(state, isHeard));
  }

  /** Asks only while somebody publishes what would be shown. */
  wantPicture() {
    if (this.published && !document.hidden && performance.now() >= this.quietUntil) this.loader.want(1);
  }

  async look(signal) {
    try {
      const {image} = await getPicture('/api/projected', {}, signal);
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
      this.noPicture(problem.message);
    }
  }

  noPicture(words) {
    this.image.hidden = true;
    this.dark.hidden = false;
    this.dark.textContent = words;
  }

  /** @param {{topic: string, published: boolean}|null} image of the state; null while the robot is not heard */
  heard(image) {
    const published = Boolean(image?.published);
    const words = published ? 'Loading…' : image ? `Nobody publishes ${image.topic}.` : 'The robot is not heard.';
    if (words === this.waitsFor) return;
    this.waitsFor = words;
    this.published = published;
    this.noPicture(words);
    this.wantPicture();
  }

  form() {
    const name = element('input', {id: 'record-name', required: true, autocomplete: 'off'});
    const topics = element('input', {id: 'record-topics', autocomplete: 'off', spellcheck: 'false',
      placeholder: '/cmd_vel /robotsound'});
    const outcome = element('input', {id: 'record-outcome', value: 'success', autocomplete: 'off'});
    this.start = element('button', {type: 'submit'}, 'Record');
    this.stop = button('End the recording', () => this.tried(post('/api/record/stop', {outcome: outcome.value})));
    return element('form', {class: 'record-form', on: {submit: (event) => {
      event.preventDefault();
      this.tried(post('/api/record', {name: name.value, topics: topics.value.split(/[\s,]+/).filter(Boolean)}));
    }}},
    element('label', {for: 'record-name'}, 'Name'), name, element('label', {for: 'record-topics'}, 'Topics'),
    topics, this.start, element('label', {for: 'record-outcome'}, 'Outcome'), outcome, this.stop);
  }

  async tried(asked) {
    try {
      await asked;
    } catch (problem) {
      this.notice.warn(problem.message);
    }
  }

  show(state, isHeard) {
    const said = JSON.stringify([state?.projector, state?.diagnostics, state?.recorder, isHeard]);
    if (said === this.said) return;  // five times a second, and mostly the same
    this.said = said;
    const {projector, diagnostics, recorder} = state || {};
    this.heard(isHeard ? projector?.image : null);
    this.light.textContent = isHeard ? projector?.words || '' : 'The robot is not heard.';
    refill(this.layers, projector?.layers?.length ? table('Layers', ['topic', 'Hz', 'shown', 'why'],
      projector.layers.map((layer) => ({class: layer.shown ? null : 'out', cells: [layer.topic,
        layer.hz?.toFixed?.(1) ?? layer.hz, layer.shown ? 'yes' : 'no', layer.words || '']})), [1]) : null);
    refill(this.diagnostics, (diagnostics || []).map((one) => element('li', {class: level(one.level)},
      element('b', {}, one.name), ` ${one.words}`)));
    if (!diagnostics?.length) put(this.diagnostics, element('li', {class: 'soft'}, 'Nobody has said anything.'));
    this.recorder.textContent = recorder?.words || Object.entries(recorder || {}).map(
      ([key, value]) => `${key.replaceAll('_', ' ')}: ${value}`).join(' · ') || 'The recorder is not heard.';
    const isRecording = Boolean(recorder?.recording ?? recorder?.behavior);
    this.stop.disabled = !isRecording;
  }

  follow() {}
  reload() {}

  close() {
    clearInterval(this.timer);
    this.loader?.close();
    this.unfollow?.();
  }
}
