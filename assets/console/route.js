/**
 * What is shown, as the address says it, so that a view can be sent to somebody and the back key works:
 * #/behavior/12?t=1.25&from=1&to=2.5&q=pick, #/compare/12/11, #/when?day=2026-11-23, #/replay/12, #/live, #/
 */

const VIEWS = {find: 0, when: 0, behavior: 1, compare: 2, replay: 1, live: 0, calibrate: 0};
/** What of the address stays when another view is opened: the search. `since`, `until`: nanoseconds. */
export const KEPT = ['q', 'name', 'outcome', 'day', 'since', 'until', 'where'];

/** {view, ids: [number], params: {}} of an address; what makes no sense is the list. */
export function parse(hash) {
  const [path, query = ''] = hash.replace(/^#\/?/, '').split('?');
  const [view = '', ...rest] = path.split('/');
  const params = Object.fromEntries(new URLSearchParams(query));
  const ids = rest.map(Number);
  const known = Object.hasOwn(VIEWS, view) && ids.length === VIEWS[view] &&
    ids.every((id) => Number.isSafeInteger(id) && id >= 0);
  return known ? {view, ids, params} : {view: 'find', ids: [], params};
}

/** The address of a view. */
export function address(view, ids, params) {
  const said = new URLSearchParams();
  for (const [key, value] of Object.entries(params)) {
    if (value !== undefined && value !== null && value !== '') said.set(key, value);
  }
  const query = said.toString();
  return `#/${[view === 'find' ? '' : view, ...ids].filter((part) => part !== '').join('/')}` +
    (query ? `?${query}` : '');
}

/** The address bar. */
export class Route {
  constructor() {
    this.listeners = [];
    this.now = parse(location.hash);
    window.addEventListener('hashchange', () => this.changed());
  }

  /** @param {function({view, ids, params})} listener called when another view or search is wanted */
  onChange(listener) {
    this.listeners.push(listener);
  }

  /** The address of a view with the search as it is. */
  to(view, ids = [], more = {}) {
    const kept = Object.fromEntries(KEPT.map((key) => [key, this.now.params[key]]));
    return address(view, ids, {...kept, ...more});
  }

  /** Shows a view in place of this one: the back key does not come back here. */
  replace(view, ids) {
    history.replaceState(null, '', this.to(view, ids));
    this.now = parse(location.hash);
  }

  /** Opens a view: a step that the back key undoes. */
  open(view, ids = [], more = {}) {
    location.hash = this.to(view, ids, more);
  }

  /** Shows the same without any search: a step that the back key undoes. */
  clear() {
    const {view, ids, params} = this.now;
    location.hash = address(view, ids, {...params, ...Object.fromEntries(KEPT.map((key) => [key, '']))});
  }

  /** Changes the search; a search is not worth a step back for every letter. */
  search(change) {
    this.keep(change);
    this.tell();
  }

  /** Writes what has changed within a view (the moment), and tells nobody. */
  keep(change) {
    const {view, ids, params} = this.now;
    // A link that was just followed has changed the address, and its event is on its way: it stays.
    const there = parse(location.hash);
    if (there.view !== view || there.ids.join() !== ids.join()) return;
    this.now = {view, ids, params: {...params, ...change}};
    history.replaceState(null, '', address(view, ids, this.now.params));
  }

  changed() {
    this.now = parse(location.hash);
    this.tell();
  }

  tell() {
    for (const listener of this.listeners) listener(this.now);
  }
}
