// Files that come in ranges, as the spans of bytes that are here: what is missing of a range, and the range itself.

/** Bytes of a file from `begin` to `end`, which is excluded. @typedef {{begin: number, end: number}} Span */

const ASKED = /^bytes=(\d+)-(\d*)$/, ANSWERED = /^bytes (\d+)-(\d+)\/(\d+)$/;
const KEY = /^(.*)\?bytes=(\d+)-(\d+)\/(\d+)$/;

/** The span that a request asks for, without an end if it has none; null for the whole file, or other ranges. @param {string | null} header */
export function askedSpan(header) {
  const parts = ASKED.exec(header ?? "");
  return parts && { begin: Number(parts[1]), end: parts[2] ? Number(parts[2]) + 1 : Infinity };
}

/** The header of a request for a span. @param {Span} span */
export const rangeOf = ({ begin, end }) => `bytes=${begin}-${end - 1}`;

/** The span of an answer, and the bytes of the file; null if the header says neither. @param {string | null} header */
export function answeredSpan(header) {
  const parts = ANSWERED.exec(header ?? "");
  return parts && { begin: Number(parts[1]), end: Number(parts[2]) + 1, total: Number(parts[3]) };
}

/** The address under which a span is kept: a cache of browsers holds no partial answers.
 * @param {string} url @param {Span} span @param {number} total bytes of the file */
export const keyOf = (url, span, total) => `${url}?${rangeOf(span)}/${total}`;

/** The file and the span of such an address; null of any other. @param {string} key */
export function spanOfKey(key) {
  const parts = KEY.exec(key);
  if (!parts) return null;
  return { url: parts[1], begin: Number(parts[2]), end: Number(parts[3]) + 1, total: Number(parts[4]) };
}

/**
 * The shortest span with all bytes of a span that no other has; null if they have them all.
 * @param {readonly Span[]} spans @param {Span} wanted @returns {Span | null}
 */
export function missingOf(spans, { begin, end }) {
  for (const one of [...spans].sort((a, b) => a.begin - b.begin)) {
    if (one.begin <= begin) begin = Math.max(begin, one.end);
  }
  for (const one of [...spans].sort((a, b) => b.end - a.end)) {
    if (one.end >= end) end = Math.min(end, one.begin);
  }
  return begin < end ? { begin, end } : null;
}

/**
 * Spans that together have all bytes of a span, each adding to those before it.
 * @template {Span} T
 * @param {readonly T[]} spans @param {Span} wanted @returns {T[]}
 */
export function coverOf(spans, { begin, end }) {
  const cover = [];
  while (begin < end) {
    const next = spans.filter((one) => one.begin <= begin && one.end > begin)
      .reduce((/** @type {T | null} */ a, b) => (a && a.end >= b.end ? a : b), null);
    if (!next) return [];
    cover.push(next);
    begin = next.end;
  }
  return cover;
}

/**
 * The bytes of a span, of spans that have them all.
 * @param {readonly {begin: number, bytes: Uint8Array}[]} parts @param {Span} wanted
 */
export function bytesOf(parts, { begin, end }) {
  const body = new Uint8Array(end - begin);
  for (const part of parts) {
    const first = Math.max(begin, part.begin), last = Math.min(end, part.begin + part.bytes.length);
    if (first < last) body.set(part.bytes.subarray(first - part.begin, last - part.begin), first - begin);
  }
  return body;
}
