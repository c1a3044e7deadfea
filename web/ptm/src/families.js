// The built-in frequency tables, which encoder and decoder share without sending them
// (docs/formats/ptm.md, "Tables and symbols"; docs/formats/ptm-kinds.md, "Entropy coding").

const SUM = 2048;
const ESCAPE = 255;
// Mean magnitudes, in sixteenths.
const MEANS = [
  1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 48, 56, 64, 80, 96, 112, 128, 160, 192,
  224, 256, 320, 384, 448, 512, 640, 768, 1024,
];
const EVEN = [2, 3, 4, 5, 6, 9, 16];
const TOKENS = 132;

/** @type {Map<string, Uint16Array>} */
const computed = new Map();

/** The tables of the coders Haar and repeats: frequencies, 256 for each, table 1 first. */
export function geometricTables() {
  return remembered("geometric", () => MEANS.map(geometricWeights));
}

/** The tables of the texel coder. */
export function tokenTables() {
  return remembered("token", () => {
    const means = [1];
    for (let i = 0; i < 35; i++) means.push(2 * 2 ** i, 3 * 2 ** i);
    return [...EVEN.map((n) => withEscape(Array(n).fill(2 ** 24 / n))), ...means.map(tokenWeights)];
  });
}

/**
 * @param {string} name
 * @param {() => number[][]} weights
 */
function remembered(name, weights) {
  let tables = computed.get(name);
  if (!tables) {
    const rows = weights();
    tables = new Uint16Array(256 * rows.length);
    rows.forEach((row, i) => tables?.set(normalised(row), 256 * i));
    computed.set(name, tables);
  }
  return tables;
}

/** @param {number} mean */
function geometricWeights(mean) {
  const ratio = Math.floor((65536 * mean) / (16 + mean));
  const u = [2 ** 24];
  for (let z = 1; z < ESCAPE; z++) u.push(z % 2 ? Math.floor((u[z - 1] * ratio) / 65536) : u[z - 1]);
  const sum = total(u);
  return withEscape(u.map((weight) => (4096 * weight < sum ? 0 : weight)));
}

/** @param {number} mean */
function tokenWeights(mean) {
  const power = 4n;
  const scale = BigInt(mean) ** power << 40n;
  const weights = [];
  let sum = 0n;
  for (let token = 0; token < TOKENS; token++) {
    const bits = token < 16 ? 0 : ((token - 16) >> 2) + 2;
    const count = 1n << BigInt(bits);
    const first = token < 16 ? BigInt(token) : BigInt(4 + (token & 3)) << BigInt(bits);
    const weight = (count * scale) / (BigInt(mean) + 8n * (2n * first + count)) ** power;
    weights.push(weight);
    sum += weight;
  }
  return withEscape(weights.map((w) => (w << 12n < sum ? 0 : Number((w << 24n) / sum))));
}

/**
 * 256 weights: after those given, zeros, and that of the escape.
 * @param {number[]} weights
 */
function withEscape(weights) {
  const whole = weights.map(Math.floor);
  return [...whole, ...Array(ESCAPE - whole.length).fill(0), Math.floor(total(whole) / 1024)];
}

/**
 * Frequencies that sum to 2048. All products are below 2^53.
 * @param {number[]} weights
 */
function normalised(weights) {
  const sum = total(weights);
  const f = weights.map((u) => u && Math.max(1, Math.floor((SUM * u + Math.floor(sum / 2)) / sum)));
  for (let left = SUM - total(f); left; left -= Math.sign(left)) {
    const step = Math.sign(left);
    let best = -1;
    for (let z = 0; z < 256; z++) {
      if (!f[z] || f[z] + step === 0) continue;
      const difference =
        best < 0 ? 1 : weights[z] * (2 * f[best] + step) - weights[best] * (2 * f[z] + step);
      if (best < 0 || difference * step > 0) best = z;
    }
    f[best] += step;
  }
  return f;
}

/** @param {number[]} numbers */
function total(numbers) {
  return numbers.reduce((sum, n) => sum + n, 0);
}
