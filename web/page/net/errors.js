// Errors with a message for visitors; the codes are those of docs/guide/viewer.md.

export class PageError extends Error {
  /**
   * @param {string} code
   * @param {string} message
   */
  constructor(code, message) {
    super(message);
    this.code = code;
  }
}
