// Figures, floor, light and camera.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const GIVEN = new THREE.Color("#a9b0bd");
const PATH = 0xf97316;
/** Metres between motions side by side. */
const APART = 1.1;
const THEMES = {
  light: { sky: 0xf3f5f9, floor: 0xe4e8ef, line: 0xc3cad6, bold: 0xaab4c4, shadow: 0.28, ghost: 0.28 },
  dark: { sky: 0x14181f, floor: 0x1b212b, line: 0x2c3542, bold: 0x3d4959, shadow: 0.55, ghost: 0.3 },
};

/** A skinned figure that can be posed at any fraction of a frame. */
class Figure {
  constructor(body, material) {
    this.bones = body.parents.map(() => new THREE.Bone());
    body.parents.forEach((parent, joint) => {
      this.bones[joint].position.fromArray(body.offsets, 3 * joint);
      if (parent >= 0) this.bones[parent].add(this.bones[joint]);
    });
    this.mesh = new THREE.SkinnedMesh(body.geometry, material);
    this.mesh.add(this.bones[0]);
    this.mesh.bind(new THREE.Skeleton(this.bones));
    this.mesh.frustumCulled = false;
    this.next = new THREE.Quaternion();
    this.step = new THREE.Vector3();
  }

  pose(scene, time) {
    time = Math.min(time, scene.frames - 1);
    const first = Math.min(Math.floor(time), scene.frames - 1);
    const second = Math.min(first + 1, scene.frames - 1);
    const share = time - first;
    const joints = this.bones.length;
    this.bones.forEach((bone, joint) => {
      bone.quaternion.fromArray(scene.rotations, 4 * (first * joints + joint)).normalize();
      this.next.fromArray(scene.rotations, 4 * (second * joints + joint)).normalize();
      bone.quaternion.slerp(this.next, share);
    });
    this.bones[0].position.fromArray(scene.positions, 3 * first);
    this.bones[0].position.lerp(this.step.fromArray(scene.positions, 3 * second), share);
    this.mesh.updateMatrixWorld(true);
  }
}

/** The ground: lines every half metre, bolder every two, antialiased in the shader and fading into the sky. */
function ground() {
  const uniforms = { floor: {}, line: {}, bold: {}, sky: {}, center: { value: new THREE.Vector2() } };
  for (const name of ["floor", "line", "bold", "sky"]) uniforms[name].value = new THREE.Color();
  return new THREE.ShaderMaterial({
    uniforms,
    transparent: true,
    depthWrite: false,
    vertexShader: `
      varying vec2 place;
      void main() {
        vec4 world = modelMatrix * vec4(position, 1.0);
        place = world.xy;
        gl_Position = projectionMatrix * viewMatrix * world;
      }`,
    fragmentShader: `
      uniform vec3 floor, line, bold, sky;
      uniform vec2 center;
      varying vec2 place;
      float lines(float spacing, float width) {
        vec2 pixel = max(fwidth(place), vec2(1e-5));
        vec2 away = abs(fract(place / spacing - 0.5) - 0.5) * spacing;
        vec2 cover = clamp((vec2(width) - away) / pixel + 0.5, 0.0, 1.0) * min(vec2(1.0), 2.0 * width / pixel);
        return max(cover.x, cover.y);
      }
      void main() {
        vec3 color = mix(floor, line, lines(0.5, 0.006));
        color = mix(color, bold, lines(2.0, 0.008));
        float fade = smoothstep(5.0, 20.0, distance(place, center));
        gl_FragColor = vec4(mix(color, sky, fade), 1.0);
        #include <colorspace_fragment>
      }`,
  });
}

