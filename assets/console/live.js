/** What happens now: the projector's picture, its layers, what diagnostics say, and the recorder. */

import {post} from './api.js';
import {button, element, put, refill, table} from './dom.js';
import {foxglove} from './format.js';
import {LiveImage} from './live_image.js';

const LEVELS = ['fine', 'careful', 'wrong', 'silent'];
const WRONG = LEVELS.indexOf('wrong');

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
    this.image = new LiveImage('/api/projected', 'What the projector shows now');
    this.light = element('p', {class: 'soft'});
    this.layers = element('div', {});
    this.diagnostics = element('ul', {class: 'diagnostics'});
    this.recorder = element('p', {});
    if (!shell.needsToken) {
      put(this.place,
          element(
              'p', {}, element('a', {href: foxglove('')}, 'Open in Foxglove'),
              element('span', {class: 'soft'}, ': what is published now')));
    }
    put(this.place, element('div', {class: 'columns'},
      element('section', {}, element('h2', {}, 'Projector'), this.image.place, this.light, this.layers),
      element('div', {}, element('section', {}, element('h2', {}, 'Diagnostics'), this.diagnostics),
        element('section', {}, element('h2', {}, 'Recorder'), this.recorder, this.form()))));
    this.unfollow = shell.robot.follow((state, isHeard) => this.show(state, isHeard));
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
    const why = projector?.level >= WRONG && !projector.image?.published ? projector.words : '';
    this.image.heard(isHeard ? projector?.image : null, why);
    this.light.textContent = isHeard && !why && projector?.words || '';  // each reason once
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
    this.image?.close();
    this.unfollow?.();
  }
}
