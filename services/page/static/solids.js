// Solids of the scene: shapes with soft edges, and what they are made of.

import * as THREE from "./vendor/three.module.min.js";

const EDGE = 0.022; // m, largest radius of a box's edges

/** Return a box with rounded edges, half extents in metres. */
function roundedBox(half) {
  const radius = Math.min(EDGE, 0.45 * Math.min(...half));
  const [x, y, z] = half;
  const outline = new THREE.Shape();
  const [w, h] = [x - radius, y - radius];
  outline.moveTo(-w, -h).lineTo(w, -h).lineTo(w, h).lineTo(-w, h).closePath();
  const deep = Math.max(2 * (z - radius), 1e-4);
  const geometry = new THREE.ExtrudeGeometry(outline, {
    depth: deep, bevelEnabled: true, bevelThickness: radius, bevelSize: radius, bevelSegments: 3, steps: 1,
  });
  return geometry.translate(0, 0, -deep / 2);
}

/** Return the geometry of one solid; long ones lie along their own z. */
export function geometryOf({ kind, size }) {
  if (kind === "box") return roundedBox(size);
  if (kind === "sphere") return new THREE.SphereGeometry(size[0], 32, 20);
  const make = kind === "capsule"
    ? new THREE.CapsuleGeometry(size[0], 2 * size[1], 10, 28)
    : new THREE.CylinderGeometry(size[0], size[0], 2 * size[1], 36);
  return make.rotateX(Math.PI / 2); // three's lie along y
}

const materials = new Map();

/** Return a material; without a GPU a cheap one that leaves the gloss out. */
function look(isFine, matt, gloss) {
  return isFine ? new THREE.MeshStandardMaterial({ ...matt, ...gloss }) : new THREE.MeshLambertMaterial(matt);
}

/** Return the material for a colour of the model: light shells, dark joints, coloured trim. */
export function materialOf(rgba, isFine) {
  const key = rgba.join();
  if (!materials.has(key)) {
    const colour = new THREE.Color().setRGB(rgba[0], rgba[1], rgba[2], THREE.SRGBColorSpace);
    const [low, high] = [Math.min(...rgba.slice(0, 3)), Math.max(...rgba.slice(0, 3))];
    const isTrim = high - low > 0.25;
    const isDark = high < 0.3;
    materials.set(key, look(isFine, {
      color: colour,
      emissive: isTrim ? colour : new THREE.Color(0),
      emissiveIntensity: isTrim ? 0.55 : 0,
    }, {
      roughness: isDark ? 0.42 : isTrim ? 0.35 : 0.5,
      metalness: isDark ? 0.55 : isTrim ? 0.1 : 0.04,
    }));
  }
  return materials.get(key);
}

/** Return a bat: the capsule that is judged, along +x, with a guard and a grip to look at. */
export function batOf({ back, front, radius }, colour, isFine) {
  const bat = new THREE.Group();
  const bright = { color: colour, emissive: colour, emissiveIntensity: 0.6 };
  const glow = look(isFine, bright, { roughness: 0.3, metalness: 0.1 });
  const dark = look(isFine, { color: 0x14181f }, { roughness: 0.55, metalness: 0.3 });
  const steel = look(isFine, { color: 0xb9c4d2 }, { roughness: 0.25, metalness: 0.9 });
  const along = (geometry, x) => geometry.rotateZ(-Math.PI / 2).translate(x, 0, 0);
  const blade = new THREE.Mesh(along(new THREE.CapsuleGeometry(radius, front - back, 10, 24), (front + back) / 2), glow);
  const grip = new THREE.Mesh(along(new THREE.CylinderGeometry(radius + 0.004, radius + 0.004, 0.13, 24), 0.02), dark);
  const guard = new THREE.Mesh(new THREE.SphereGeometry(0.075, 32, 14, 0, 2 * Math.PI, 0, Math.PI / 2.3), steel);
  guard.geometry.rotateZ(-Math.PI / 2).translate(0.062, 0, 0);
  steel.side = THREE.DoubleSide;
  bat.add(blade, grip, guard);
  bat.traverse((mesh) => { mesh.castShadow = true; });
  bat.userData = { glow, front, back };
  return bat;
}

/** A ribbon behind a blade that fades within a third of a second. */
export class Trail {
  constructor(colour, points = 22) {
    this.points = points;
    this.rows = [];
    this.colour = new THREE.Color(colour);
    this.geometry = new THREE.BufferGeometry();
    this.place = new Float32Array(points * 6);
    this.shade = new Float32Array(points * 6);
    this.geometry.setAttribute("position", new THREE.BufferAttribute(this.place, 3));
    this.geometry.setAttribute("color", new THREE.BufferAttribute(this.shade, 3));
    const index = [];
    for (let k = 0; k + 1 < points; k++) {
      const a = 2 * k;
      index.push(a, a + 1, a + 2, a + 1, a + 3, a + 2);
    }
    this.geometry.setIndex(index);
    this.mesh = new THREE.Mesh(this.geometry, new THREE.MeshBasicMaterial({
      vertexColors: true, transparent: true, blending: THREE.AdditiveBlending, depthWrite: false,
      side: THREE.DoubleSide, fog: false,
    }));
    this.mesh.frustumCulled = false;
  }

  /** Take where the blade is now: its tip and a point further down. */
  push(tip, low) {
    const last = this.rows[0];
    const moved = last ? last.tip.distanceTo(tip) : 1;
    this.rows.unshift({ tip: tip.clone(), low: low.clone(), moved });
    this.rows.length = Math.min(this.rows.length, this.points);
    for (let k = 0; k < this.points; k++) {
      const row = this.rows[Math.min(k, this.rows.length - 1)];
      row.tip.toArray(this.place, 6 * k);
      row.low.toArray(this.place, 6 * k + 3);
      const age = 1 - k / (this.points - 1);
      const light = 0.4 * age * age * Math.min(row.moved / 0.02, 1);
      for (const [at, share] of [[0, 1], [3, 0.15]]) {
        this.shade[6 * k + at] = this.colour.r * light * share;
        this.shade[6 * k + at + 1] = this.colour.g * light * share;
        this.shade[6 * k + at + 2] = this.colour.b * light * share;
      }
    }
    this.geometry.attributes.position.needsUpdate = true;
    this.geometry.attributes.color.needsUpdate = true;
  }
}