/** A ribbon on the floor along a path of (x, y) points. */
function ribbon(path, width, height, color, opacity) {
  const count = path.length / 2;
  const points = [];
  const index = [];
  for (let i = 0; i < count; i++) {
    const [before, after] = [Math.max(i - 1, 0), Math.min(i + 1, count - 1)];
    const along = [path[2 * after] - path[2 * before], path[2 * after + 1] - path[2 * before + 1]];
    const length = Math.hypot(...along) || 1;
    const side = [(-along[1] / length) * width, (along[0] / length) * width];
    points.push(path[2 * i] + side[0], path[2 * i + 1] + side[1], height);
    points.push(path[2 * i] - side[0], path[2 * i + 1] - side[1], height);
    if (i) index.push(2 * i - 2, 2 * i - 1, 2 * i, 2 * i, 2 * i - 1, 2 * i + 1);
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
  geometry.setIndex(index);
  const material = new THREE.MeshBasicMaterial({ color, opacity, transparent: true, side: THREE.DoubleSide, depthWrite: false });
  return new THREE.Mesh(geometry, material);
}

/** The path that was asked for, with a dot where it ends. */
function asked(scene) {
  const group = new THREE.Group();
  if (scene.trajectory?.length >= 4) {
    const end = scene.trajectory.slice(-2);
    const dot = new THREE.Mesh(new THREE.CircleGeometry(0.055, 32), new THREE.MeshBasicMaterial({ color: PATH }));
    dot.position.set(end[0], end[1], 0.005);
    group.add(ribbon(scene.trajectory, 0.018, 0.004, PATH, 0.95), dot);
  }
  return group;
}

/** How far a motion reaches to either side of its first heading, and that side. */
function breadth(scene) {
  const turn = new THREE.Quaternion().fromArray(scene.rotations).normalize();
  const side = new THREE.Vector3(1, 0, 0).applyQuaternion(turn).setZ(0).normalize();
  const reach = [Infinity, -Infinity];
  for (let i = 0; i < scene.positions.length; i += 3) {
    const along = scene.positions[i] * side.x + scene.positions[i + 1] * side.y;
    reach[0] = Math.min(reach[0], along);
    reach[1] = Math.max(reach[1], along);
  }
  return { side, width: reach[1] - reach[0] };
}

function clothed() {
  return new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.62, metalness: 0.02 });
}

