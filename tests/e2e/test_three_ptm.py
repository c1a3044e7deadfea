"""Textures of `web/three-ptm` in a browser: what the GPU holds is what Python decodes."""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ptmtools.texture import EncodeOptions, decode_levels, encode, read_header
from ptmtools.texture.detail import with_offset
from tests.site.previews import Preview, decoded, halved, levels_of, saved
from tests.texture.coding import textured

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "e2e"))

IMAGES = {
    "grey": (textured(64, 64, 1), EncodeOptions()),
    "grey-alpha": (textured(37, 50, 2), EncodeOptions()),
    "odd": (textured(211, 99, 3), EncodeOptions()),
    "wide": (textured(3, 300, 3), EncodeOptions()),
    "rgba": (textured(90, 130, 4), EncodeOptions(profile="raw")),
    "tiled": (textured(390, 410, 3), EncodeOptions(tile=64)),
    "within": (textured(128, 128, 3), EncodeOptions(max_error=4)),
    "large": (textured(700, 900, 3), EncodeOptions()),
}


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("files")
    for name, (image, options) in IMAGES.items():
        (folder / f"{name}.ptm").write_bytes(encode(image, options))
    return folder


def rgba(level: Any) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Grey in all colours, opaque without alpha."""
    alpha = level[..., -1:] if level.shape[2] in (2, 4) else np.full_like(level[..., :1], 255)
    colors = level[..., :3] if level.shape[2] >= 3 else np.repeat(level[..., :1], 3, axis=2)
    return np.concatenate([colors, alpha], axis=2)


def expected(file: Path) -> list[str]:
    """SHA-256 of the levels, coarsest first."""
    return [
        hashlib.sha256(rgba(level).tobytes()).hexdigest()
        for level in decode_levels(file.read_bytes())
    ]


def pyramid_bytes(file: Path) -> list[int]:
    """Texture memory of the levels up to each."""
    sizes = [4 * level.shape[0] * level.shape[1] for level in decode_levels(file.read_bytes())]
    return [int(total) for total in np.cumsum(sizes)]


EVERY_LEVEL = """
const stated = [];
const { levels, name } = settings;
const texture = new PtmTexture(renderer, `/files/${name}.ptm`);
for (const level of settings.order) {
  gpu.most = gpu.bytes;
  const uploaded = gpu.uploads;
  if (!(await texture.refine(level)) || texture.level !== level) throw new Error(`not ${level}`);
  stated.push({
    levels: await levelsOf(renderer, texture),
    stated: texture.gpuBytes, counted: gpu.bytes, most: gpu.most, uploaded: gpu.uploads - uploaded,
  });
}
texture.dispose();
return { stated, largest: gpu.largest, left: gpu.bytes, textures: renderer.info.memory.textures };
"""


@pytest.mark.parametrize("name", IMAGES)
def test_levels_are_pythons(three: Any, files: Path, name: str) -> None:
    """Each level one by one, then fewer, then all at once: those asked for and no others, uploaded
    once, and counted while they move."""
    wanted, memory = expected(files / f"{name}.ptm"), pyramid_bytes(files / f"{name}.ptm")
    last = len(wanted) - 1
    order = [*range(last + 1), last // 2, 0, last]
    actual, visit = three.run(EVERY_LEVEL, {"files": files}, name=name, order=order)
    assert visit.messages == []
    before = -1
    for level, reported in zip(order, actual["stated"], strict=True):
        assert reported["levels"] == wanted[: level + 1]
        assert reported["stated"] == reported["counted"] == memory[level]
        had = memory[before] if before >= 0 else 0
        if level == before + 1 or level < before:
            assert reported["most"] == (had + memory[level] if before >= 0 else memory[level])
        assert reported["uploaded"] == max(memory[level] - had, 0)
        before = level
    assert actual["largest"] <= 1 << 18
    assert actual["left"] == actual["textures"] == 0
    ends = [end for _, _, end in visit.ranges]
    begins = [begin for _, begin, _ in visit.ranges]
    assert begins == [0, *ends[:-1]], "each range begins where the last one ended"
    assert ends[-1] == (files / f"{name}.ptm").stat().st_size
    assert len(visit.ranges) <= last + 2


BRIGHT = """
const { name, offsets } = settings;
const texture = new PtmTexture(renderer, `/files/${name}.ptm`, { offsets });
await texture.refine(99);
return await levelsOf(renderer, texture);
"""


@pytest.mark.parametrize("name", ["odd", "rgba", "grey-alpha"])
def test_levels_are_as_bright_as_the_image(three: Any, files: Path, name: str) -> None:
    """By the offsets of the index, which leave alpha as it is and end at 0 and 255."""
    levels = [*decode_levels((files / f"{name}.ptm").read_bytes())]
    offsets = [200, *(-k for k in range(len(levels) - 1))]
    bright = [with_offset(*pair) for pair in zip(levels, offsets, strict=True)]
    wanted = [hashlib.sha256(rgba(level).tobytes()).hexdigest() for level in bright]
    actual, visit = three.run(BRIGHT, {"files": files}, name=name, offsets=offsets)
    assert actual == wanted
    assert len({*wanted} & {*expected(files / f"{name}.ptm")}) == 1
    assert visit.messages == []


LOST = """
const [first, second] = ["odd", "tiled"].map((name) =>
  new PtmTexture(renderer, `/files/${name}.ptm`, { color: [200, 100, 0] }));
