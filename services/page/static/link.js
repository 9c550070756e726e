// The connection to the service: frames and notes in, poses and wishes out; connects again by itself.

const POSE_BYTES = 48; // float64[6]: sequence, x, y, z, roll, is_valid
const MAX_WAITING = 4096; // bytes; with more in the socket a pose is left out
const KEPT = 1024;
const RETRY_MS = 700;
const TAKEN_OVER = 4001;

export class Link {
  /** on: {hello, frame, results, note, state}; state is "open", "lost" or "taken". */
  constructor(on) {
    this.on = on;
    this.socket = null;
    this.sequence = -1;
    this.lastEcho = -1;
    this.eventAt = new Float64Array(KEPT).fill(NaN);
    this.latencies = [];
    this.pose = new DataView(new ArrayBuffer(POSE_BYTES));
    this.connect();
  }

  connect() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/bout`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.sequence = this.lastEcho = -1;
      this.eventAt.fill(NaN);
      this.on.state("open");
    };
    socket.onmessage = (event) => this.receive(JSON.parse(event.data));
    socket.onclose = (event) => {
      if (this.socket !== socket) return;
      this.socket = null;
      if (event.code === TAKEN_OVER) {
        this.on.state("taken");
        return;
      }
      this.on.state("lost");
      setTimeout(() => this.socket || this.connect(), RETRY_MS);
    };
    this.socket = socket;
  }

  get isOpen() {
    return this.socket !== null && this.socket.readyState === WebSocket.OPEN;
  }

  receive(said) {
    if (said.type === "frame") this.measure(said.echo);
    this.on[said.type]?.(said);
  }

  /** Note how long ago the pointer's events happened that this frame's bat state is made of. */
  measure(echo) {
    if (echo <= this.lastEcho) return;
    const now = performance.now();
    for (let k = Math.max(this.lastEcho + 1, echo - KEPT + 1); k <= echo; k++) {
      const at = this.eventAt[k % KEPT];
      if (!Number.isNaN(at)) this.latencies.push([now, now - at]);
    }
    this.lastEcho = echo;
    while (this.latencies.length > 4 * KEPT) this.latencies.shift();
  }

  /** Return the quantiles of the input latency (ms) over the last seconds; null without one. */
  latency(seconds = 5) {
    const from = performance.now() - 1000 * seconds;
    const times = this.latencies.filter(([at]) => at >= from).map(([, ms]) => ms).sort((a, b) => a - b);
    if (!times.length) return null;
    const at = (share) => times[Math.min(times.length - 1, Math.floor(share * times.length))];
    return { p50: at(0.5), p90: at(0.9), p99: at(0.99), count: times.length };
  }

  /** Say where the tip is wanted; eventAt is when the pointer moved (ms), NaN for a heartbeat. */
  sendPose(tip, roll, isValid, eventAt) {
    if (!this.isOpen || this.socket.bufferedAmount > MAX_WAITING) return;
    this.sequence += 1;
    this.eventAt[this.sequence % KEPT] = eventAt;
    const numbers = [this.sequence, ...tip, roll, isValid ? 1 : 0];
    numbers.forEach((number, k) => this.pose.setFloat64(8 * k, number, true));
    this.socket.send(this.pose.buffer);
  }

  ask(wish) {
    if (this.isOpen) this.socket.send(JSON.stringify(wish));
  }
}
