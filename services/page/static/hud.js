// Everything on the page that is read: score, clock, gate, advice, notes, list of bouts.

const $ = (id) => document.getElementById(id);
const NOTE_MS = 6000;
const MAX_NOTES = 3;
const BEST = 5;

const GATE_WORDS = {
  disarmed: "does not move until somebody arms it.",
  ramping: "is being woken up, slowly.",
  armed: "is armed, and holds still without a bout.",
  holding: "stands still for a moment",
  tripped: "was stopped for safety",
};

const signed = (points) => (points > 0 ? `+${points}` : String(points).replace("-", "−"));
const seconds = (steps) => `${(steps / 100).toFixed(2)} s`;

function put(id, text) {
  const element = $(id);
  if (element.textContent !== text) element.textContent = text;
}

/** Set an attribute of the page that styles look at; untouched ones cost nothing. */
function mark(name, value) {
  if (document.body.dataset[name] !== value) document.body.dataset[name] = value;
}

export class Hud {
  constructor() {
    this.hello = null;
    this.results = [];
  }

  greet(hello) {
    this.hello = hello;
    document.body.classList.toggle("led", hello.is_led);
    $("choice").replaceChildren(...hello.players.map((name) => new Option(name, name)));
    $("choice").value = hello.chosen;
    put("who-antagonist", hello.is_person ? "You" : hello.antagonist);
    const { point, penalty, camping_award: award, camping_seconds: camping } = hello.rules;
    const whose = hello.is_person ? "your" : "the antagonist's";
    put("rules", `Every 10 ms: ${signed(point)} with ${whose} bat in the target, ${signed(penalty)} if the bats `
      + `touch then, ${signed(award)} when the robot's bat has waited in it for over ${camping} s. `
      + "It sounds high for points, low for a penalty.");
    $("help-person").hidden = !hello.pointer;
  }

  /** Show one frame; link is "open", "lost" or "taken". */
  show(frame, link) {
    const referee = frame?.referee;
    const step = frame?.step ?? "idle";
    const isOn = referee && (referee.phase === "running" || referee.phase === "paused");
    this.showScore(referee, step, isOn);
    this.showGate(frame);
    this.showBig(frame, referee, step);
    this.showOverlay(frame, link);
    const action = this.primaryAction(frame, step);
    this.showActions(action, step, referee, isOn);
    mark("step", step);
    return action;
  }

  showScore(referee, step, isOn) {
    const whole = this.hello?.bout_seconds ?? 20;
    const isNew = step === "countdown" || !referee || referee.bout === "";
    const played = isNew ? 0 : referee.seconds;
    put("clock", Math.max(whole - played, 0).toFixed(1));
    const rest = `scaleX(${Math.max(1 - played / whole, 0).toFixed(2)})`;
    if ($("progress").style.transform !== rest) $("progress").style.transform = rest;
    put("score", isNew ? "0" : signed(Math.round(referee.score)).replace("+", ""));
    const running = referee?.phase === "running";
    const isIn = running && referee.in_target[0];
    const camps = running && referee.points > 1;
    let [word, verdict] = ["\u00a0", ""];
    if (isIn && referee.contact) [word, verdict] = ["▼ CAUGHT −10", "loss"];
    else if (camps) [word, verdict] = ["▲ THE GUARD WAITS TOO LONG +10", "gain"];
    else if (isIn) [word, verdict] = ["▲ SCORING +1", "gain"];
    else if (running && referee.contact) word = "bats touch";
    else if (referee?.phase === "paused") word = "PAUSED";
    put("verdict", word);
    mark("verdict", verdict);
    put("attack", seconds(isNew ? 0 : referee.attack_steps));
    put("penalty", seconds(isNew ? 0 : referee.penalty_steps));
    put("camping", seconds(isNew ? 0 : referee.camping_steps));
    if (referee?.protagonist && isOn) put("who-protagonist", this.opponentName(referee.protagonist));
    else if (this.hello) put("who-protagonist", this.opponentName(""));
  }

  opponentName(reference) {
    return $("choice").value || reference.slice(0, 16) || "the robot";
  }

  showGate(frame) {
    const gate = frame?.gate;
    mark("gate", gate?.mode ?? "");
    put("gate-mode", gate?.mode ?? "robot");
    let words = gate ? `The robot ${GATE_WORDS[gate.mode]}` : "not heard of yet";
    if (gate?.mode === "disarmed" && gate.reason.startsWith("disarmed ")) words = `The robot was ${gate.reason}.`;
    if (gate?.mode === "armed" && frame.step === "bout") words = "The robot fences.";
    if (gate?.reason && (gate.mode === "holding" || gate.mode === "tripped")) words += `: ${gate.reason}.`;
    put("gate-words", words);
    $("disarm").hidden = !gate || gate.mode === "disarmed" || gate.mode === "tripped";
    const heart = frame?.heart_rate;
    $("heart-row").hidden = heart == null;
    if (heart != null) put("heart", `${Math.round(heart)} /min`);
    const factor = frame?.rates?.real_time_factor;
    put("rtf", factor === undefined ? "–" : `× ${factor.toFixed(2)}`);
    $("rtf").className = factor !== undefined && factor < 0.97 ? "slow" : "";
  }

