// The page of a campus: a visitor walks on open ground between objects with levels of detail.
//
//     ?preset=Medium         sizes of textures near the visitor
//     #x,y,z,yaw             metres and degrees

import { CampusClient } from "../campus/client.js";
import { CampusDrawing, finest } from "../campus/drawing.js";
import { CampusFiles } from "../campus/files.js";
import { CampusIndex, LEAST } from "../campus/index.js";
import { Labels } from "../campus/labels.js";
import { Records } from "../campus/records.js";
import { cameraOf } from "../../page/gl/camera.js";
import { directionOf, frustumOf, meetsBox } from "../../page/space/frustum.js";
import { attachControls } from "../../page/ui/controls.js";
import { find, inBytes, make } from "../../page/ui/elements.js";
import { showNotice } from "../../page/ui/errors.js";
import { fragmentOf, poseOf } from "../../page/ui/address.js";
import { Solids } from "../../page/walk/solids.js";
import { Walker } from "../../page/walk/walker.js";
import { indexOf, runForm } from "../../page/forms/form.js";
import { form } from "../../page/words/english.js";
import { fill } from "../../page/words/language.js";

/** Vertical field of view, radians; radius, height of the eye and highest step of the visitor, m. */
const ANGLE = Math.PI / 3, BODY = [0.25, 1.6, 0.5];
/** Objects nearer than this become solid, and those nearer than that must be before a step, m. */
const SOLID = 40, REACH = 2;
/** Height of the lowest object with a name, m. */
const LOWEST = 3;
/** Seconds out of view after which an object shows less detail. */
const HIDDEN = 5;
/** Seconds of a frame for collision geometry. */
const TIME = 0.004;

runForm(async (gl, config, fetcher, fail) => {
  const canvas = /** @type {HTMLCanvasElement} */ (gl.canvas), query = new URLSearchParams(location.search);
  const address = new URL(config.index, location.href).href;
  const index = await indexOf(fetcher, address, (document) => new CampusIndex(document));
  const preset = index.presets.find(({ name }) => name === query.get("preset")) ?? index.presets[0];
  const client = new CampusClient(index, preset);
  const files = new CampusFiles(gl, index, (file) => new URL(file, address).href, fetcher);
  const drawing = new CampusDrawing(gl, index, files);
  const solids = new Solids();
  // A visitor stands still until the ground and the walls around are known.
  const ready = () => client.begun && index.objects.every(({ box }, k) => outside(walker.pose.eye, box) > REACH || solids.has(k));
  const near = solids.near.bind(solids);
  const walker = new Walker({ solids: /** @type {any} */ ({ near, has: ready }), locate: () => 0, avatar: BODY });
  const { wishes } = attachControls(document, { canvas });
  const low = [0, 1, 2].map((k) => Math.min(...index.objects.map(({ box }) => box[k])));
  const far = 2 * Math.hypot(...[0, 1, 2].map((k) => Math.max(...index.objects.map(({ box }) => box[k + 3])) - low[k])) + 100;
  /** Seconds since each object was in view. */
  const hidden = new Float64Array(index.objects.length);
  const sizes = [...new Set([...index.files.values()].map(({ size }) => size ?? 0))].sort((a, b) => b - a);

  /** @param {import("../campus/index.js").CampusObject} object */
  const visit = ({ viewpoint: { position, direction: [x, y, z] } }) => {
    walker.place({ eye: [...position], yaw: Math.atan2(-x, -z), pitch: Math.asin(Math.max(-1, Math.min(1, y))) });
  };
  visit(index.objects.reduce((best, one) => (heightOf(one) > heightOf(best) ? one : best)));
  const linked = poseOf(location.hash);
  if (linked) walker.place(linked);
  const named = index.objects.filter((one) => isPlace(one) || (one.parts.length === 1 && heightOf(one) >= LOWEST));
  const records = new Records(document, files);
  const labels = new Labels(document, named, (object) => {
    visit(object);
    records.show(object);
    find(document, "#places").hidden = true;
    canvas.focus();
  });
  attachPanels(client, index, () => fragmentOf(walker.pose));
  find(document, "#keys").textContent = form.campus;

  /** One of the threads. @param {string} first @param {string[]} thread */
  const run = async (first, thread) => {
    for (let file = /** @type {string | null} */ (first); file; file = client.after(thread)) {
      const name = file;
      // The next file is requested while this one is decoded.
      await new Promise((resolve) => {
        files.load(name, () => resolve(null)).then(() => client.loaded.add(name), (fault) => {
          // Coarse detail of everything stays; what was asked for is not asked for again.
          if (!client.begun) return fail(fault);
          showNotice(document, fault.message);
          client.failed.add(name);
          resolve(null);
        });
      });
    }
    advance();
  };
  /** Gives the next objects to free threads, in every frame and when a thread ends. */
  const advance = () => {
    for (let job = client.next(); job; job = client.next()) run(job.file, job.thread).catch(fail);
  };

  /** The objects in view with the detail that they are shown in. @param {ReturnType<typeof frustumOf>} frustum
   * @param {number} dt */
  const shownOf = (frustum, dt) => {
    const shown = [], kept = new Set();
    const near = new Set(client.near);
    for (const [far, k] of client.order.entries()) {
      const { box, meshes, lightmap } = index.objects[k];
      const inView = meetsBox(frustum, box, box, 0, 3);
      hidden[k] = inView ? 0 : hidden[k] + dt;
      const last = meshes[meshes.length - 1].file;
      // The preset's lightmap, or another until it is there.
      const light = lightmap && (finest(client.loaded, lightmap, "l", fitting(client.preset.light))
        ?? finest(client.loaded, lightmap, "l", sizes));
      // High detail of what is near, unless it has been out of view for a while.
      const high = near.has(k) && hidden[k] < HIDDEN && client.loaded.has(last);
      const mesh = high ? last : meshes[0].file;
      if (!client.loaded.has(mesh)) continue;
      const lit = high ? light : null;
      kept.add(mesh).add(meshes[0].file);
      if (lit) kept.add(lit);
      if (inView) shown.push({ object: k, mesh, lightmap: lit, far });
    }
    return { shown, kept };
  };

  /** Bases of what is near, which alone have more than the least size. @type {Set<string | null>} */
  let bases = new Set();
  /** @param {string} base @param {string} channel */
  const textureOf = (base, channel) =>
    finest(client.loaded, base, channel, bases.has(base) ? fitting(client.preset.diffuse) : [LEAST]);
  /** Sizes up to one, the largest first. @param {number} most */
  const fitting = (most) => sizes.filter((size) => size <= Math.max(most, LEAST));

  /** All that a picture depends on. */
  const pictureOf = () => {
    const { pose: { eye, yaw, pitch } } = walker, { loaded, preset } = client;
    return [canvas.width, canvas.height, ...eye, yaw, pitch, loaded.size, preset.name, files.changes].join();
  };

  let memory = 0, drawn = "";
  return {
    frame(dt) {
      const until = performance.now() + 1000 * TIME;
      for (const k of client.order) {
        const { box, meshes } = index.objects[k], parts = files.parts(meshes[0].file);
        if (!parts || outside(walker.pose.eye, box) > SOLID || solids.has(k)) continue;
        if (!solids.add(k, /** @type {any} */ (parts), /** @type {any} */ ({ portals: [] }), () => performance.now() > until)) break;
      }
      walker.step(dt, wishes());
      const { pose } = walker;
      if (client.look(pose.eye)) {
        bases = new Set(client.near.flatMap((k) => index.objects[k].materials.map((m) => index.materials[m].base)));
      }
      advance();
      const aspect = canvas.width / canvas.height, camera = cameraOf(pose, ANGLE, aspect, far);
      const { shown, kept } = shownOf(frustumOf(pose, ANGLE, aspect), dt);
      for (const { base, channels } of index.materials) {
        for (const channel of base ? channels : []) {
          const file = textureOf(/** @type {string} */ (base), channel);
          if (file) kept.add(file);
        }
      }
      files.keep(kept);
      if (pictureOf() !== drawn) {
        drawing.draw(camera, shown, textureOf);
        labels.place(camera, canvas.clientWidth, canvas.clientHeight);
        drawn = pictureOf();
      }
      memory = files.bytes;
      const full = client.near.filter((k) => client.full(k)).length;
      const loading = client.begun ? fill(form.near, { count: full, total: client.near.length }) : form.loading;
      return `${loading}; ${fill(form.memory, { bytes: inBytes(fetcher.bytes), all: inBytes(memory) })}`;
    },
    state: () => ({
      begun: client.begun,
      complete: client.complete,
      near: client.near,
      full: client.near.filter((k) => client.full(k)),
      order: client.order,
      sorts: client.sorts,
      preset: client.preset.name,
      memory,
      requests: fetcher.requests,
      bytes: fetcher.bytes,
      pending: fetcher.pending,
      pose: walker.pose,
    }),
    address: () => fragmentOf(walker.pose),
    look: () => ({ eye: walker.pose.eye, direction: directionOf(walker.pose.yaw, walker.pose.pitch), angle: ANGLE }),
    place: (/** @type {number[]} */ eye, /** @type {number} */ yaw, pitch = 0) => walker.place({ eye, yaw, pitch }),
    files,
  };
});

