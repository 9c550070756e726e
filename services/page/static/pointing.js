// Mouse, wheel and keys: where the tip of the player's bat is wanted.

import { pointAt } from "./lens.js";

const HEARTBEAT_MS = 10;
const WHEEL_M = 0.0005; // metres a pixel of the wheel
const LUNGE_M = 0.38;
const KEY_SPEED = { depth: 0.9, roll: 3.0 }; // m/s, rad/s
const HELD = { w: ["depth", -1], s: ["depth", 1], arrowup: ["depth", -1], arrowdown: ["depth", 1],
  q: ["roll", -1], e: ["roll", 1], arrowleft: ["roll", -1], arrowright: ["roll", 1] };

export class Pointing {
  /** canvas: what is pointed at; view(): the present view; send(tip, roll, isValid, eventAt). */
  constructor(canvas, view, send) {
    this.canvas = canvas;
    this.view = view;
    this.send = send;
    this.isOn = false; // whether this page has a bat at all
    this.at = null; // pixels
    this.depth = 0.42;
    this.range = [-0.42, 0.62];
    this.roll = 0;
    this.isLunging = false;
    this.keys = new Set();
    this.stepAt = performance.now();
    const kind = "onpointerrawupdate" in window ? "pointerrawupdate" : "pointermove";
    window.addEventListener(kind, (event) => this.move(event));
    window.addEventListener("pointerdown", (event) => this.press(event));
    window.addEventListener("pointerup", () => { this.isLunging = false; });
    window.addEventListener("blur", () => { this.isLunging = false; this.keys.clear(); });
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    window.addEventListener("keydown", (event) => this.key(event, true));
    window.addEventListener("keyup", (event) => this.key(event, false));
    document.addEventListener("visibilitychange", () => this.say(NaN));
    setInterval(() => this.beat(), HEARTBEAT_MS);
  }

  get isLocked() {
    return document.pointerLockElement === this.canvas;
  }

  toggleLock() {
    if (this.isLocked) document.exitPointerLock();
    else this.canvas.requestPointerLock?.({ unadjustedMovement: false });
  }

  move(event) {
    if (this.isLocked && this.at) {
      const { clientWidth: width, clientHeight: height } = this.canvas;
      this.at = [
        Math.min(Math.max(this.at[0] + event.movementX, 0), width),
        Math.min(Math.max(this.at[1] + event.movementY, 0), height),
      ];
    } else {
      this.at = [event.clientX, event.clientY];
    }
    this.say(event.timeStamp);
  }

  press(event) {
    if (event.target === this.canvas && event.button === 0) this.isLunging = true;
    this.move(event);
  }

  wheel(event) {
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === 1 ? 33 : 1);
    this.setDepth(this.depth + pixels * WHEEL_M);
    this.say(event.timeStamp);
  }

  key(event, isDown) {
    const key = event.key.toLowerCase();
    if (event.target instanceof HTMLSelectElement) return;
    if (isDown && key === "r") this.roll = 0;
    if (!(key in HELD) || event.ctrlKey || event.metaKey) return;
    if (isDown) this.keys.add(key);
    else this.keys.delete(key);
  }

  setDepth(depth) {
    this.depth = Math.min(Math.max(depth, this.range[0]), this.range[1]);
  }

  /** Go on with what is held, and say it: robot_io takes a tracker that is silent for lost. */
  beat() {
    const now = performance.now();
    const seconds = Math.min((now - this.stepAt) / 1000, 0.1);
    this.stepAt = now;
    for (const key of this.keys) {
      const [what, sign] = HELD[key];
      if (what === "depth") this.setDepth(this.depth + sign * KEY_SPEED.depth * seconds);
      else this.roll += sign * KEY_SPEED.roll * seconds;
    }
    this.roll = Math.atan2(Math.sin(this.roll), Math.cos(this.roll));
    if (!document.hidden) this.say(NaN);
  }

  /** Return where the tip is wanted, null before the mouse was seen. */
  tip() {
    if (!this.at) return null;
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const x = (2 * this.at[0]) / width - 1;
    const y = 1 - (2 * this.at[1]) / height;
    const depth = this.isLunging ? Math.max(this.depth - LUNGE_M, this.range[0]) : this.depth;
    return pointAt(this.view(), width / height, x, y, depth);
  }

  say(eventAt) {
    const tip = this.isOn ? this.tip() : null;
    if (tip) this.send(tip, this.roll, !document.hidden, eventAt);
  }
}