export class Stage {
  constructor(canvas, bodies) {
    this.canvas = canvas;
    this.bodies = bodies;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = THREE.PCFShadowMap;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.world = new THREE.Scene();
    this.world.fog = new THREE.Fog(0xffffff, 12, 26);
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.05, 80);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.minDistance = 0.8;
    this.controls.maxDistance = 22;
    this.controls.maxPolarAngle = 1.54;
    this.controls.addEventListener("start", () => (this.orbited = true));
    this.follow = true;
    this.options = { ghost: true, path: true };
    this.floor = new THREE.Mesh(new THREE.CircleGeometry(40, 64), ground());
    this.shade = new THREE.Mesh(new THREE.CircleGeometry(6, 48), new THREE.ShadowMaterial({ depthWrite: false }));
    this.shade.receiveShadow = true;
    // Both lie on the floor: painted one over the other, before everything else.
    this.floor.renderOrder = -2;
    this.shade.renderOrder = -1;
    this.world.add(this.floor, this.shade);
    this.world.add(new THREE.HemisphereLight(0xf0f5ff, 0xa5abb8, 2.1));
    this.key = new THREE.DirectionalLight(0xfff1df, 2.1);
    this.key.castShadow = true;
    this.key.shadow.mapSize.set(2048, 2048);
    this.key.shadow.radius = 5;
    this.key.shadow.bias = -0.0004;
    this.key.shadow.normalBias = 0.012;
    Object.assign(this.key.shadow.camera, { left: -2.4, right: 2.4, top: 2.4, bottom: -2.4, near: 0.5, far: 16 });
    this.rim = new THREE.DirectionalLight(0xbcd4ff, 0.9);
    this.world.add(this.key, this.key.target, this.rim, this.rim.target);
    this.content = new THREE.Group();
    this.world.add(this.content);
    this.anchor = new THREE.Vector3();
  }

  theme(name) {
    const theme = THEMES[name];
    this.world.background = new THREE.Color(theme.sky);
    this.world.fog.color.set(theme.sky);
    for (const name of ["floor", "line", "bold", "sky"]) this.floor.material.uniforms[name].value.set(theme[name]);
    this.shade.material.opacity = theme.shadow;
    this.ghostOpacity = theme.ghost;
    if (this.ghost) this.ghost.mesh.material.opacity = theme.ghost;
  }

  /** Show a motion, and others beside it. */
  show(scene, others = []) {
    this.content.traverse((part) => {
      part.material?.dispose();
      part.skeleton?.dispose();
      if (part.isMesh && !part.isSkinnedMesh) part.geometry.dispose();
    });
    this.content.clear();
    this.scene = scene;
    const body = this.bodies[scene.body];
    this.figure = new Figure(body, clothed());
    this.figure.mesh.castShadow = true;
    this.figure.mesh.receiveShadow = true;
    this.content.add(this.figure.mesh);
    this.ghost = null;
    if (scene.initial_frames > 0) {
      const material = new THREE.MeshStandardMaterial({ color: GIVEN, roughness: 0.8, transparent: true, opacity: this.ghostOpacity });
      this.ghost = new Figure(body, material);
      this.ghost.pose(scene, scene.initial_frames - 1);
      this.ghost.mesh.renderOrder = 2;
      // Its depth is drawn first, so that its far side does not shine through.
      const depth = new THREE.MeshBasicMaterial({ colorWrite: false, transparent: true });
      const hull = new THREE.SkinnedMesh(body.geometry, depth);
      hull.bind(this.ghost.mesh.skeleton, this.ghost.mesh.bindMatrix);
      hull.renderOrder = 1;
      hull.frustumCulled = false;
      this.ghost.mesh.add(hull);
      this.content.add(this.ghost.mesh);
    }
    this.paths = [asked(scene)];
    this.content.add(this.paths[0]);
    const { side, width } = breadth(scene);
    this.spread = side.multiplyScalar(-(width + APART));
    this.others = others.map((other, index) => {
      const place = new THREE.Group();
      place.position.copy(this.spread).multiplyScalar(index + 1);
      const figure = new Figure(this.bodies[other.body], clothed());
      figure.mesh.castShadow = true;
      const path = asked(other);
      this.paths.push(path);
      place.add(figure.mesh, path);
      this.content.add(place);
      place.updateMatrixWorld(true);
      return { figure, scene: other };
    });
    this.frame();
  }

  /** Put the camera beside the first pose, where all of an in-place motion is seen. */
  frame() {
    const scene = this.scene;
    this.orbited = false;
    this.figure.pose(scene, Math.max(scene.initial_frames - 1, 0));
    const left = new THREE.Vector3(1, 0, 0).applyQuaternion(this.figure.bones[0].quaternion);
    const heading = Math.atan2(left.y, left.x) - 0.62;
    this.anchor.copy(this.figure.bones[0].position);
    const height = Math.max(this.anchor.z, 0.9);
    const narrow = Math.max(1, 0.85 / this.camera.aspect);
    // In the middle of all that stand side by side, far enough away to see them.
    const middle = this.spread.clone().multiplyScalar(this.others.length / 2);
    this.controls.target.set(this.anchor.x + middle.x, this.anchor.y + middle.y, height * 0.9);
    const distance = 4.5 * narrow * (height / 0.92) + 1.4 * middle.length();
    const away = new THREE.Vector3(Math.sin(heading), -Math.cos(heading), 0.26).multiplyScalar(distance);
    this.camera.position.copy(this.controls.target).add(away);
    this.key.position.copy(away).applyAxisAngle(this.camera.up, -0.7).setZ(0).normalize().multiplyScalar(3).setZ(5.2);
    this.light = this.key.position.clone();
    this.back = away.clone().setZ(0).normalize().multiplyScalar(-4).setZ(2.5);
    this.controls.update();
  }

  draw(time) {
    this.figure.pose(this.scene, time);
    for (const other of this.others) other.figure.pose(other.scene, time);
    const root = this.figure.bones[0].position;
    if (this.follow) {
      const shift = new THREE.Vector3(root.x - this.anchor.x, root.y - this.anchor.y, 0);
      this.controls.target.add(shift);
      this.camera.position.add(shift);
    }
    this.anchor.set(root.x, root.y, this.anchor.z);
    this.key.target.position.set(root.x, root.y, 0.6);
    this.key.position.copy(this.light).add(this.key.target.position);
    this.rim.target.position.copy(this.key.target.position);
    this.rim.position.copy(this.back).add(this.key.target.position);
    for (const layer of [this.floor, this.shade]) layer.position.set(root.x, root.y, 0);
    this.floor.material.uniforms.center.value.set(root.x, root.y);
    if (this.ghost) this.ghost.mesh.visible = this.options.ghost;
    for (const path of this.paths) path.visible = this.options.path;
    this.controls.update();
    this.renderer.render(this.world, this.camera);
  }

  resize(width, height) {
    // A page in a hidden frame has no size yet.
    if (!width || !height) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.scene && !this.orbited) this.frame();
  }
}