const material = new THREE.MeshBasicMaterial({ map: second });
const scene = new THREE.Scene().add(new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material));
const camera = new THREE.OrthographicCamera(-1, 1, 1, -1, -1, 1);
const next = (name) =>
  new Promise((resolve) => renderer.domElement.addEventListener(name, resolve, { once: true }));
const middle = () => {
  renderer.render(scene, camera);
  const gl = renderer.getContext(), texel = new Uint8Array(4);
  gl.readPixels(32, 32, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, texel);
  return [...texel];
};
const before = middle();
await first.refine(3);
await second.refine(99);
const whole = second.level;
const shown = middle();
const pending = first.refine(99);
const lost = next("webglcontextlost"), restored = next("webglcontextrestored");
renderer.forceContextLoss();
await lost;
const levels = [first.level, second.level];
// Three.js draws nothing now, and what is asked for meanwhile waits.
renderer.render(scene, camera);
setTimeout(() => renderer.forceContextRestore(), 50);
await restored;
gpu.bytes = gpu.most = 0;
gpu.storages.clear();
const done = await pending;
while (second.level < whole) await new Promise((resolve) => setTimeout(resolve, 10));
return {
  before, shown, levels, done, after: middle(),
  found: [await levelsOf(renderer, first), await levelsOf(renderer, second)],
  stated: first.gpuBytes + second.gpuBytes, counted: gpu.bytes,
};
"""


def test_a_lost_context_comes_back(three: Any, files: Path) -> None:
    """From the bytes at hand: what was there is not fetched again, what was under way goes on."""
    actual, visit = three.run(LOST, {"files": files})
    assert visit.messages == []
    assert actual["before"] == [200, 100, 0, 255]
    assert actual["levels"] == [-1, -1]
    assert actual["done"] is True
    assert actual["found"] == [expected(files / f"{name}.ptm") for name in ("odd", "tiled")]
    assert actual["after"] == actual["shown"] != actual["before"]
    assert actual["stated"] == actual["counted"]
    whole = [end - begin for path, begin, end in visit.ranges if "tiled" in path]
    assert sum(whole) == (files / "tiled.ptm").stat().st_size


CALLED_OFF = """
const texture = new PtmTexture(renderer, "/files/large.ptm");
const calls = [texture.refine(99), texture.refine(99), texture.refine(2)];
const first = await Promise.all(calls);
const levels = [texture.level];
const late = texture.refine(99);
texture.refine(-1);
const second = await late;
await texture.refine(-1);
levels.push(texture.level);
const disposed = texture.refine(99);
texture.dispose();
const third = await disposed;
await new Promise((resolve) => setTimeout(resolve, 200));
return { first, second, third, levels, left: gpu.bytes, stated: texture.gpuBytes };
"""


def test_refining_is_called_off(three: Any, files: Path) -> None:
    actual, visit = three.run(CALLED_OFF, {"files": files})
    assert visit.messages == []
    assert actual == {
        "first": [False, False, True],
        "second": False,
        "third": False,
        "levels": [2, -1],
        "left": 0,
        "stated": 0,
    }


WRAPPED = """
const one = new PtmTexture(renderer, "/files/odd.ptm", { wrapS: THREE.ClampToEdgeWrapping });
const other = one.clone();
other.wrapS = THREE.RepeatWrapping;
await one.refine(99);
await other.refine(4);
const gl = renderer.getContext();
const wraps = [one, other].map((texture) => {
  gl.bindTexture(gl.TEXTURE_2D, renderer.properties.get(texture).__webglTexture);
  return gl.getTexParameter(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S);
});
renderer.resetState();
return {
  wraps, stated: [one.gpuBytes, other.gpuBytes], counted: gpu.bytes,
  found: [await levelsOf(renderer, one), await levelsOf(renderer, other)],
};
"""


def test_two_ways_to_wrap_are_two_textures(three: Any, files: Path) -> None:
    """Both counted, the file fetched once."""
    actual, visit = three.run(WRAPPED, {"files": files})
    file = files / "odd.ptm"
    wanted, memory = expected(file), pyramid_bytes(file)
    assert visit.messages == []
    assert actual["wraps"] == [33071, 10497]
    assert actual["found"] == [wanted, wanted[:5]]
    assert actual["stated"] == [memory[-1], memory[4]]
    assert actual["counted"] == memory[-1] + memory[4]
    assert sum(end - begin for _, begin, end in visit.ranges) == file.stat().st_size


FAULTS = """
const say = [];
for (const name of settings.names) {
  const texture = new PtmTexture(renderer, `/files/${name}.ptm`);
  const fault = await texture.refine(99).then(String, (error) => error.code ?? error.message);
  say.push([name, fault, texture.level]);
  texture.dispose();
}
return { say, left: gpu.bytes };
"""


def test_files_at_fault(three: Any, files: Path, tmp_path: Path) -> None:
    """Levels before the fault stay. A wrong checksum is asked for once more, then stated."""
    file = (files / "odd.ptm").read_bytes()
    flipped = bytearray(file)
    flipped[-1] ^= 1
    (tmp_path / "flipped.ptm").write_bytes(flipped)
    (tmp_path / "head.ptm").write_bytes(bytes(40) + file)
    (tmp_path / "cut.ptm").write_bytes(file[:-1])
    names = ["flipped", "head", "cut", "none"]
    actual, visit = three.run(FAULTS, {"files": tmp_path}, names=names)
    last = len(expected(files / "odd.ptm")) - 1
    faults = {name: (fault, level) for name, fault, level in actual["say"]}
    assert faults["flipped"] == ("PTM-I108", last - 1)
    assert faults["head"] == ("PTM-I101", -1)
    assert faults["cut"] == ("PTM-I103", last - 1)
    assert "404" in faults["none"][0]
    assert actual["left"] == 0
    ranges = [(begin, end) for path, begin, end in visit.ranges if "flipped" in path]
    assert [end for _, end in ranges[-2:]] == [len(file)] * 2
    assert len(visit.messages) == 2
    assert "flipped.ptm: PtmError: PTM-I108" in visit.messages[0]
    assert visit.messages[1] == "error: 404 /files/none.ptm"


PREVIEWS = """
const stated = [];
const at = (file) => new URL(`/files/${file}`, document.baseURI);
for (const { file, level, ...options } of settings.textures) {
  const previews = options.previews.map((one) => ({ ...one, file: at(one.file) }));
  const texture = new PtmTexture(renderer, at(file), { ...options, previews });
  const states = [];
  for (const exact of [false, true]) {
    await texture.refine(level, { exact });
    states.push(await levelsOf(renderer, texture));
  }
  await texture.refine(3);
  states.push(await levelsOf(renderer, texture), texture.gpuBytes, gpu.bytes);
  texture.dispose();
  stated.push(states);
}
return stated;
"""


def test_previews_before_exact_levels(three: Any, tmp_path: Path) -> None:
    """A preview is shown first and gives way to what is exact; a damaged one is left out; one alone
    stays."""
    texels = textured(211, 99, 4)
    levels, preview = levels_of(texels), Preview(6, options={"quality": 80, "exact": True})
    image = saved(levels[6], preview)
    shown = [decoded(image, 4)]
    while len(shown) < 7:
        shown.insert(0, halved(shown[0]))
    (tmp_path / "whole.ptm").write_bytes(encode(texels, EncodeOptions()))
    (tmp_path / "some.ptm").write_bytes(encode(levels[4], EncodeOptions()))
    (tmp_path / "good.webp").write_bytes(image)
    (tmp_path / "bad.webp").write_bytes(image[:100])
    lossless = Preview(6, options={"lossless": True, "exact": True})
    (tmp_path / "lossless.webp").write_bytes(saved(levels[6], lossless))
    sizes = [{"width": level.shape[1], "height": level.shape[0]} for level in levels]
    textures = []
    for ptm, name in [("whole", "good"), ("whole", "bad"), ("some", "good"), ("some", "bad")]:
        ends = [level.end for level in read_header((tmp_path / f"{ptm}.ptm").read_bytes()).levels]
        # Not worth its bytes otherwise.
        row = {"file": f"{name}.webp", "level": 6, "bytes": 1}
        more = {"ends": ends, "sizes": sizes, "components": 4}
        textures.append({"file": f"{ptm}.ptm", "level": 6, "previews": [row], **more})
    twice = [row | {"file": "good.webp"}, row | {"file": "lossless.webp", "exact": True}]
    textures.append(textures[2] | {"previews": twice})
    actual, visit = three.run(PREVIEWS, {"files": tmp_path}, textures=textures)

    def digests(of: Any) -> list[str]:
        return [hashlib.sha256(rgba(level).tobytes()).hexdigest() for level in of]

    exact, by_image = digests(levels), digests(shown)
    assert exact != by_image
    assert [states[:2] for states in actual] == [
        [by_image, exact],
        [exact, exact],
        [by_image, by_image],
        [exact[:5], exact[:5]],
        [by_image, exact],
    ]
    assert all(states[2] == exact[:4] for states in actual)
    assert all(stated == counted for *_, stated, counted in actual)
    assert len([m for m in visit.messages if "bad.webp" in m]) == 2