  showMeters(latency, perSecond) {
    put("latency", latency ? `${latency.p50.toFixed(1)} ms` : "–");
    put("fps", perSecond ? `${perSecond.toFixed(0)} /s` : "–");
  }

  showBig(frame, referee, step) {
    const left = frame?.left ?? 0;
    let [text, isWord] = ["", false];
    if (step === "countdown") text = String(Math.max(Math.ceil(left), 1));
    else if (referee?.phase === "running" && referee.seconds < 0.6) [text, isWord] = ["ALLEZ!", true];
    put("big", text);
    $("big").className = isWord ? "word" : "";
  }

  showOverlay(frame, link) {
    let card = null;
    if (link === "taken") {
      card = ["Another page plays now", "Only one page at a time holds the bat. You can have it back.", "Play here"];
    } else if (link === "lost") {
      card = ["No connection", "The page's service does not answer; trying again …", ""];
    } else if (!frame) {
      card = ["One moment", "waiting for the service …", ""];
    } else if (frame.missing.length) {
      const who = frame.missing.join(" and ");
      card = [`Waiting for ${who} …`, "It is starting, or was stopped. See `riposte status`, and the logs in the run's folder.", ""];
    }
    $("overlay").hidden = card === null;
    if (!card) return;
    put("overlay-title", card[0]);
    put("overlay-text", card[1]);
    $("overlay-button").hidden = !card[2];
    put("overlay-button", card[2]);
  }

  /** Return what the large button does now: [action, label, advice]; action "" does nothing. */
  primaryAction(frame, step) {
    const mode = frame?.gate?.mode;
    const referee = frame?.referee;
    const left = Math.ceil(frame?.left ?? 0);
    if (!frame || !mode || frame.missing.length) return ["", "…", ""];
    if (this.hello?.is_led) {
      const isLost = this.hello.pointer && frame.is_lost;
      return ["", "", isLost ? "Move the mouse over the scene to take your bat." : ""];
    }
    if (step === "countdown") return ["", "En garde …", "Your bat may already move."];
    if (mode === "tripped") return ["reset", "Reset the safety stop", `Stopped: ${frame.gate.reason}. Look why before you reset.`];
    if (mode === "disarmed") return ["arm", "Arm the robot", "Arming lets the robot move. It goes slowly at first, and holds still without a bout."];
    if (step === "bout" && referee?.phase === "paused") {
      return ["resume", "Go on", referee.reason ? `Paused: ${referee.reason}.` : "Paused."];
    }
    if (step === "bout") return ["pause", "Pause", ""];
    if (mode === "ramping") return ["", "The robot wakes up …", ""];
    if (this.hello?.pointer && frame.is_lost) return ["", "Start the bout", "Move the mouse over the scene to take your bat."];
    if (step === "rest") return ["start", "Rematch", `Well fenced. Rest for ${left} s, or go on at once.`];
    if (referee?.phase === "void") return ["start", "Start a new bout", `The last bout is void: ${referee.reason || "abandoned"}.`];
    return ["start", "Start the bout", "Reach the glowing sphere with your bat, and avoid the robot's."];
  }

  showActions([action, label, advice], step, referee, isOn) {
    const primary = $("primary");
    primary.disabled = action === "";
    primary.dataset.action = action;
    put("primary", label);
    const isLed = this.hello?.is_led ?? false;
    primary.hidden = action === "pause" || isLed;
    put("advice", advice);
    $("pause").hidden = referee?.phase !== "running" || isLed;
    $("abandon").hidden = !(isOn || step === "countdown") || isLed;
    $("choice").disabled = isOn || step === "countdown";
  }

  list(said) {
    this.results = said.results;
    if (said.chosen) $("choice").value = said.chosen;
    const last = this.results.at(-1);
    const best = [...this.results].sort((a, b) => b.score - a.score).slice(0, BEST);
    if (last && !best.includes(last)) best[BEST - 1] = last;
    if (!best.length) return;
    $("results").replaceChildren(...best.map((result) => {
      const row = document.createElement("li");
      const name = document.createElement("span");
      const score = document.createElement("b");
      name.textContent = `${result.number}. against ${result.opponent}`;
      score.textContent = signed(Math.round(result.score)).replace("+", "");
      row.append(name, score);
      if (result === last) row.className = "last";
      return row;
    }));
  }

  note({ is_done: isDone, lines }) {
    for (const line of lines) {
      const row = document.createElement("li");
      row.textContent = line;
      row.className = isDone ? "good" : "";
      $("notes").append(row);
      setTimeout(() => row.remove(), NOTE_MS);
    }
    while ($("notes").childElementCount > MAX_NOTES) $("notes").firstElementChild.remove();
  }
}
