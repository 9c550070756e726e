// The bout in three dimensions, from the model's own geometry; runs on the page or in a worker.

import * as THREE from "./vendor/three.module.min.js";
import { VIEWS, fieldOfView } from "./lens.js";
import { Trail, batOf, geometryOf, materialOf } from "./solids.js";
import { Target, addFloor, addLight } from "./studio.js";

const COLOURS = [0xff6d1f, 0x2389ff]; // antagonist, protagonist
const SLOW = /swiftshader|llvmpipe|software|basic render/i;
const PLAIN_RATIO = 0.6; // pixels of the picture for each of the page, without a GPU
const PLAIN_MS = 50; // from picture to picture there: the loop that moves the bats needs the processor
const STILL_MS = 1000;
const TOO_FEW = 40; // pictures a second; with fewer, a GPU gets fewer pixels to draw
const LEAST_SCALE = 0.5;

const quaternion = ([w, x, y, z]) => new THREE.Quaternion(x, y, z, w);

export class BoutScene {
  /** canvas: HTML or offscreen; model: scene.json; quality: "fine", "plain", "auto", or "still", a
   *  picture a second. */
  constructor(canvas, model, quality) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: quality === "fine" || quality === "auto", powerPreference: "high-performance" });
    const gl = this.renderer.getContext();
    const info = gl.getExtension("WEBGL_debug_renderer_info");
    this.device = String(gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    this.isFine = quality === "fine" || (quality === "auto" && !SLOW.test(this.device));
    this.restMs = this.isFine ? 0 : quality === "still" ? STILL_MS : PLAIN_MS;
    this.renderer.shadowMap.enabled = this.isFine;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.renderer.toneMapping = THREE.ACESFilmicToneMapping;
    this.renderer.toneMappingExposure = 1.12;
    this.scene = new THREE.Scene();
    addLight(this.scene, this.renderer, this.isFine);
    addFloor(this.scene, this.isFine);
    this.target = new Target(this.scene, model.target);
    this.model = model;
    this.addBodies(model);
    this.bats = COLOURS.map((colour) => batOf(model.bat, colour, this.isFine));
    this.trails = COLOURS.map((colour) => new Trail(colour));
    this.spark = new THREE.PointLight(0xffffff, 0, 1.6, 1.6);
    this.plumb = this.addPlumb();
    this.scene.add(...this.bats, ...this.trails.map((trail) => trail.mesh), this.spark);
    this.camera = new THREE.PerspectiveCamera(40, 1, 0.05, 30);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(...VIEWS.player.eye);
    this.aim = new THREE.Vector3(...VIEWS.player.aim);
    this.view = VIEWS.player;
    this.aspect = 1;
    this.size = [1, 1, 1];
    this.scale = quality === "auto" && this.isFine ? 1 : null; // of the pixels; null: as they are
    this.seconds = 0;
    this.state = null;
    this.drawnAt = 0;
  }

  /** Hang the solids on the bodies, the bodies on each other. */
  addBodies(model) {
    this.links = model.links.map((link) => {
      const group = new THREE.Group();
      group.position.set(...link.position);
      const rest = quaternion(link.quaternion);
      group.quaternion.copy(rest);
      const axis = link.axis && new THREE.Vector3(...link.axis);
      return { group, rest, axis, joint: link.joint, name: link.name };
    });
    this.robots = [new THREE.Group(), new THREE.Group()];
    model.links.forEach((link, k) => {
      if (link.parent < 0) return;
      const side = link.name.startsWith("antagonist") ? 0 : 1;
      const onWorld = model.links[link.parent].parent < 0;
      (onWorld ? this.robots[side] : this.links[link.parent].group).add(this.links[k].group);
    });
    for (const solid of model.solids) {
      if (solid.body === 0 || solid.name.endsWith("/bat")) continue; // floor, target and bats are ours
      const mesh = new THREE.Mesh(geometryOf(solid), materialOf(solid.rgba, this.isFine));
      mesh.position.set(...solid.position);
      mesh.quaternion.copy(quaternion(solid.quaternion));
      mesh.castShadow = mesh.receiveShadow = this.isFine;
      this.links[solid.body].group.add(mesh);
    }
    this.robots[0].visible = false;
    this.scene.add(...this.robots);
    this.setJoints(model.en_garde);
  }

  /** Add a thin line from the player's tip to the floor: how far forward it is. */
  addPlumb() {
    const material = new THREE.MeshBasicMaterial({ color: COLOURS[0], transparent: true, opacity: 0.28, depthWrite: false });
    const line = new THREE.Mesh(new THREE.CylinderGeometry(0.003, 0.003, 1, 6).rotateX(Math.PI / 2), material);
    const foot = new THREE.Mesh(new THREE.RingGeometry(0.035, 0.05, 32), material);
    foot.position.z = 0.006;
    this.scene.add(line, foot);
    return { line, foot };
  }

  setJoints(joints) {
    for (const { group, rest, axis, joint } of this.links) {
      if (joint < 0) continue;
      const angle = joints[Math.floor(joint / 7)][joint % 7];
      group.quaternion.copy(rest).multiply(new THREE.Quaternion().setFromAxisAngle(axis, angle));
    }
  }

  resize(width, height, ratio) {
    this.size = [width, height, ratio];
    this.aspect = width / Math.max(height, 1);
    this.renderer.setPixelRatio(this.isFine ? Math.min(ratio, 2) * (this.scale ?? 1) : PLAIN_RATIO);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = this.aspect;
  }

  /** Draw fewer pixels where a whole second had too few pictures; called once a second. */
  adapt(perSecond) {
    this.seconds += 1; // the first ones are spent on shaders, a hidden page draws nothing
    if (this.scale === null || this.seconds < 4 || perSecond < 5 || perSecond >= TOO_FEW) return;
    this.scale = Math.max(0.8 * this.scale, LEAST_SCALE);
    this.resize(...this.size);
  }

  /** Take the newest frame of the service, and which view is wanted. */
  show(state, view) {
    this.state = state;
    this.view = VIEWS[view] ?? VIEWS.player;
  }

  /** Draw, if it is time to; return whether it was; now in ms. */
  draw(now) {
    if (now - this.drawnAt < this.restMs) return false;
    const seconds = Math.min((now - this.drawnAt) / 1000, 0.1);
    this.drawnAt = now;
    this.moveCamera(seconds);
    const state = this.state;
    if (state?.joints) this.setJoints(state.joints);
    this.robots[0].visible = Boolean(state?.is_there?.[0]);
    this.placeBats(state);
    const referee = state?.referee;
    const isOn = referee?.phase === "running";
    const isIn = isOn && referee.in_target[0];
    const word = isIn ? (referee.contact ? "penalty" : "scores") : isOn && referee.in_target[1] ? "guarded" : "free";
    const hasTip = state?.bats && state.is_valid[0] && !this.robots[0].visible;
    this.target.show(word, hasTip ? this.tips[0].x : null, seconds);
    this.renderer.render(this.scene, this.camera);
    return true;
  }

  moveCamera(seconds) {
    const share = seconds > 0 ? 1 - Math.exp(-seconds / 0.12) : 1;
    this.camera.position.lerp(new THREE.Vector3(...this.view.eye), share);
    this.aim.lerp(new THREE.Vector3(...this.view.aim), share);
    this.camera.lookAt(this.aim);
    this.camera.fov = fieldOfView(this.view, this.aspect);
    this.camera.updateProjectionMatrix();
  }

  placeBats(state) {
    this.tips = [];
    this.bats.forEach((bat, side) => {
      const pose = state?.bats?.[side];
      bat.visible = Boolean(pose) && (side === 1 || state.is_valid[0] || state.is_there?.[0]);
      this.trails[side].mesh.visible = bat.visible;
      if (!pose) return;
      bat.position.set(pose[0], pose[1], pose[2]);
      bat.quaternion.copy(quaternion(pose.slice(3)));
      const tip = new THREE.Vector3(bat.userData.front, 0, 0).applyQuaternion(bat.quaternion).add(bat.position);
      const low = new THREE.Vector3(0.45 * bat.userData.front, 0, 0).applyQuaternion(bat.quaternion).add(bat.position);
      this.tips.push(tip);
      this.trails[side].push(tip, low);
    });
    const hasTip = this.bats[0].visible && !this.robots[0].visible && this.tips.length > 0;
    this.plumb.line.visible = this.plumb.foot.visible = hasTip;
    if (hasTip) {
      const tip = this.tips[0];
      this.plumb.line.position.set(tip.x, tip.y, tip.z / 2);
      this.plumb.line.scale.z = tip.z;
      this.plumb.foot.position.set(tip.x, tip.y, 0.006);
    }
    const touches = Boolean(state?.referee?.contact) && state.referee.phase === "running";
    this.bats.forEach((bat) => { bat.userData.glow.emissiveIntensity = touches ? 1.3 : 0.6; });
    this.spark.intensity = touches ? 3 : 0;
    if (touches && this.tips.length === 2) this.spark.position.copy(this.tips[0]).lerp(this.tips[1], 0.5);
  }

  /** Return both ends of the axis of the protagonist's bat as the joints' angles have it (m). */
  kinematicBat() {
    const hand = this.links.find(({ name }) => name === "protagonist/wrist_roll");
    const solid = this.model.solids.find(({ name }) => name === "protagonist/bat");
    hand.group.updateWorldMatrix(true, false);
    const along = new THREE.Vector3(0, 0, 1).applyQuaternion(quaternion(solid.quaternion));
    const middle = new THREE.Vector3(...solid.position);
    const ends = [-1, 1].map((sign) => middle.clone().addScaledVector(along, sign * solid.size[1]));
    return ends.map((end) => hand.group.localToWorld(end).toArray());
  }
}
