// Answers that were not sent yet: they outlive a reload, and end with the session they were typed in.

const STORE = "riposte-study-drafts";

export class Drafts {
  constructor() {
    const kept = JSON.parse(sessionStorage.getItem(STORE) ?? "null");
    this.session = kept?.session ?? null;
    this.steps = kept?.steps ?? {};
  }

  /** Be in a session; what was typed in another one is forgotten. */
  enter(session) {
    if (session === this.session) return false;
    this.session = session;
    this.steps = {};
    this.keep();
    return true;
  }

  /** Return what was kept of a step: answers by item, "page", or "ticks". */
  of(step) {
    return (this.steps[step] ??= {});
  }

  clear(step) {
    delete this.steps[step];
    this.keep();
  }

  keep() {
    sessionStorage.setItem(STORE, JSON.stringify({ session: this.session, steps: this.steps }));
  }
}
