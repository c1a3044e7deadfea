// A KTX2 file: `node ktx2.mjs PACKAGE etc1s|uastc WIDTH HEIGHT TEXELS OUT`, TEXELS being a file of
// RGBA. With all levels, made as ours are: means of four texels as they are stored. UASTC is
// compressed by Zstandard, without the search for cheaper blocks (RDO), which takes five times as
// long and saves a fifth.

import { readFileSync, writeFileSync } from "node:fs";

const [home, form, width, height, texels, out] = process.argv.slice(2);
const { default: loaded } = await import(`${home}/dist/basis/basis_encoder.js`);
const { encodeWithModule } = await import(`${home}/dist/encodeCore.js`);
const basis = await loaded();
basis.initializeBasis();

// The package has no options for these two.
function BasisEncoder() {
  const encoder = new basis.BasisEncoder();
  encoder.setMipSRGB(false);
  encoder.setMipFilter("box");
  return encoder;
}

const forms = {
  etc1s: { isUASTC: false, qualityLevel: 128, compressionLevel: 2 },
  uastc: { isUASTC: true, needSupercompression: true, uastcLDRQualityLevel: 1 },
};
const data = new Uint8Array(readFileSync(texels));
const file = await encodeWithModule({ BasisEncoder }, data, {
  ...forms[form],
  generateMipmap: true,
  isKTX2File: true,
  isPerceptual: true,
  isSetKTX2SRGBTransferFunc: true,
  imageDecoder: async () => ({ width: Number(width), height: Number(height), data }),
});
writeFileSync(out, file);
