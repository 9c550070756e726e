// The connection to the study's runner: views in, asks out; connects again by itself.
//
// An ask that lasts is kept, over reloads and lost connections, and said again until a reply with its id
// comes; the runner lets each id through once. One that does not last is said once, and only while there
// is a connection: nobody wants a click on "Arm" to arrive half a minute late.

const RETRY_MS = 700;
const AGAIN_MS = 2000;
const SILENT_MS = 2500; // without a view for so long, what is shown is old
const PATIENCE_MS = 6000; // for the reply to an ask that does not last
const TAKEN_OVER = 4001;
const TOO_MANY = 4009;
const STATES = { [TAKEN_OVER]: "taken", [TOO_MANY]: "many" };

/** Return JSON; half a character, as a cut emoji leaves it, is left out, for it is none. */
function written(ask) {
  return JSON.stringify(ask, (_, value) => (typeof value === "string" ? value.replace(/\p{Surrogate}/gu, "") : value));
}

function newId() {
  return Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

export class Link {
  /**
   * role: "participant" or "researcher".
   * on: {view(view), state(state), reply(reply, ask)}; state is "open", "lost", "silent", "taken" or "many";
   * reply.is_done is null where nobody knows whether the ask arrived.
   */
  constructor(role, on) {
    this.role = role;
    this.on = on;
    this.socket = null;
    this.state = "";
    this.viewAt = 0;
    this.againAt = Infinity;
    this.store = `riposte-study-${role}-asks`;
    const kept = JSON.parse(sessionStorage.getItem(this.store) ?? "null");
    this.session = kept?.session ?? null;
    this.lasting = new Map(Object.entries(kept?.asks ?? {}));
    this.passing = new Map();
    setInterval(() => this.watch(), 250);
    this.connect();
  }

  connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}/${this.role}/socket${location.search}`);
    socket.onopen = () => {
      this.viewAt = performance.now();
      this.say("open");
      this.againAt = Infinity; // not before the first view has said which session this is
    };
    socket.onmessage = (event) => this.receive(JSON.parse(event.data));
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.socket = null;
      for (const id of [...this.passing.keys()]) this.giveUp(id);
      this.say(STATES[event.code] ?? "lost");
      if (!STATES[event.code]) setTimeout(() => this.socket || this.connect(), RETRY_MS);
    };
    this.socket = socket;
  }

  get isOpen() {
    return this.socket !== null && this.socket.readyState === WebSocket.OPEN;
  }

  say(state) {
    if (state === this.state) return;
    this.state = state;
    this.on.state(state);
  }

  receive(said) {
    if (said.type === "view") {
      this.viewAt = performance.now();
      this.say("open");
      this.on.view(said.view);
      if (this.againAt === Infinity) this.againAt = 0;
      return;
    }
    const { reply } = said;
    const ask = this.lasting.get(reply.id) ?? this.passing.get(reply.id)?.ask;
    if (!ask) return; // it was told before
    this.lasting.delete(reply.id);
    this.passing.delete(reply.id);
    this.keep();
    this.on.reply(reply, ask);
  }

  watch() {
    const now = performance.now();
    if (this.isOpen && now - this.viewAt > SILENT_MS) this.say("silent");
    for (const [id, { at }] of this.passing) if (now - at > PATIENCE_MS) this.giveUp(id);
    if (now < this.againAt) return;
    this.againAt = now + AGAIN_MS;
    for (const ask of this.lasting.values()) this.send(ask);
  }

  giveUp(id) {
    const { ask } = this.passing.get(id);
    this.passing.delete(id);
    this.on.reply({ id, is_done: null, lines: [] }, ask);
  }

  /** Ask for something that has to arrive once, however long it takes; return the ask. */
  askLasting(wish) {
    const ask = { id: newId(), ...wish };
    this.lasting.set(ask.id, ask);
    this.keep();
    this.send(ask);
    return ask;
  }

  /** Ask for something now or not at all; return whether it was said. A second click says nothing more. */
  askNow(wish) {
    if (!this.isOpen || this.state === "silent") return false;
    const said = [...this.passing.values()].map(({ ask }) => ask);
    if (said.some((ask) => ask.action === wish.action && ask.step === wish.step && ask.attempt === wish.attempt)) return true;
    const ask = { id: newId(), ...wish };
    this.passing.set(ask.id, { ask, at: performance.now() });
    this.send(ask);
    return true;
  }

  /** Return the ask that waits for its reply and that fits, if there is one. */
  waiting(fits) {
    return [...this.lasting.values()].find(fits);
  }

  /** Be in a session; asks of another one are nobody's any more. Return whether it is a new one. */
  enter(session) {
    if (session === this.session) return false;
    this.session = session;
    this.lasting.clear();
    this.keep();
    return true;
  }

  send(ask) {
    if (this.isOpen) this.socket.send(written(ask));
  }

  keep() {
    sessionStorage.setItem(this.store, JSON.stringify({ session: this.session, asks: Object.fromEntries(this.lasting) }));
  }
}
