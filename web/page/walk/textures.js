// The textures of a view: what they count, what they lose, and whether they are as the client wants them.

/** @typedef {import("../walkthrough.js").Walkthrough} Walkthrough */

/** The loss of the best source that each texture has of its column. @param {import("../policy/client.js").Client} client */
export const losses = ({ column, downloads }) => Float64Array.from(column, (k, t) => downloads.loss(t, k));

/** Share of the view of each texture, for the order of uploads. @param {Walkthrough} walk */
export const shares = ({ needs: { present }, client: { catalogue: { T, K } } }) =>
  Float64Array.from({ length: T }, (_, t) => present?.[t * K + 1] ?? 0);

/** Whether no texture in view waits for texels that are here. @param {Walkthrough} walk */
export function settled({ client, client: { catalogue: { K } }, memory, needs: { present } }) {
  return memory.held.every((held, t) => {
    const shows = (/** @type {number} */ k) => present && present[t * K + k] > 0;
    let column = client.column[t];
    if (held > 0 && client.downloads.loss(t, column) < memory.loss[t] && shows(1)) return false;
    while (column > held && !shows(column)) column--;
    return column <= held;
  });
}

/** Whether a texture shows a preview. @param {Walkthrough} walk @param {number} t */
export const previews = ({ memory }, t) => memory.held[t] > 0 && memory.loss[t] > 0;

/** Whether a texture in view does. @param {Walkthrough} walk */
export const previewed = (walk) => shares(walk).some((share, t) => share > 0 && previews(walk, t));
