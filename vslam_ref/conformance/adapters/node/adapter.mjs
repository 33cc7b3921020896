// An adapter in JavaScript, one file, no dependencies: copy it and put your own functions into the table.
//
//     vslam-ref verify --program "node adapter.mjs" --convention convention.json
//
// It shows a program with conventions of its own, which convention.json declares: a camera's pose is T_world_cam
// (perturbed from the left), tangent vectors have the rotation first, quaternions w last.
//
// One request a line in, one reply a line out; nothing else may go to standard output (console.log writes there,
// console.error does not).
import { createInterface } from "node:readline";

// --- vectors are arrays, matrices are arrays of rows ---------------------------------------------

const range = (n) => Array.from({ length: n }, (_, k) => k);
const eye = (n) => range(n).map((i) => range(n).map((j) => (i === j ? 1 : 0)));
const zeros = (r, c) => range(r).map(() => new Array(c).fill(0));
const transpose = (A) => A[0].map((_, j) => A.map((row) => row[j]));
const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
const norm = (a) => Math.hypot(...a);
const mul = (A, B) => A.map((row) => B[0].map((_, j) => row.reduce((s, x, k) => s + x * B[k][j], 0)));
const apply = (A, x) => A.map((row) => dot(row, x));
const add = (a, b) => (Array.isArray(a) ? a.map((x, k) => add(x, b[k])) : a + b);
const scale = (s, a) => (Array.isArray(a) ? a.map((x) => scale(s, x)) : s * a);
const sub = (a, b) => add(a, scale(-1, b));
const largest = (A) => Math.max(...A.flat().map(Math.abs));
const blocks = (rows) =>
  rows.flatMap((row) => row[0].map((_, i) => row.flatMap((block) => block[i])));

function solve(A, B) {
  // A X = B by elimination with row exchanges; B a matrix
  const n = A.length;
  const M = A.map((row, i) => [...row, ...B[i]]);
  for (const k of range(n)) {
    let p = k;
    for (let i = k + 1; i < n; ++i) if (Math.abs(M[i][k]) > Math.abs(M[p][k])) p = i;
    if (!(Math.abs(M[p][k]) > 0)) throw new Error("singular matrix");
    [M[k], M[p]] = [M[p], M[k]];
    for (let i = k + 1; i < n; ++i) {
      const f = M[i][k] / M[k][k];
      for (let j = k; j < M[i].length; ++j) M[i][j] -= f * M[k][j];
    }
  }
  for (let k = n - 1; k >= 0; --k)
    for (let j = n; j < M[k].length; ++j) {
      for (let i = k + 1; i < n; ++i) M[k][j] -= M[k][i] * M[i][j];
      M[k][j] /= M[k][k];
    }
  return M.map((row) => row.slice(n));
}
const inverse = (A) => solve(A, eye(A.length));
const solveVector = (A, b) => solve(A, b.map((x) => [x])).flat();

function cholesky(A) {
  const L = zeros(A.length, A.length);
  for (const i of range(A.length))
    for (let j = 0; j <= i; ++j) {
      const rest = A[i][j] - range(j).reduce((s, k) => s + L[i][k] * L[j][k], 0);
      if (i === j && !(rest > 0)) throw new Error("matrix is not positive definite");
      L[i][j] = i === j ? Math.sqrt(rest) : rest / L[j][j];
    }
  return L;
}

// --- groups; rotation first ----------------------------------------------------------------------

function wrap(angle) {
  // (-pi, pi]; the subtraction of whole turns is exact where the quotient is small
  if (angle > -Math.PI && angle <= Math.PI) return angle;
  const x = angle % (2 * Math.PI);
  if (x > Math.PI) return x - 2 * Math.PI;
  return x <= -Math.PI ? x + 2 * Math.PI : x;
}

// phi1(M) = sum of M^k / (k + 1)!: Exp = I + M phi1(M), and phi1(ad xi) is the left Jacobian of any group.
function phi1(M) {
  let halvings = 0;
  for (; largest(M) * M.length > 1; ++halvings) M = scale(0.5, M);
  const I = eye(M.length);
  let sum = I;
  for (let k = 18; k >= 1; --k) sum = add(I, scale(1 / (k + 1), mul(M, sum)));
  for (; halvings > 0; --halvings) {
    sum = scale(0.5, mul(sum, add(I, add(I, mul(M, sum)))));
    M = scale(2, M);
  }
  return sum;
}

