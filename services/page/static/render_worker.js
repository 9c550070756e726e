// Draws the bout away from the page's own thread, so that drawing never holds up the mouse.

import { BoutScene } from "./scene.js";

const next = self.requestAnimationFrame?.bind(self) ?? ((draw) => setTimeout(() => draw(performance.now()), 16));
let scene = null;
let drawn = 0;
let since = performance.now();

function loop(now) {
  drawn += scene.draw(now);
  if (now - since >= 1000) {
    postMessage({ type: "drawn", perSecond: (1000 * drawn) / (now - since), device: scene.device, isFine: scene.isFine });
    scene.adapt((1000 * drawn) / (now - since));
    [drawn, since] = [0, now];
  }
  next(loop);
}

self.onmessage = ({ data }) => {
  if (data.type === "start") {
    try {
      scene = new BoutScene(data.canvas, data.model, data.quality);
    } catch (error) {
      postMessage({ type: "failed", reason: String(error?.message ?? error) });
      return;
    }
    scene.resize(data.width, data.height, data.ratio);
    next(loop);
  } else if (scene === null) {
    return;
  } else if (data.type === "resize") {
    scene.resize(data.width, data.height, data.ratio);
  } else if (data.type === "show") {
    scene.show(data.state, data.view);
  } else if (data.type === "bat") {
    postMessage({ type: "bat", ends: scene.kinematicBat(), state: scene.state });
  }
};
