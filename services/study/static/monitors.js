// How the robot, the heart and the processes are, on the researcher's page; and the warnings.

import { $, draw, fill, make, put } from "./dom.js";

const GATE_WORDS = {
  disarmed: "It does not move until you arm it.",
  ramping: "It wakes up, slowly.",
  armed: "It may move.",
  holding: "It stands still for a moment",
  tripped: "It was stopped for safety",
};
const [WIDTH, HEIGHT, KEPT] = [240, 54, 120];

export function showGate({ gate, warnings }) {
  fill($("warnings"), () => warnings.map((text) => make("li", { textContent: text })), warnings);
  $("safety").dataset.mode = gate.mode ?? "";
  put($("mode"), gate.mode ?? "unknown");
  const words = gate.mode === null ? "robot_io was not heard yet." : GATE_WORDS[gate.mode];
  put($("mode-words"), gate.reason ? `${words.replace(/\.$/, "")}: ${gate.reason}.` : words);
  fill($("in-the-way"), () => gate.in_the_way.map((text) => make("li", { textContent: text })), gate.in_the_way);
}

export function showHeart({ heart }) {
  const beats = heart.beats_per_minute;
  put($("beats"), beats === null ? "–" : Math.round(beats));
  const trouble = beats === null ? "no measurement" : heart.has_contact ? "" : "no contact with the skin";
  put($("heart-words"), trouble || heart.source);
  $("heart-words").className = trouble ? "bad" : "";
  const parts = [];
  if (heart.seated !== null) parts.push(`seated ${Math.round(heart.seated)}`);
  if (heart.walking !== null) {
    parts.push(`walking ${Math.round(heart.walking)}`);
    if (beats !== null) parts.push(`now ${Math.round((100 * beats) / heart.walking)} % of walking`);
  }
  put($("baselines"), parts.join(" · ") || "no baseline yet");
  fill($("spark"), () => [sparkline(heart.recent, heart.walking)], heart.recent, heart.walking);
}

/** The last two minutes; where nothing was measured the line has a gap. */
function sparkline(recent, walking) {
  const there = recent.filter((value) => value !== null);
  const svg = draw("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img", "aria-label": "Heart rate of the last two minutes" });
  if (!there.length) return svg;
  const known = walking === null ? there : [...there, walking];
  const [low, high] = [Math.min(...known) - 4, Math.max(...known) + 4];
  const x = (k) => ((KEPT - recent.length + k) * WIDTH) / (KEPT - 1);
  const y = (value) => HEIGHT - ((value - low) * HEIGHT) / (high - low);
  if (walking !== null) svg.append(draw("line", { x1: 0, x2: WIDTH, y1: y(walking), y2: y(walking) }));
  let run = [];
  const end = () => {
    if (run.length) svg.append(draw("polyline", { points: run.join(" ") }));
    run = [];
  };
  recent.forEach((value, k) => (value === null ? end() : run.push(`${x(k).toFixed(1)},${y(value).toFixed(1)}`)));
  end();
  return svg;
}

export function showDevices({ tracker, services }) {
  const lost = tracker && !tracker.is_tracked ? `lost for ${tracker.lost_seconds.toFixed(0)} s` : "";
  const rows = [
    ["tracker", tracker !== null && tracker.is_tracked, tracker === null ? "not heard yet" : lost || "sees the bat"],
    ...services.map((service) => [service.name, service.is_alive, service.is_alive ? service.state : "not there"]),
  ];
  fill($("services"), () => rows.map(([name, isGood, state]) => make("li", { class: isGood ? "" : "bad", title: `${name}: ${state}` },
    make("span", { textContent: name }), make("small", { textContent: state }))), rows);
}
