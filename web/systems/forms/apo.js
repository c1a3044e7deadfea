// The page of a folder of `ptm apo`: a simplified mesh, and the normals of its source by levels.
//
//     ?update=steps&step=0.5   shows parts of levels every 0.5 s; else a level when it is complete
//     ?levels=8                shows the first 8 levels at most; 0 shows the mesh's own normals
//     ?normals                 shows normals as colours
//     #azimuth,elevation,distance  degrees, degrees, diameters

import { checkOctree, demand, isWhole, Octree } from "../octree/octree.js";
import { find, inBytes } from "../../page/ui/elements.js";
import { showNotice } from "../../page/ui/errors.js";
import { indexOf, runForm } from "../../page/forms/form.js";
import { meshOf, OctreeDrawing } from "./octree-drawing.js";
import { ANGLE, Orbit } from "./orbit.js";
import { form } from "../../page/words/english.js";
import { fill } from "../../page/words/language.js";

/** What the page needs of `apo.json`, checked. @param {any} index */
function checkedIndex(index) {
  demand(index?.format === "ptmtools apo" && index.schema === 1, "not an index of an octree texture");
  const { cube, levels, normals, colors, mesh } = index;
  demand(normals?.file === "apo.bin" && (colors ?? { file: "color.bin" }).file === "color.bin", "other streams");
  const octree = { cube, levels, streams: colors ? [normals, colors] : [normals] };
  checkOctree(octree);
  demand(mesh?.file === "mesh.glb" && isWhole(mesh.crc32, 0, 0xffffffff), "no mesh");
  return { ...octree, mesh };
}

runForm(async (gl, config, fetcher, fail) => {
  const query = new URLSearchParams(location.search);
  const address = new URL(config.index, location.href).href;
  const urlOf = (/** @type {string} */ file) => new URL(file, address).href;
  const index = await indexOf(fetcher, address, checkedIndex);
  const mesh = await fetcher.whole(urlOf(index.mesh.file), (body) => meshOf(body, index.mesh.crc32));
  const step = query.get("update") === "steps" ? Math.max(0.05, Number(query.get("step")) || 0.5) : 0;
  const octree = new Octree(gl, index, urlOf, fetcher, step);
  const drawing = new OctreeDrawing(gl, mesh, index.cube);
  const canvas = /** @type {HTMLCanvasElement} */ (gl.canvas);
  const middle = mesh.low.map((x, k) => (x + mesh.high[k]) / 2);
  const orbit = new Orbit(canvas, middle, Math.hypot(...mesh.high.map((x, k) => x - mesh.low[k])));
  const levels = query.has("levels") ? Math.max(0, Number(query.get("levels")) || 0) : Infinity;
  const bare = query.has("normals");
  const total = index.streams.reduce((sum, { ends }) => sum + (ends.at(-1) ?? 0), 0);
  let paused = false, drawn = "", shown = 0;
  // What is there stays when a finer level cannot be fetched.
  const report = (/** @type {import("../../page/net/errors.js").PageError} */ fault) =>
    octree.levels ? showNotice(document, fault.message) : fail(fault);
  find(document, "#keys").textContent = form.orbit;
  return {
    frame(dt) {
      orbit.step(dt);
      const { camera } = orbit;
      // The levels that are shown end where their nodes are smaller than a pixel (section 4.2).
      const wanted = (/** @type {number} */ there) =>
        there < levels && (!there || drawing.pixels(there - 1, canvas.height, camera) > 1);
      octree.advance(wanted, report);
      paused = !octree.complete && !wanted(octree.levels);
      const picture = [canvas.width, canvas.height, ...camera.eye, octree.updates, octree.partial].join();
      if (picture !== drawn) drawing.draw(octree, camera, { bare, levels });
      drawn = picture;
      shown = octree.levels;
      const rest = octree.complete || octree.levels >= levels ? "" : paused ? `; ${form.closer}` : " …";
      const numbers = { count: octree.levels, total: index.levels.length, bytes: inBytes(octree.fetched), all: inBytes(total) };
      return fill(form.levels, numbers) + rest;
    },
    state: () => ({
      levels: octree.levels,
      partial: octree.partial,
      complete: octree.complete && shown === octree.levels,
      paused,
      updates: octree.updates,
      requests: fetcher.requests,
      bytes: fetcher.bytes,
      pending: fetcher.pending,
      camera: orbit.camera,
    }),
    address: () => `#${[orbit.azimuth, orbit.elevation, orbit.distance].map((part) => Number(part.toFixed(3))).join()}`,
    look: () => ({ eye: orbit.camera.eye, direction: orbit.camera.ahead, angle: ANGLE }),
    place: orbit.place.bind(orbit),
  };
});
