// The page: ties the connection, the mouse, the scene, the tones and the words together.

import { Hud } from "./hud.js";
import { VIEWS, seenAt } from "./lens.js";
import { Link } from "./link.js";
import { Pointing } from "./pointing.js";
import { Tones } from "./tones.js";

const SILENT_MS = 300; // without frames for so long the picture is old and the tone stops
const $ = (id) => document.getElementById(id);
const canvas = $("scene");
const hud = new Hud();
const tones = new Tones();
const quality = new URLSearchParams(location.search).get("quality") ?? "auto";
const page = { frame: null, frameAt: 0, link: "lost", view: "player", action: "", perSecond: 0, device: "", bat: null };

const link = new Link({
  hello: (said) => {
    hud.greet(said);
    pointing.isOn = said.pointer;
    if (!said.is_person) page.view = "audience";
  },
  frame: (said) => {
    page.frame = said;
    page.frameAt = performance.now();
    tones.set(said.referee?.tone_hz ?? 0);
  },
  results: (said) => hud.list(said),
  note: (said) => hud.note(said),
  state: (state) => {
    page.link = state;
    if (state !== "open") page.frame = null;
  },
});
const pointing = new Pointing(canvas, () => VIEWS[page.view], (...pose) => link.sendPose(...pose));

function size() {
  return { width: innerWidth, height: innerHeight, ratio: devicePixelRatio };
}

/** Start to draw, in a worker where the browser can; return what takes messages. */
async function startScene() {
  const model = await (await fetch("scene.json")).json();
  if (canvas.transferControlToOffscreen) {
    const worker = new Worker("render_worker.js", { type: "module" });
    const offscreen = canvas.transferControlToOffscreen();
    worker.onmessage = ({ data }) => {
      if (data.type === "drawn") {
        [page.perSecond, page.device] = [data.perSecond, data.device];
        document.body.classList.toggle("plain", !data.isFine);
      }
      else if (data.type === "bat") page.bat = data;
      else if (data.type === "failed") hud.note({ lines: [`The scene cannot be drawn here: ${data.reason}`] });
    };
    worker.postMessage({ type: "start", canvas: offscreen, model, quality, ...size() }, [offscreen]);
    return (message) => worker.postMessage(message);
  }
  const { BoutScene } = await import("./scene.js");
  const scene = new BoutScene(canvas, model, quality);
  scene.resize(innerWidth, innerHeight, devicePixelRatio);
  return (message) => {
    if (message.type === "resize") scene.resize(message.width, message.height, message.ratio);
    else {
      scene.show(message.state, message.view);
      page.drawnHere = (page.drawnHere ?? 0) + scene.draw(performance.now());
    }
  };
}

function act(action) {
  tones.start();
  if (action === "arm" || action === "reset" || action === "disarm") link.ask({ type: "gate", action });
  else if (action) link.ask({ type: "bout", action });
}

function bind() {
  $("primary").addEventListener("click", (event) => {
    act(event.currentTarget.dataset.action);
    event.currentTarget.blur();
  });
  for (const action of ["pause", "abandon", "disarm"]) {
    $(action).addEventListener("click", (event) => {
      act(action);
      event.currentTarget.blur();
    });
  }
  $("mute").addEventListener("click", (event) => {
    toggleSound();
    event.currentTarget.blur();
  });
  $("choice").addEventListener("change", (event) => {
    link.ask({ type: "player", name: event.target.value });
    event.target.blur();
  });
  $("overlay-button").addEventListener("click", () => link.connect());
  window.addEventListener("pointerdown", () => tones.start());
  window.addEventListener("resize", () => page.draw?.({ type: "resize", ...size() }));
  document.addEventListener("visibilitychange", () => document.hidden && tones.set(0));
  window.addEventListener("keydown", onKey);
}

function toggleSound() {
  tones.start();
  tones.mute(!tones.isMuted);
  $("mute").textContent = tones.isMuted ? "Sound off" : "Sound on";
  $("mute").setAttribute("aria-pressed", String(tones.isMuted));
}

function onKey(event) {
  const key = event.key.toLowerCase();
  if (event.repeat || event.ctrlKey || event.metaKey || event.target instanceof HTMLSelectElement) return;
  if (key === " " && !(event.target instanceof HTMLButtonElement)) {
    event.preventDefault();
    if (!$("pause").hidden) act("pause");
    else if (["start", "resume"].includes(page.action)) act(page.action); // arming takes a click
  } else if (key === "escape" && !$("abandon").hidden) act("abandon");
  else if (key === "m") toggleSound();
  else if (key === "v") page.view = page.view === "player" ? "audience" : "player";
  else if (key === "l") pointing.toggleLock();
  else if (key === "h") document.body.classList.toggle("no-help");
}

function loop(now) {
  if (now - page.frameAt > SILENT_MS) tones.set(0);
  page.action = hud.show(page.frame, page.link)[0];
  page.draw?.({ type: "show", state: page.frame, view: page.view });
  requestAnimationFrame(loop);
}

let secondsFrom = performance.now();
function everySecond() {
  const now = performance.now();
  if (page.drawnHere !== undefined) {
    page.perSecond = (1000 * page.drawnHere) / (now - secondsFrom);
    page.drawnHere = 0;
  }
  secondsFrom = now;
  const latency = link.latency();
  hud.showMeters(latency, page.perSecond);
  link.ask({
    type: "stats", frames_per_s: page.perSecond, latency_p50_ms: latency?.p50 ?? 0, latency_p90_ms: latency?.p90 ?? 0,
  });
}

/** What tests read: nothing here changes anything. */
window.riposte = {
  frame: () => page.frame,
  action: () => page.action,
  latency: (seconds) => link.latency(seconds),
  sound: () => tones.measure(),
  drawn: () => ({ perSecond: page.perSecond, device: page.device }),
  tip: () => pointing.tip(),
  depth: () => pointing.depth,
  seenAt: (point) => {
    const [x, y] = seenAt(VIEWS[page.view], innerWidth / innerHeight, point);
    return [((x + 1) / 2) * innerWidth, ((1 - y) / 2) * innerHeight];
  },
  askBat: () => page.draw?.({ type: "bat" }),
  bat: () => page.bat,
};

bind();
setInterval(everySecond, 1000);
requestAnimationFrame(loop);
page.draw = await startScene();
