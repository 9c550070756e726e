// The room around the bout: light, floor, piste, target.

import * as THREE from "./vendor/three.module.min.js";

const GROUND = 0x070a10;

/** Add lights; shadows and reflections only where the machine can draw them. */
export function addLight(scene, renderer, isFine) {
  scene.background = new THREE.Color(GROUND);
  scene.fog = new THREE.Fog(GROUND, 4.5, 11);
  scene.add(new THREE.HemisphereLight(0xa9c4ff, 0x14100c, isFine ? 0.5 : 1.0));
  const key = new THREE.SpotLight(0xfff1dd, 62, 14, 0.55, 0.55, 1.7);
  key.position.set(1.2, -2.1, 4.4);
  key.target.position.set(-0.35, 0, 0.5);
  key.castShadow = isFine;
  key.shadow.mapSize.set(2048, 2048);
  key.shadow.camera.near = 1.5;
  key.shadow.camera.far = 9;
  key.shadow.bias = -0.0004;
  key.shadow.normalBias = 0.015;
  key.shadow.radius = 5;
  const cold = new THREE.DirectionalLight(0x6aa8ff, 1.5);
  cold.position.set(-3.2, 1.6, 2.6);
  const warm = new THREE.DirectionalLight(0xff9a5c, 0.55);
  warm.position.set(2.5, 3.0, 1.4);
  scene.add(key, key.target, cold, warm);
  if (isFine) addReflections(scene, renderer);
}

/** Make what shells and steel mirror: a dark room with three soft lamps. */
function addReflections(scene, renderer) {
  const room = new THREE.Scene();
  room.background = new THREE.Color(0x05070b);
  const lamp = (colour, strength, place, size) => {
    const material = new THREE.MeshBasicMaterial({ color: new THREE.Color(colour).multiplyScalar(strength), side: THREE.DoubleSide });
    const mesh = new THREE.Mesh(new THREE.PlaneGeometry(...size), material);
    mesh.position.set(...place);
    mesh.lookAt(0, 0, 0);
    room.add(mesh);
  };
  lamp(0xfff0dc, 7, [2, -3, 5], [3, 1.4]);
  lamp(0x7fb2ff, 5, [-5, 2, 2.5], [1.4, 4]);
  lamp(0xff9a60, 2.4, [3, 5, 1], [1, 3]);
  const maker = new THREE.PMREMGenerator(renderer);
  scene.environment = maker.fromScene(room, 0.04).texture;
  scene.environmentIntensity = 0.5;
  maker.dispose();
}

/** Draw the floor's picture: a piste with its lines on dark tiles. */
function floorPicture() {
  const size = 1024; // 12 m
  const canvas = new OffscreenCanvas(size, size);
  const pen = canvas.getContext("2d");
  const at = (metres) => (metres / 12 + 0.5) * size;
  const wide = (metres) => (metres / 12) * size;
  pen.fillStyle = "#141a24";
  pen.fillRect(0, 0, size, size);
  pen.strokeStyle = "#1d2634";
  pen.lineWidth = 1.5;
  for (let k = -6; k <= 6; k++) {
    pen.strokeRect(at(k), 0, 0.1, size);
    pen.strokeRect(0, at(k), size, 0.1);
  }
  const strip = pen.createLinearGradient(at(-4), 0, at(4), 0);
  strip.addColorStop(0, "#19283c");
  strip.addColorStop(0.5, "#2a3444");
  strip.addColorStop(1, "#3a2a22");
  pen.fillStyle = strip;
  pen.fillRect(at(-4.2), at(-0.95), wide(8.4), wide(1.9));
  pen.fillStyle = "rgba(220, 232, 250, 0.75)";
  pen.fillRect(at(-4.2), at(-0.96), wide(8.4), wide(0.028));
  pen.fillRect(at(-4.2), at(0.932), wide(8.4), wide(0.028));
  for (const [x, light] of [[0, 0.5], [-0.7, 0.28], [0.7, 0.28], [-2, 0.28], [2, 0.28]]) {
    pen.fillStyle = `rgba(220, 232, 250, ${light})`;
    pen.fillRect(at(x - 0.014), at(-0.95), wide(0.028), wide(1.9));
  }
  const edge = pen.createRadialGradient(at(0), at(0), wide(2.6), at(0), at(0), wide(6));
  edge.addColorStop(0, "rgba(0, 0, 0, 0)");
  edge.addColorStop(1, "rgba(0, 0, 0, 1)");
  pen.fillStyle = edge;
  pen.fillRect(0, 0, size, size);
  const picture = new THREE.CanvasTexture(canvas);
  picture.colorSpace = THREE.SRGBColorSpace;
  picture.anisotropy = 8;
  return picture;
}

