// Written by web/page/build.py from ptmtools/site/words/en.json.

/** @template {Record<string, string>} T @param {string} name @param {T} words */
const own = (name, words) =>
  Object.assign(words, Reflect.get(globalThis, "ptmWords")?.[name]);

export const markup = /* @__PURE__ */ own("markup", {
  "loading": "Loading",
  "walk": "Walk",
  "arrows": "Walk with the arrow keys.",
  "places": "Places",
  "map": "Map",
  "copyLink": "Copy link",
  "details": "Details",
  "help": "Help",
  "noWalk": "The walk cannot be shown",
  "noForm": "This cannot be shown",
  "reload": "Reload",
  "works": "The works as text and pictures"
});

export const page = /* @__PURE__ */ own("page", {
  "room": "Loading the room",
  "textures": "Loading textures",
  "outside": "The link leads to a place outside of the building.",
  "unloaded": "A part of this page cannot be loaded now.",
  "copied": "The link to this place is copied.",
  "slow": "Textures load slowly here: the server does not support range requests.",
  "noSimd": "This browser cannot run WebAssembly with SIMD.",
  "noWebgl": "This browser cannot draw with WebGL 2.",
  "damaged": "{file} is damaged: {reason}",
  "offline": "{file} cannot be downloaded: {reason}",
  "missing": "{file} is missing on this site",
  "refused": "{file} is refused with status {reason} on this site",
  "unshown": "{file} is not shown: {reason}",
  "partial": "{file} is not shown with all of its levels: {reason}",
  "undecoded": "Textures cannot be decoded: {reason}",
  "noGeometry": "The geometry cannot be decoded: {reason}",
  "PTM-V101": "Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer, with hardware acceleration on.",
  "PTM-V102": "Use a current Chrome, Edge or Firefox, or Safari 16.4 or newer.",
  "PTM-V103": "Tell the owner of this site: publishing it again should repair it.",
  "PTM-V104": "Check your connection and reload the page.",
  "PTM-V105": "Tell the owner of this site: publishing it again should repair it.",
  "PTM-V106": "Update the browser, or allow this page to use web workers and more memory.",
  "otherwise": "Reload the page. If that does not help, tell the owner of this site."
});

export const panels = /* @__PURE__ */ own("panels", {
  "places": "Places",
  "map": "Map",
  "here": "you are here",
  "visible": "visible from here",
  "storey": "storey {number} of {count}",
  "plan": "Plan of storey {number}, you are in cell {cell}",
  "details": "Details",
  "frames": "Frame rate",
  "frameRate": "{number} fps",
  "paper": "With 3 bytes for RGB",
  "received": "Received",
  "requests": "{count} requests",
  "connection": "Connection",
  "cell": "Cell",
  "none": "none",
  "drawn": "{cell} ({count} drawn)",
  "pending": "Pending",
  "nothing": "nothing for this view",
  "levels": "Textures by finest level loaded",
  "toLevel": "{count} to level {level}",
  "withNone": "{count} with none",
  "memory": "Texture memory",
  "used": "Texture memory: {bytes} of {most}",
  "measured": "Texture memory: {bytes} of {most}, measured",
  "settings": "Settings",
  "saver": "Data saver: only what is in view",
  "policy": "Policy",
  "patience": "Patience, δt",
  "freeze": "Freeze loading",
  "compare": "Compare",
  "noBudget": "No texture memory keeps 30 pictures a second here: the default stays.",
  "howTo": "How to walk",
  "forward": "forward, back",
  "turn": "turn",
  "sideways": "step sideways",
  "look": "look up, down",
  "run": "hold to run",
  "mouse": "Mouse",
  "drag": "drag to look around",
  "oneFinger": "One finger",
  "dragWalk": "drag up or down to walk, left or right to turn",
  "twoFingers": "Two fingers",
  "gamepad": "Gamepad",
  "pad": "left stick to walk, right stick to turn, shoulder buttons for the places; D-pad to choose, A or ✕ to use, B or ○ to close",
  "close": "close",
  "streamed": "streamed",
  "full": "full resolution",
  "copy": "Copy the link to this place:",
  "link": "Link to this place",
  "unmeasured": "Texture memory could not be measured."
});

export const devices = /* @__PURE__ */ own("devices", {
  "enterVr": "Enter VR",
  "noVr": "VR does not work: {reason}",
  "refused": "The browser does not let a gamepad do this. Use a mouse, a key or a finger."
});

export const tour = /* @__PURE__ */ own("tour", {
  "label": "Label",
  "tour": "Tour",
  "stop": "Stop {number}",
  "language": "Language",
  "catalogue": "As a page of text and pictures",
  "previous": "Previous",
  "next": "Next",
  "close": "Close",
  "image": "Description of the picture",
  "more": "More about it",
  "unloaded": "The labels of the tour could not be loaded.",
  "damaged": "The tour is damaged."
});

export const objects = /* @__PURE__ */ own("objects", {
  "relief": "The relief of {name} does not fit the index.",
  "object": "an object",
  "octree": "The index has a wrong octree: {reason}",
  "largeTexture": "This graphics card has no textures of 4,096 texels.",
  "largeImage": "The image is larger than this graphics card's textures.",
  "damaged": "{file} is damaged: {reason}",
  "noSets": "This site has no interlaced images, so you see its own textures.",
  "fixed": "The policy and the comparison are those of other textures than interlaced images."
});

export const form = /* @__PURE__ */ own("form", {
  "reset": "The graphics card has reset the page.",
  "orbit": "Drag or use the arrow keys to turn; wheel, two fingers, + and − to zoom",
  "pan": "Drag or use the arrow keys to move; wheel, two fingers, + and − to zoom",
  "campus": "WASD or the arrow keys to walk, drag to look around, Shift to run",
  "levels": "{count} of {total} levels, {bytes} of {all}",
  "files": "{count} of {total} files, {size} of {whole}, {bytes} of {all}",
  "closer": "finer ones when you come closer",
  "zoom": "finer ones when you zoom in",
  "tooLarge": "more than this graphics card can hold",
  "eightBits": "shown in 8 bits",
  "loading": "loading",
  "near": "{count} of {total} near objects complete",
  "memory": "{bytes} received, {all} of graphics memory",
  "places": "Places",
  "detail": "Detail of near objects",
  "record": "Record",
  "close": "Close"
});
