// What is wrong with a file, under the codes that `ptm` has for it (docs/guide/cli.md).

export class PtmError extends Error {
  /**
   * @param {string} code stable, such as "PTM-I105"
   * @param {string} message one line
   */
  constructor(code, message) {
    super(`${code}: ${message}`);
    this.name = "PtmError";
    this.code = code;
  }
}

/**
 * A group whose contents contradict each other.
 * @param {string} what
 */
export function damaged(what) {
  return new PtmError("PTM-I112", `the group cannot be decoded: ${what}`);
}
