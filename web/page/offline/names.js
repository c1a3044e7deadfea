// The names of a site's files: which of them a visitor keeps, and which files a document names.

/** Documents, whose names stay; files whose names change with their contents. */
const DOCUMENT = /^(?:index\.html|catalogue(?:-[\w-]+)?\.html|manifest\.webmanifest)$/;
const FILE = /^(?:data\/[\w/-]*|viewer)-[0-9a-f]{10}[./-][\w./-]*$/;
/** Documents among the files, which name others. */
const LIST = /^data\/(?:index|tour|sets\/sets)-/;
/** A stem with its hash: previews of a texture, and openings, share one. */
const MARK = /[\w-]*-[0-9a-f]{10}(?![0-9a-f])/g;
const MENTION = /\b(?:data|viewer-[0-9a-f]{10})\/[\w./-]+/g;

/** The name in a site of a URL; null of anything else. @param {string} url @param {string} scope */
export function nameOf(url, scope) {
  const [place] = url.split(/[?#]/);
  return place.startsWith(scope) ? place.slice(scope.length) : null;
}

/** The document at an address of a site, "" for the page; null of any other. Hosts may remove `.html`.
 * @param {string} address */
export function documentOf(address) {
  const name = [address || "index.html", `${address}.html`].find((one) => DOCUMENT.test(one));
  return name === "index.html" ? "" : name ?? null;
}
/** @param {string} name */
export const isFile = (name) => FILE.test(name);
/** Players read sounds as they play, in ranges of their own. @param {string} url */
export const isSound = (url) => /\.(?:mp3|m4a|ogg|opus|wav)$/.test(url);
/** @param {string} name */
export const isList = (name) => LIST.test(name) || Boolean(documentOf(name));

/** What a text names. @param {string} text @returns {string[]} */
export const marksIn = (text) => text.match(MARK) ?? [];
/** What a text has to name so that a file stays. @param {string} name */
export const markOf = (name) => marksIn(name.replace(/^data\/(?:sets\/)?/, ""))[0];

/** The files without which a page does not start, and its panels. It starts without an opening, which is kept if
 * it has come (`Visits.keep`); only link previews show a picture.
 * @param {string} html @returns {string[]} */
export function neededBy(html) {
  const named = new Set((html.match(MENTION) ?? []).filter((name) => isFile(name) && !/\/(?:opening|picture)-/.test(name)));
  const viewer = [...named].find((name) => name.endsWith("/viewer.js"));
  return viewer ? [...named, viewer.replace("viewer.js", "later.js")] : [...named];
}