export function addFloor(scene, isFine) {
  const map = floorPicture();
  const look = isFine
    ? new THREE.MeshStandardMaterial({ map, roughness: 0.62, metalness: 0.15 })
    : new THREE.MeshLambertMaterial({ map });
  const floor = new THREE.Mesh(new THREE.PlaneGeometry(12, 12), look);
  floor.receiveShadow = isFine;
  scene.add(floor);
}

const TARGET_LIGHT = { free: 0xffb629, scores: 0xffe08a, penalty: 0xff3f5e, guarded: 0x4aa5ff };

/** The target: a sphere that is bright at its rim, and a ring where the tip's plane cuts it. */
export class Target {
  constructor(scene, { centre, radius }) {
    this.radius = radius;
    this.x = centre[0];
    this.colour = new THREE.Color(TARGET_LIGHT.free);
    this.strength = 1;
    this.uniforms = { colour: { value: this.colour }, strength: { value: 1 } };
    const shader = new THREE.ShaderMaterial({
      uniforms: this.uniforms, transparent: true, depthWrite: false, blending: THREE.AdditiveBlending,
      vertexShader: `
        varying vec3 side; varying vec3 eye;
        void main() {
          vec4 seen = modelViewMatrix * vec4(position, 1.0);
          side = normalMatrix * normal; eye = -seen.xyz;
          gl_Position = projectionMatrix * seen;
        }`,
      fragmentShader: `
        uniform vec3 colour; uniform float strength;
        varying vec3 side; varying vec3 eye;
        void main() {
          float rim = 1.0 - abs(dot(normalize(side), normalize(eye)));
          gl_FragColor = vec4(colour * (0.10 + 0.95 * pow(rim, 2.6)) * strength, 1.0);
        }`,
    });
    const ball = new THREE.Mesh(new THREE.SphereGeometry(radius, 48, 32), shader);
    ball.position.set(...centre);
    const line = new THREE.MeshBasicMaterial({ color: this.colour, transparent: true, opacity: 0.9, fog: false });
    this.ring = new THREE.Mesh(new THREE.TorusGeometry(1, 0.018, 8, 64), line);
    this.ring.rotation.y = Math.PI / 2;
    this.ring.position.set(...centre);
    this.ringLine = line;
    const foot = new THREE.Mesh(new THREE.RingGeometry(radius * 0.94, radius, 48), new THREE.MeshBasicMaterial({
      color: TARGET_LIGHT.free, transparent: true, opacity: 0.35, depthWrite: false,
    }));
    foot.position.set(centre[0], centre[1], 0.004);
    this.light = new THREE.PointLight(TARGET_LIGHT.free, 0.9, 2.2, 1.8);
    this.light.position.set(...centre);
    scene.add(ball, this.ring, foot, this.light);
  }

  /** state: free, scores, penalty, guarded; tipX: where the player's tip plane is, null without. */
  show(state, tipX, seconds) {
    const wanted = new THREE.Color(TARGET_LIGHT[state]);
    const share = 1 - Math.exp(-seconds / 0.05);
    this.colour.lerp(wanted, share);
    const loud = state === "scores" || state === "penalty" ? 2.3 : 1;
    this.strength += (loud - this.strength) * share;
    this.uniforms.strength.value = this.strength;
    this.light.color.copy(this.colour);
    this.light.intensity = 0.9 * this.strength * this.strength;
    const off = tipX === null ? this.radius : tipX - this.x;
    const cut = Math.sqrt(Math.max(this.radius * this.radius - off * off, 0));
    this.ring.visible = cut > 0.01;
    this.ring.scale.setScalar(Math.max(cut, 0.01));
    this.ring.position.x = this.x + off;
    this.ringLine.color.copy(this.colour);
  }
}
