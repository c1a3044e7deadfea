// Errors of files, with the codes of `ptm` (docs/guide/cli.md).

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
 * @param {string} reason
 */
export function damaged(reason) {
  return new PtmError("PTM-I112", `the group cannot be decoded: ${reason}`);
}
