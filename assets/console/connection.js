/**
 * Whether the console's server answers. Whoever meets a failure calls lost(); then it is asked every second,
 * and when it answers again those who listen load anew: a restart of the server needs no reload of the page.
 */

const ASK_AGAIN_MS = 1000;

class Connection {
  constructor() {
    this.isFine = true;
    this.needsLogin = false;
    this.listeners = [];
    this.asking = null;
  }

  /** @param {function({isFine: boolean, needsLogin: boolean, returned: boolean})} listener */
  onChange(listener) {
    this.listeners.push(listener);
  }

  /** The server was not to be reached. */
  lost() {
    if (!this.isFine) return;
    this.isFine = false;
    this.tell(false);
    this.askAgain();
  }

  /** The server wants a token first. */
  refused() {
    if (this.needsLogin) return;
    this.needsLogin = true;
    this.tell(false);
  }

  /** A token was accepted. */
  admitted() {
    this.needsLogin = false;
    this.tell(true);
  }

  askAgain() {
    clearTimeout(this.asking);
    this.asking = setTimeout(async () => {
      try {
        const answer = await fetch('/api/about', {cache: 'no-store'});
        if (answer.status >= 502) throw new Error('behind a proxy that does not reach it');
        this.isFine = true;
        if (answer.status === 401) this.needsLogin = true;
        this.tell(!this.needsLogin);
      } catch {
        this.askAgain();
      }
    }, ASK_AGAIN_MS);
  }

  tell(returned) {
    const {isFine, needsLogin} = this;
    for (const listener of this.listeners) listener({isFine, needsLogin, returned});
  }
}

/** One for the page: there is one server. */
export const connection = new Connection();
