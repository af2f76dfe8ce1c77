// What html.py embeds, as three.js objects. Arrays are base64 of little-endian binary.
import * as THREE from "three";

const TYPES = { float32: Float32Array, int16: Int16Array, uint16: Uint16Array, uint32: Uint32Array, uint8: Uint8Array };

function array({ dtype, data }) {
  const text = atob(data);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return new TYPES[dtype](bytes.buffer);
}

function floats(packed) {
  const values = Float32Array.from(array(packed));
  if (packed.scale) for (let i = 0; i < values.length; i++) values[i] *= packed.scale;
  return values;
}

function linearColors(packed) {
  const bytes = array(packed);
  const color = new THREE.Color();
  const linear = new Float32Array(bytes.length);
  for (let i = 0; i < bytes.length; i += 3) {
    color.setRGB(bytes[i] / 255, bytes[i + 1] / 255, bytes[i + 2] / 255, THREE.SRGBColorSpace).toArray(linear, i);
  }
  return linear;
}

/** A body: one geometry that all its figures share, and the skeleton to build for each. */
export function readBody(body) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(floats(body.vertices), 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(linearColors(body.colors), 3));
  geometry.setAttribute("skinIndex", new THREE.BufferAttribute(array(body.weight_joints), 4));
  geometry.setAttribute("skinWeight", new THREE.BufferAttribute(array(body.weights), 4, true));
  geometry.setIndex(new THREE.BufferAttribute(array(body.faces), 1));
  geometry.computeVertexNormals();
  return { geometry, offsets: floats(body.offsets), parents: body.parents };
}

/** A scene: quaternions (T, 22, 4) as x, y, z, w and pelvis positions (T, 3). */
export function readScene(scene) {
  return {
    ...scene,
    rotations: floats(scene.rotations),
    positions: floats(scene.positions),
    trajectory: scene.trajectory && floats(scene.trajectory),
  };
}