/** @param {import("../campus/index.js").CampusObject} object */
const heightOf = ({ box }) => box[4] - box[1];

/** Whether an object was made a point of interest. @param {import("../campus/index.js").CampusObject} object */
const isPlace = ({ icon, rank }) => icon !== undefined || rank !== undefined;

/** Metres on the ground to a box. @param {number[]} eye @param {number[]} box */
const outside = (eye, box) =>
  Math.hypot(...[0, 2].map((k) => Math.max(box[k] - eye[k], eye[k] - box[k + 3], 0)));

/** The menus of places and presets. @param {CampusClient} client @param {CampusIndex} index
 * @param {() => string} here the fragment of the visitor's place */
function attachPanels(client, index, here) {
  // "Ultra cached" differs from "Ultra" in simulations alone.
  const presets = index.presets.filter(({ diffuse, light }, k) =>
    index.presets.findIndex((one) => one.diffuse === diffuse && one.light === light) === k);
  const nav = find(document, "nav"), places = find(document, "#places");
  const toggle = make("button", { textContent: form.places, hidden: !places.children.length, onclick: () => (places.hidden = !places.hidden) });
  const select = make("select", { ariaLabel: form.detail },
    ...presets.map(({ name }) => make("option", { textContent: name, selected: name === client.preset.name })));
  select.onchange = () => {
    client.choose(presets[select.selectedIndex]);
    history.replaceState(null, "", `?preset=${encodeURIComponent(select.value)}${here()}`);
    find(document, "canvas").focus();
  };
  nav.append(toggle, select);
  nav.hidden = false;
  addEventListener("keydown", ({ key }) => {
    if (key === "Escape") places.hidden = true;
  });
}
