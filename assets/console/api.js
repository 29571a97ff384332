/** Asking the console's server: nodes/console/README.md describes what it answers. */

import {connection} from './connection.js';

/** What went wrong, as a line for people; `status` is 0 where nobody answered. */
export class ApiError extends Error {
  constructor(message, status) {
    super(message);
    this.status = status;
  }
}

async function ask(path, options) {
  let answer;
  try {
    answer = await fetch(path, {cache: 'no-store', credentials: 'same-origin', ...options});
  } catch (problem) {
    if (problem.name === 'AbortError') throw problem;
    connection.lost();
    throw new ApiError('The console does not answer.', 0);
  }
  if (answer.ok) return answer;
  if (answer.status === 401 && path !== '/api/login') connection.refused();
  let words = `${answer.status} ${answer.statusText}`.trim();
  try {
    words = (await answer.json()).error || words;
  } catch { /* an answer that is no JSON has its status */ }
  throw new ApiError(words, answer.status);
}

/** The path with a query; what is empty is left out. */
export function withQuery(path, query) {
  const said = new URLSearchParams();
  for (const [key, value] of Object.entries(query)) {
    if (value !== undefined && value !== null && value !== '') said.set(key, value);
  }
  const text = said.toString();
  return text ? `${path}?${text}` : path;
}

/** JSON of a GET. Throws ApiError; an AbortError where `signal` aborted it. */
export async function get(path, query = {}, signal = undefined) {
  return (await ask(withQuery(path, query), {signal})).json();
}

/**
 * An image of a GET; `dark`: what it does not show, and why, a line each; `moment`: when it is, seconds, null where a
 * lit one was wanted and there is none.
 */
export async function getPicture(path, query = {}, signal = undefined) {
  const answer = await ask(withQuery(path, query), {signal});
  const moment = answer.headers.get('Afterglow-Moment');
  return {image: await answer.blob(), dark: JSON.parse(answer.headers.get('Afterglow-Dark') || '[]'),
    moment: moment ? Number(moment) : null};
}

/** JSON of a POST. `lasting`: is sent even while the page is being closed. */
export async function post(path, body = {}, lasting = false) {
  const answer = await ask(path, {method: 'POST', body: JSON.stringify(body), keepalive: lasting,
    headers: {'Content-Type': 'application/json'}});
  return answer.status === 204 ? {} : answer.json();
}

/**
 * Asks again and again for the newest of what is wanted, one request at a time: what was wanted in between is
 * never asked. Scrubbing asks for more pictures than any server makes.
 */
export class Latest {
  /** @param {function(any, AbortSignal): Promise} work asked with what was wanted last */
  constructor(work) {
    this.work = work;
    this.wanted = undefined;
    this.isBusy = false;
    this.isClosed = false;
    this.abort = new AbortController();
  }

  /** Wants this; undefined is nothing. */
  async want(what) {
    this.wanted = what;
    if (this.isBusy) return;
    this.isBusy = true;
    while (this.wanted !== undefined && !this.isClosed) {
      const now = this.wanted;
      this.wanted = undefined;
      try {
        await this.work(now, this.abort.signal);
      } catch (problem) {
        if (problem.name !== 'AbortError') console.error(problem);
      }
    }
    this.isBusy = false;
  }

  close() {
    this.isClosed = true;
    this.abort.abort();
  }
}
