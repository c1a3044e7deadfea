// The panel of a label: title, maker, text, sound with captions, and the way through the tour.

import { make } from "../ui/elements.js";
import { elementsOf, isSafe } from "./markup.js";
import { tour as words } from "../words/english.js";

/** @typedef {import("./document.js").Label} Label */
/** @typedef {<T>(texts: Record<string, T> | undefined) => {text: T, tag: string} | null} Choose */

/** An element with a text in its language, if there is one. @param {string} name
 * @param {{text: string, tag: string} | null} chosen @param {Record<string, any>} [properties] */
const line = (name, chosen, properties = {}) =>
  chosen ? [make(name, { ...properties, lang: chosen.tag, dir: "auto" }, String(chosen.text))] : [];

/**
 * Fills the panel; returns its heading.
 * @param {HTMLElement} root
 * @param {Label} label
 * @param {object} use
 * @param {Choose} use.choose the version of a text
 * @param {(file: string) => string} use.urlOf a file of the tour
 * @param {() => void} use.close
 * @param {{text: string, go: () => void}[]} use.ways to other stops
 */
export function fillLabel(root, label, { choose, urlOf, close, ways }) {
  const title = choose(label.title) ?? { text: label.id, tag: "" };
  const maker = choose(label.maker), date = choose(label.date);
  const by = [maker, date].filter((part) => part !== null);
  const text = choose(label.text), image = choose(label.image), link = choose(label.link);
  const heading = make("h2", { tabIndex: -1, lang: title.tag, dir: "auto" }, String(title.text));
  root.replaceChildren(
    make("button", { className: "close", ariaLabel: words.close, onclick: close }, "×"),
    heading,
    ...(by.length ? [make("p", { className: "by" }, ...separated(by))] : []),
    ...(text ? [make("div", { lang: text.tag, dir: "auto" }, ...elementsOf(text.text))] : []),
    ...soundOf(label, choose, urlOf),
    ...(image
      ? [make("details", {}, make("summary", {}, words.image), ...line("p", image))]
      : []),
    ...(link && isSafe(link.text)
      ? [make("p", {}, make("a", { href: link.text, target: "_blank", rel: "noopener" }, words.more))]
      : []),
    make("p", { className: "row" }, ...ways.map(({ text: name, go }) => make("button", { onclick: go }, name))),
  );
  return heading;
}

/** Texts with commas between. @param {{text: string, tag: string}[]} parts */
const separated = (parts) =>
  parts.flatMap((part, k) => [...(k ? [", "] : []), ...line("span", part)]);

/**
 * A player that loads nothing before it is used, with captions below.
 * @param {Label} label @param {Choose} choose @param {(file: string) => string} urlOf
 */
function soundOf(label, choose, urlOf) {
  const sound = choose(label.sound), captions = choose(label.captions);
  if (!sound) return [];
  const audio = make("audio", { controls: true, preload: "none", src: urlOf(String(sound.text)) });
  if (!captions) return [audio];
  const track = make("track", { kind: "captions", default: true, srclang: captions.tag || "und" });
  const shown = make("p", { className: "captions", lang: captions.tag, dir: "auto" });
  // A player without a picture shows none itself; the browser loads the file with the first play.
  audio.onplay = () => {
    if (!track.src) track.src = urlOf(String(captions.text));
    track.track.mode = "hidden";
  };
  track.track.oncuechange = () => {
    const cues = /** @type {VTTCue[]} */ ([...(track.track.activeCues ?? [])]);
    shown.textContent = cues.map((cue) => cue.getCueAsHTML().textContent).join("\n");
  };
  audio.append(track);
  return [audio, shown];
}
