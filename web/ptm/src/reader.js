// Reads bytes in order; reading past the end is an error.

import { damaged } from "./errors.js";

export class Reader {
  /** @param {Uint8Array} bytes */
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  /** @param {number} count */
  take(count) {
    if (count > this.bytes.length - this.at) throw damaged("it is cut short");
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }

  /** @param {number} size bytes of the number, 1 … 4, little endian */
  number(size) {
    const bytes = this.take(size);
    let n = 0;
    for (let i = size - 1; i >= 0; i--) n = n * 256 + bytes[i];
    return n;
  }

  /** A signed number of two bytes. */
  signed() {
    return (this.number(2) << 16) >> 16;
  }

  rest() {
    return this.take(this.bytes.length - this.at);
  }

  end() {
    if (this.at < this.bytes.length) {
      throw damaged(`${this.bytes.length - this.at} bytes are left over`);
    }
  }
}
