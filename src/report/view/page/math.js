// Vectors, and matrices of 4 x 4 numbers, column by column. Poses are x y z and a quaternion x y z w.

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const unit = a => scaled(a, 1 / Math.hypot(a[0], a[1], a[2]));
const clamp = (v, low, high) => Math.min(Math.max(v, low), high);

const IDENTITY = new Float32Array([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);

/** The matrix of the pose that begins at `at` of an array. */
function matrixOf(p, at = 0, out = new Float32Array(16)) {
  const x = p[at + 3], y = p[at + 4], z = p[at + 5], w = p[at + 6];
  out[0] = 1 - 2 * (y * y + z * z); out[1] = 2 * (x * y + z * w); out[2] = 2 * (x * z - y * w); out[3] = 0;
  out[4] = 2 * (x * y - z * w); out[5] = 1 - 2 * (x * x + z * z); out[6] = 2 * (y * z + x * w); out[7] = 0;
  out[8] = 2 * (x * z + y * w); out[9] = 2 * (y * z - x * w); out[10] = 1 - 2 * (x * x + y * y); out[11] = 0;
  out[12] = p[at]; out[13] = p[at + 1]; out[14] = p[at + 2]; out[15] = 1;
  return out;
}

function product(a, b, out = new Float32Array(16)) {
  for (let c = 0; c < 16; c += 4) {
    const b0 = b[c], b1 = b[c + 1], b2 = b[c + 2], b3 = b[c + 3];
    for (let r = 0; r < 4; r++) out[c + r] = a[r] * b0 + a[r + 4] * b1 + a[r + 8] * b2 + a[r + 12] * b3;
  }
  return out;
}

/** Turns (or slides) about (along) the z axis of a frame, in place. */
function moveAlongZ(m, value, slides) {
  if (slides) {
    for (let r = 0; r < 3; r++) m[12 + r] += m[8 + r] * value;
    return;
  }
  const c = Math.cos(value), s = Math.sin(value);
  for (let r = 0; r < 3; r++) {
    const x = m[r], y = m[4 + r];
    m[r] = x * c + y * s;
    m[4 + r] = y * c - x * s;
  }
}

/** From the world to the screen: an eye that looks at a point, z up; `zoom` is 2 / height of the view at distance 1. */
function cameraOf(eye, at, zoom, aspect) {
  const near = 0.02, far = 30;
  const back = unit(minus(eye, at)), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
  const view = new Float32Array([
    right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
  ]);
  const lens = new Float32Array(16);
  lens[0] = zoom / aspect; lens[5] = zoom;
  lens[10] = (far + near) / (near - far); lens[11] = -1; lens[14] = 2 * far * near / (near - far);
  return product(lens, view);
}
