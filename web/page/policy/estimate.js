// Estimates the link from recent downloads. Bandwidth is bytes over the time during which any arrived, both
// forgotten with a half-life of such time: a pause neither lowers the estimate nor ages it, and parallel
// requests do not count against each other. Bytes between two looks fade as if they arrived evenly, so that
// the frequency of looks does not matter. Latency is the mean of the last few requests.
//
// A response waited in a queue if another one ended during its wait. The link was busy from the time at which
// it was due, and its wait tells of the latency only if it is less than the mean: requests that are made by a
// latency with its queue would lengthen the queue.

import {
  CONNECTIONS, ENOUGH_BYTES, ENOUGH_SECONDS, HALF_LIFE, LATENCIES, PRIOR_BANDWIDTH, PRIOR_LATENCY, STREAMS,
} from "./constants.js";

/**
 * @typedef {object} Belief
 * @property {number} bandwidth bit/s
 * @property {number} latency s from a request to its first byte
 * @property {number} concurrency requests at a time
 */

// What ended within this time of a request ended before it, s.
const AT_ONCE = 1e-3;

/** @implements {Belief} */
export class Estimate {
  /** @type {Map<unknown, {sent: number, waited: number}>} `waited` is −1 before the first byte */
  #requests = new Map();
  /** @type {number[]} */
  #latencies = [];
  #prior;
  #bytes = 0;
  #seconds = 0;
  #arriving = 0;
  #seen = 0;
  #ended = -Infinity;

  /** @param {{bandwidth: number, latency: number}} prior */
  constructor(prior = { bandwidth: PRIOR_BANDWIDTH, latency: PRIOR_LATENCY }) {
    this.#prior = prior;
    this.concurrency = CONNECTIONS;
  }

  /** @param {string} name of the protocol, as browsers report it */
  set protocol(name) {
    this.concurrency = /^h[23]/.test(name) ? STREAMS : CONNECTIONS;
  }

  /** A request goes out. @param {unknown} id @param {number} now s */
  sent(id, now) {
    this.#requests.set(id, { sent: now, waited: -1 });
  }

  /** Its response begins. @param {unknown} id @param {number} now */
  firstByte(id, now) {
    const request = this.#requests.get(id);
    if (!request || request.waited >= 0) return;
    const { latency } = this, waited = now - request.sent;
    const queued = this.#ended > request.sent + AT_ONCE;
    const due = queued && this.#latencies.length ? Math.min(now, request.sent + latency) : now;
    if (!this.#arriving) this.#seen = Math.max(this.#seen, due);
    request.waited = queued && waited >= latency ? NaN : waited;
    this.#arriving++;
  }

  /** Counts the bytes that have arrived since the last call. @param {number} now @param {number} count */
  bytes(now, count) {
    const seconds = this.#arriving > 0 ? Math.max(now - this.#seen, 0) : 0;
    const age = Math.LN2 * seconds / HALF_LIFE;
    const fading = Math.exp(-age), kept = age ? -Math.expm1(-age) / age : 1;
    this.#seen = Math.max(this.#seen, now);
    this.#bytes = this.#bytes * fading + kept * count;
    this.#seconds = this.#seconds * fading + kept * seconds;
  }

  /** Its response has ended, whole or not. @param {unknown} id @param {number} now */
  finished(id, now) {
    this.bytes(now, 0);
    const request = this.#requests.get(id);
    this.#requests.delete(id);
    if (!request || request.waited === -1) return;
    this.#arriving--;
    this.#ended = now;
    if (request.waited >= 0) this.#latencies.push(request.waited);
    this.#latencies = this.#latencies.slice(-LATENCIES);
  }

  get bandwidth() {
    if (this.#bytes < ENOUGH_BYTES && this.#seconds < ENOUGH_SECONDS) return this.#prior.bandwidth;
    return this.#seconds > 0 ? 8 * this.#bytes / this.#seconds : Infinity;
  }

  get latency() {
    const some = this.#latencies;
    return some.length ? some.reduce((a, b) => a + b, 0) / some.length : this.#prior.latency;
  }
}

/**
 * Seconds that a request of `size` bytes takes if it has the link for itself.
 * @param {{bandwidth: number, latency: number}} estimate
 * @param {number} size
 */
export function duration({ bandwidth, latency }, size) {
  return bandwidth > 0 ? latency + 8 * size / bandwidth : Infinity;
}
