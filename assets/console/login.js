/** The page for those who come from another machine: it asks for the token that the console was started with. */

import {post} from './api.js';
import {connection} from './connection.js';
import {element, refill} from './dom.js';

/** Shows the form in place of the views, until a token is accepted. */
export function showLogin(view) {
  const problem = element('p', {class: 'note bad', role: 'alert', hidden: true});
  const token = element('input', {type: 'password', id: 'token', autocomplete: 'current-password',
    required: true, spellcheck: 'false'});
  const submit = element('button', {type: 'submit', class: 'main-action'}, 'Open the console');
  const form = element('form', {class: 'login', on: {submit: async (event) => {
    event.preventDefault();
    submit.disabled = true;
    try {
      await post('/api/login', {token: token.value.trim()});
      connection.admitted();
    } catch (refusal) {
      problem.textContent = refusal.status === 401 ?
        'That is not the token of this console.' : refusal.message;
      problem.hidden = false;
      token.select();
    }
    submit.disabled = false;
  }}},
  element('h1', {}, 'Who is there?'),
  element('p', {}, 'This console is opened from another machine, so it asks for its token. ' +
    'It was printed where the console was started.'),
  element('label', {for: 'token'}, 'Token'), token, submit, problem);
  refill(view, form);
  token.focus();
}