const hat = ([x, y, z]) => [
  [0, -z, y],
  [z, 0, -x],
  [-y, x, 0],
];

function rotationExp(phi) {
  const a = norm(phi);
  const sinc = a < 1e-4 ? 1 - (a * a) / 6 : Math.sin(a) / a;
  const half = a < 1e-4 ? 1 - (a * a) / 24 : Math.sin(a / 2) / (a / 2);
  const W = hat(phi);
  return add(eye(3), add(scale(sinc, W), scale(0.5 * half * half, mul(W, W))));
}

function quaternion(R) {
  // x y z w, the largest component first, so that nothing cancels
  const [[a, b, c], [d, e, f], [g, h, i]] = R;
  const sums = [a - e - i, e - a - i, i - a - e, a + e + i];
  const k = sums.indexOf(Math.max(...sums));
  const big = 1 + sums[k];
  const rows = [
    [big, b + d, c + g, h - f],
    [b + d, big, f + h, c - g],
    [c + g, f + h, big, d - b],
    [h - f, c - g, d - b, big],
  ];
  return scale(1 / norm(rows[k]), rows[k]);
}

const rotationOf = ([x, y, z, w]) => [
  [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
  [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
  [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
];

function rotationLog(R) {
  let q = quaternion(R);
  if (q[3] < 0) q = scale(-1, q);
  const s = Math.hypot(q[0], q[1], q[2]);
  return scale(s < 1e-9 ? 2 / q[3] : (2 * Math.atan2(s, q[3])) / s, q.slice(0, 3));
}

function leftInverse(phi) {
  const a = norm(phi);
  const d =
    a < 1e-2 ? 1 / 12 + (a * a) / 720 + a ** 4 / 30240 : (1 - a / 2 / Math.tan(a / 2)) / (a * a);
  const W = hat(phi);
  return add(eye(3), add(scale(-0.5, W), scale(d, mul(W, W))));
}

const turn = (T) => T.slice(0, -1).map((row) => row.slice(0, -1));
const shift = (T) => T.slice(0, -1).map((row) => row.at(-1));
const join = (A, t) => [...A.map((row, i) => [...row, t[i]]), [...t.map(() => 0), 1]];
const motionInverse = (T) => join(transpose(turn(T)), scale(-1, apply(transpose(turn(T)), shift(T))));
const move = (T, x) => add(apply(turn(T), x), shift(T));
const motionExp = (xi) => {
  const phi = xi.slice(0, 3);
  return join(rotationExp(phi), apply(phi1(hat(phi)), xi.slice(3)));
};
const motionLog = (T) => {
  const phi = rotationLog(turn(T));
  return [...phi, ...apply(leftInverse(phi), shift(T))];
};
const motionAdjoint = (T) =>
  blocks([
    [turn(T), zeros(3, 3)],
    [mul(hat(shift(T)), turn(T)), turn(T)],
  ]);
const motionAd = (xi) =>
  blocks([
    [hat(xi.slice(0, 3)), zeros(3, 3)],
    [hat(xi.slice(3)), hat(xi.slice(0, 3))],
  ]);

const similarityV = (xi) => phi1(add(hat(xi.slice(0, 3)), scale(xi[6], eye(3))));
const similarityScale = (S) => norm(turn(S).map((row) => row[0]));
function similarityLog(S) {
  const s = similarityScale(S);
  const phi = rotationLog(scale(1 / s, turn(S)));
  return [...phi, ...solveVector(similarityV([...phi, 0, 0, 0, Math.log(s)]), shift(S)), Math.log(s)];
}
function similarityInverse(S) {
  const A = inverse(turn(S));
  return join(A, scale(-1, apply(A, shift(S))));
}
function similarityAdjoint(S) {
  const s = similarityScale(S);
  const R = scale(1 / s, turn(S));
  const t = shift(S);
  return blocks([
    [R, zeros(3, 3), zeros(3, 1)],
    [mul(hat(t), R), scale(s, R), t.map((x) => [-x])],
    [zeros(1, 3), zeros(1, 3), [[1]]],
  ]);
}

const plane = (a) => [
  [Math.cos(a), -Math.sin(a)],
  [Math.sin(a), Math.cos(a)],
];
const planeV = (a) => phi1([[0, -a], [a, 0]]);

// --- cameras -------------------------------------------------------------------------------------

function unsupported() {
  const error = new Error("unsupported");
  error.unsupported = true;
  return error;
}

const arctanRatio = (q) => {
  if (q > 1e-2) return Math.atan(Math.sqrt(q)) / Math.sqrt(q);
  return range(13).reduceRight((sum, k) => 1 / (2 * k + 1) - q * sum, 0);
};
const tanRatio = (w) => (Math.abs(w) < 1e-4 ? 1 + (w * w) / 12 : (2 * Math.tan(w / 2)) / w);

function project(model, [fx, fy, cx, cy, omega], [X, Y, Z]) {
  if (model !== "pinhole" && model !== "fov") throw unsupported();
  const [x, y] = [X / Z, Y / Z];
  const A = model === "fov" ? tanRatio(omega) : 1;
  const F = model === "fov" ? A * arctanRatio((omega * A) ** 2 * (x * x + y * y)) : 1;
  return { uv: [fx * F * x + cx, fy * F * y + cy], valid: Z > 0 };
}

function unproject(model, [fx, fy, cx, cy, omega], [u, v]) {
  if (model !== "pinhole" && model !== "fov") throw unsupported();
  let [x, y] = [(u - cx) / fx, (v - cy) / fy];
  if (model === "fov") {
    const t = Math.hypot(x, y) * omega;
    if (Math.abs(t) >= Math.PI / 2) throw new Error("outside the image of the lens");
    const f = (Math.abs(t) < 1e-4 ? 1 + (t * t) / 3 : Math.tan(t) / t) / tanRatio(omega);
    [x, y] = [f * x, f * y];
  }
  return { bearing: scale(1 / Math.hypot(x, y, 1), [x, y, 1]), valid: true };
}

function jacobianPoint(model, [fx, fy], [X, Y, Z]) {
  if (model !== "pinhole") throw unsupported();
  return [
    [fx / Z, 0, (-fx * X) / (Z * Z)],
    [0, fy / Z, (-fy * Y) / (Z * Z)],
  ];
}

function jacobianPose(model, params, T_world_cam, X_world) {
  // Exp(eta) T_world_cam: the point seen from it is T_cam_world Exp(-eta) X_world
  const T_cam_world = motionInverse(T_world_cam);
  const J = mul(jacobianPoint(model, params, move(T_cam_world, X_world)), turn(T_cam_world));
  return mul(J, blocks([[hat(X_world), scale(-1, eye(3))]]));
}

// --- losses --------------------------------------------------------------------------------------

function loss(name, c, x) {
  const u = (x / c) ** 2;
  const a = Math.abs(x);
  if (name === "l2" || (name === "huber" && a <= c)) return { cost: (x * x) / 2, weight: 1 };
  if (name === "huber") return { cost: c * (a - c / 2), weight: c / a };
  if (name === "cauchy") return { cost: 0.5 * c * c * Math.log1p(u), weight: 1 / (1 + u) };
  if (name === "geman-mcclure") return { cost: (x * x) / 2 / (1 + u), weight: (1 + u) ** -2 };
  if (name !== "tukey") throw unsupported();
  if (u >= 1) return { cost: (c * c) / 6, weight: 0 };
  return { cost: ((x * x) / 6) * (3 - 3 * u + u * u), weight: (1 - u) ** 2 };
}

function median(values) {
  const v = Float64Array.from(values).sort();
  if (v.length === 0) throw new Error("no numbers");
  const n = v.length;
  return n % 2 ? v[(n - 1) / 2] : (v[n / 2 - 1] + v[n / 2]) / 2;
}

// --- filters -------------------------------------------------------------------------------------

function ekfPredict({ x, P, control: [v, steering], cov_u, wheelbase, dt }) {
  const [c, s, t] = [Math.cos(x[2]), Math.sin(x[2]), Math.tan(steering)];
  const F = eye(x.length);
  [F[0][2], F[1][2]] = [-v * dt * s, v * dt * c];
  const G = zeros(x.length, 2);
  [G[0][0], G[1][0], G[2]] = [dt * c, dt * s, [(dt * t) / wheelbase, (v * dt * (1 + t * t)) / wheelbase]];
  const moved = [x[0] + v * dt * c, x[1] + v * dt * s, wrap(x[2] + (v * dt * t) / wheelbase), ...x.slice(3)];
  return { x: moved, P: add(mul(mul(F, P), transpose(F)), mul(mul(G, cov_u), transpose(G))) };
}

function ekfUpdate({ x, P, ids, z, cov_z }) {
  if (!ids.length) return { x, P };
  const [c, s] = [Math.cos(x[2]), Math.sin(x[2])];
  const H = zeros(2 * ids.length, x.length);
  const noise = zeros(2 * ids.length, 2 * ids.length);
  const innovation = ids.flatMap((id, k) => {
    const at = 3 + 2 * id;
    const [dx, dy] = [x[at] - x[0], x[at + 1] - x[1]];
    const [a, b] = [c * dx + s * dy, c * dy - s * dx];
    [H[2 * k][0], H[2 * k][1], H[2 * k][2], H[2 * k][at], H[2 * k][at + 1]] = [-c, -s, b, c, s];
    const row = H[2 * k + 1];
    [row[0], row[1], row[2], row[at], row[at + 1]] = [s, -c, -a, -s, c];
    for (const i of [0, 1]) for (const j of [0, 1]) noise[2 * k + i][2 * k + j] = cov_z[i][j];
    return [z[k][0] - a, z[k][1] - b];
  });
  const PHt = mul(P, transpose(H));
  const K = transpose(solve(add(mul(H, PHt), noise), transpose(PHt)));
  const after = add(x, apply(K, innovation));
  after[2] = wrap(after[2]);
  const A = sub(eye(x.length), mul(K, H)); // Joseph's form
  return { x: after, P: add(mul(mul(A, P), transpose(A)), mul(mul(K, noise), transpose(K))) };
}

function ekfAugment({ x, P, z, cov_z }) {
  const R = plane(x[2]);
  const d = apply(R, z);
  const J = zeros(2, x.length);
  [J[0][0], J[1][1], J[0][2], J[1][2]] = [1, 1, -d[1], d[0]];
  const cross = mul(J, P);
  const corner = add(mul(cross, transpose(J)), mul(mul(R, cov_z), transpose(R)));
  return { x: [...x, x[0] + d[0], x[1] + d[1]], P: blocks([[P, transpose(cross)], [cross, corner]]) };
}

function nees({ error, P }) {
  const y = solveVector(cholesky(P), error);
  return dot(y, y);
}

// --- grids, files, trajectories ------------------------------------------------------------------

function rayCells({ start, end }) {
  const cuts = [0, 1];
  for (const k of [0, 1]) {
    const [low, high] = [Math.min(start[k], end[k]), Math.max(start[k], end[k])];
    for (let line = Math.ceil(low); high > low && line <= high; ++line)
      cuts.push(Math.min(1, Math.max(0, (line - start[k]) / (end[k] - start[k]))));
  }
  cuts.sort((a, b) => a - b);
  const cells = [];
  for (let k = 1; k < cuts.length; ++k) {
    if (cuts[k] - cuts[k - 1] < 1e-12) continue;
    const t = (cuts[k] + cuts[k - 1]) / 2;
    const cell = [0, 1].map((j) => Math.floor(start[j] + t * (end[j] - start[j])));
    if (`${cell}` !== `${cells.at(-1)}`) cells.push(cell);
  }
  return cells;
}

function rows(text, columns) {
  const found = text
    .split("\n")
    .map((line) => line.split("#")[0].trim())
    .filter((line) => line)
    .map((line) => line.split(/\s+/).map(Number));
  if (found.length === 0) throw new Error("no data");
  for (const row of found) {
    if (row.length !== columns) throw new Error(`a line needs ${columns} numbers`);
    if (!row.every(Number.isFinite)) throw new Error("no finite number");
  }
  return found;
}

function tum({ text }) {
  const table = rows(text, 8);
  table.forEach((row, k) => {
    if (k > 0 && row[0] < table[k - 1][0]) throw new Error("time goes back");
    if (Math.abs(norm(row.slice(4)) - 1) > 1e-3) throw new Error("a quaternion off unit length");
  });
  // the catalogue calls this q "plain": it is w x y z whatever the program declares
  return {
    times: table.map((row) => row[0]),
    t: table.map((row) => row.slice(1, 4)),
    q: table.map((row) => [row[7], row[4], row[5], row[6]]),
  };
}

function kitti({ text }) {
  return rows(text, 12).map((row) => {
    const T = [row.slice(0, 4), row.slice(4, 8), row.slice(8), [0, 0, 0, 1]];
    const R = turn(T);
    const handed = dot(R[0], apply(hat(R[1]), R[2]));
    if (largest(sub(mul(R, transpose(R)), eye(3))) > 1e-3 || handed < 0) throw new Error("this is no rotation");
    return T;
  });
}

function rpe({ estimate, truth }) {
  const errors = range(truth.length - 1).map((k) => {
    const [a, b] = [truth, estimate].map((T) => mul(motionInverse(T[k]), T[k + 1]));
    return mul(motionInverse(a), b);
  });
  const mean = (values) => Math.sqrt(values.reduce((s, x) => s + x * x, 0) / values.length);
  return {
    trans_rmse: mean(errors.map((E) => norm(shift(E)))),
    rot_rmse_deg: mean(errors.map((E) => (norm(rotationLog(turn(E))) * 180) / Math.PI)),
  };
}

function logOdds(p) {
  if (!(p >= 0 && p <= 1)) throw new Error("a probability lies between 0 and 1");
  return Math.log(p) - Math.log1p(-p);
}

// --- the table: function -> what answers it, from the inputs by name -----------------------------

const TABLE = {
  "so2.exp": ({ angle }) => plane(angle),
  "so2.wrap": ({ angle }) => wrap(angle),
  "se2.exp": ({ xi }) => [...apply(planeV(xi[2]), xi.slice(0, 2)), wrap(xi[2])],
  "se2.log": ({ x }) => [...solveVector(planeV(wrap(x[2])), x.slice(0, 2)), wrap(x[2])],
  "se2.compose": ({ a, b }) => [...add(apply(plane(a[2]), b.slice(0, 2)), a.slice(0, 2)), wrap(a[2] + b[2])],
  "se2.inverse": ({ x }) => [...scale(-1, apply(transpose(plane(x[2])), x.slice(0, 2))), wrap(-x[2])],
  "se2.adjoint": ({ x }) => blocks([[plane(x[2]), [[x[1]], [-x[0]]]], [[[0, 0]], [[1]]]]),
  "se2.left_jacobian": ({ xi: [x, y, a] }) => phi1([[0, -a, y], [a, 0, -x], [0, 0, 0]]),
  "so3.exp": ({ phi }) => rotationExp(phi),
  "so3.log": ({ R }) => rotationLog(R),
  "so3.left_jacobian": ({ phi }) => phi1(hat(phi)),
  "so3.left_jacobian_inverse": ({ phi }) => leftInverse(phi),
  "so3.interpolate": ({ a, b, fraction }) =>
    mul(a, rotationExp(scale(fraction, rotationLog(mul(transpose(a), b))))),
  "quaternion.from_rotation": ({ R }) => quaternion(R),
  "quaternion.to_rotation": ({ q }) => rotationOf(q),
  "se3.exp": ({ xi }) => motionExp(xi),
  "se3.log": ({ T }) => motionLog(T),
  "se3.compose": ({ a, b }) => mul(a, b),
  "se3.inverse": ({ T }) => motionInverse(T),
  "se3.act": ({ T, x }) => move(T, x),
  "se3.adjoint": ({ T }) => motionAdjoint(T),
  "se3.left_jacobian": ({ xi }) => phi1(motionAd(xi)),
  "se3.left_jacobian_inverse": ({ xi }) => inverse(phi1(motionAd(xi))),
  "se3.interpolate": ({ a, b, fraction }) =>
    mul(a, motionExp(scale(fraction, motionLog(mul(motionInverse(a), b))))),
  "sim3.exp": ({ xi }) =>
    join(scale(Math.exp(xi[6]), rotationExp(xi.slice(0, 3))), apply(similarityV(xi), xi.slice(3, 6))),
  "sim3.log": ({ S }) => similarityLog(S),
  "sim3.compose": ({ a, b }) => mul(a, b),
  "sim3.inverse": ({ S }) => similarityInverse(S),
  "sim3.act": ({ S, x }) => move(S, x),
  "sim3.adjoint": ({ S }) => similarityAdjoint(S),
  "camera.project": ({ model, params, X_cam }) => project(model, params, X_cam),
  "camera.unproject": ({ model, params, uv }) => unproject(model, params, uv),
  "camera.jacobian_point": ({ model, params, X_cam }) => jacobianPoint(model, params, X_cam),
  "camera.jacobian_pose": ({ model, params, pose, X_world }) => jacobianPose(model, params, pose, X_world),
  "multiview.essential": ({ T_b_a }) => mul(hat(shift(T_b_a)), turn(T_b_a)),
  "multiview.camera_from_world": ({ R_cam_world, p_world, X_world }) => apply(R_cam_world, sub(X_world, p_world)),
  "loss.cost": ({ name, c, x }) => x.map((value) => loss(name, c, value).cost),
  "loss.influence": ({ name, c, x }) => x.map((value) => loss(name, c, value).weight * value),
  "loss.weight": ({ name, c, x }) => x.map((value) => loss(name, c, value).weight),
  "scale.mad": ({ errors }) => 1.482602218505602 * median(errors.map(Math.abs)),
  "scale.norm": ({ errors }) => 0.8493218002880191 * median(errors.map(norm)),
  "vehicle.ackermann": (inputs) => ekfPredict({ ...inputs, P: zeros(3, 3), cov_u: zeros(2, 2) }).x,
  "ekf.predict": ekfPredict,
  "ekf.update": ekfUpdate,
  "ekf.augment": ekfAugment,
  "consistency.nees": nees,
  "grid.log_odds": ({ probability }) => logOdds(probability),
  "grid.probability": ({ log_odds }) => 1 / (1 + Math.exp(-log_odds)),
  "grid.update": ({ prior, measured }) => logOdds(prior) + logOdds(measured),
  "grid.ray_cells": rayCells,
  "trajectory.rpe": rpe,
  "format.tum": tum,
  "format.kitti": kitti,
};

// --- the protocol --------------------------------------------------------------------------------

const words = { nan: NaN, inf: Infinity, "-inf": -Infinity };
const withNumbers = (value, name) => {
  if (typeof value === "string" && name !== "text" && value in words) return words[value];
  if (Array.isArray(value)) return value.map((item) => withNumbers(item));
  return value;
};
const withWords = (_, x) =>
  typeof x !== "number" || Number.isFinite(x) ? x : Number.isNaN(x) ? "nan" : x > 0 ? "inf" : "-inf";

function present(inputs, key) {
  if (!(key in inputs)) throw new Error(`no input ${key}`);
  return inputs[key];
}

function reply(line) {
  let request;
  try {
    request = JSON.parse(line);
  } catch (error) {
    return { id: null, error: `not JSON: ${error.message}` };
  }
  const { id, function: name, inputs } = request;
  if (!Object.hasOwn(TABLE, name)) return { id, unsupported: true };
  try {
    const given = Object.entries(inputs).map(([key, value]) => [key, withNumbers(value, key)]);
    return { id, value: TABLE[name](new Proxy(Object.fromEntries(given), { get: present })) };
  } catch (error) {
    return error.unsupported ? { id, unsupported: true } : { id, error: error.message };
  }
}

for await (const line of createInterface({ input: process.stdin, crlfDelay: Infinity }))
  if (line.trim()) process.stdout.write(`${JSON.stringify(reply(line), withWords)}\n`);
