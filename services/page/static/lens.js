// Where the camera stands, and which point of the world is under a point of the picture.
// World frame: metres, z up; the antagonist (the player) stands at +x and looks along -x.

export const VIEWS = {
  player: { eye: [2.2, -0.72, 1.86], aim: [-0.3, 0.02, 1.05], fov: 43 },
  audience: { eye: [0.55, -3.3, 1.62], aim: [0.0, 0.0, 0.98], fov: 43 },
};
const WIDEST = 1.55; // below this aspect the picture keeps its width and gains height

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
];
const unit = (a) => { const size = Math.hypot(...a); return a.map((n) => n / size); };

/** Return the vertical field of view in degrees for a picture's width over its height. */
export function fieldOfView(view, aspect) {
  const tangent = Math.tan((view.fov * Math.PI) / 360);
  const widened = aspect < WIDEST ? (tangent * WIDEST) / aspect : tangent;
  return (Math.atan(widened) * 360) / Math.PI;
}

function frame(view, aspect) {
  const ahead = unit(sub(view.aim, view.eye));
  const right = unit(cross(ahead, [0, 0, 1]));
  const up = cross(right, ahead);
  const tangent = Math.tan((fieldOfView(view, aspect) * Math.PI) / 360);
  return { ahead, right, up, tangent };
}

/** Return where a point of the picture (x, y in -1..1, y up) lies in the plane of one world x. */
export function pointAt(view, aspect, x, y, depth) {
  const { ahead, right, up, tangent } = frame(view, aspect);
  const way = ahead.map((n, i) => n + right[i] * x * tangent * aspect + up[i] * y * tangent);
  if (way[0] > -1e-3) return null; // looks past that plane
  const far = (depth - view.eye[0]) / way[0];
  return view.eye.map((n, i) => n + far * way[i]);
}

/** Return the point of the picture (x, y in -1..1) at which a point of the world is seen. */
export function seenAt(view, aspect, point) {
  const { ahead, right, up, tangent } = frame(view, aspect);
  const way = sub(point, view.eye);
  const far = dot(way, ahead);
  return [dot(way, right) / (far * tangent * aspect), dot(way, up) / (far * tangent)];
}
