"""Normal maps of objects in three.js: the package lights them as `ptm render --lit`; other viewers
show the same normals, from the GLB and its images alone."""

from __future__ import annotations

import base64
import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests" / "e2e"), str(ROOT / "benchmarks")]
from browsers import gltf_validator  # noqa: E402

from benchmarks.npm import GLTF_VALIDATOR  # noqa: E402
from ptmtools.cli.main import main  # noqa: E402
from ptmtools.output.object_maps import frame_axes  # noqa: E402
from ptmtools.output.served import Served, read_served  # noqa: E402
from ptmtools.rendering.drawing import ViewOptions, draw_view  # noqa: E402
from ptmtools.rendering.rays import Caster, RayCamera  # noqa: E402
from ptmtools.rendering.records import Sight  # noqa: E402
from ptmtools_systems.apo.normal_map import look_up_normals  # noqa: E402
from tests.systems.apo.statues import write_rooms  # noqa: E402

WIDTH, HEIGHT = 320, 240
#: In front of the first statue, with the yaw of a camera that is not turned.
EYE = (-2.8, 1.6, 0.6)


@pytest.fixture(scope="module")
def database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("relief")
    model = write_rooms(folder / "model", 5)
    options = ["--apo", "statue*", "--apo-faces", "500", "--apo-error", "0.01"]
    options += ["--relief", "normal-map", "--format", "gltf", "-j", "1", "--plain-gltf"]
    options += ["--light", "none"]
    options += ["--viewpoint", ",".join(map(str, (*EYE, 0)))]
    assert main(["-q", "build-scene", str(model), "-o", str(folder / "db"), *options]) == 0
    return folder / "db"


def seen(served: Served, angle: float) -> tuple[Sight, np.ndarray]:
    """What is seen from the eye, and (HEIGHT, WIDTH) whether it is the inside of a statue."""
    eye = np.array(served.index["viewpoints"][0]["position"])
    camera = RayCamera(WIDTH, HEIGHT, angle, WIDTH / HEIGHT, HEIGHT)
    sight = Caster(served.surfaces).look(camera, eye, np.array([0.0, 0.0, -1.0]))
    relief = served.surfaces.relief
    assert relief is not None
    own = (sight.triangle >= 0) & (relief.number[sight.triangle] >= 0)
    mask = inside = own.reshape(HEIGHT, WIDTH)
    for dy in range(-3, 4):
        for dx in range(-3, 4):
            inside = inside & np.roll(mask, (dy, dx), (0, 1))
    assert inside.sum() > 0.05 * mask.size
    return sight, inside


def pixels(png: bytes) -> np.ndarray:
    with Image.open(io.BytesIO(png)) as image:
        return np.asarray(image.convert("RGB")).astype(float)


def test_the_package_lights_it(three: Any, database: Path) -> None:
    served = read_served(database)
    view = served.index["viewpoints"][0]
    _, inside = seen(served, view["fieldOfView"])
    walked = three.walk(database / "www", width=WIDTH, height=HEIGHT)
    assert walked.messages == ()
    expected = draw_view(served, ViewOptions(viewpoint=0, width=WIDTH, height=HEIGHT, lit=True))
    error = ((pixels(walked.png)[inside] - expected[inside]) ** 2).mean()
    assert 10 * np.log10(255**2 / error) >= 38


OTHER = """
const { GLTFLoader } = await import("three/addons/loaders/GLTFLoader.js");
const camera = new THREE.PerspectiveCamera(
  settings.angle, settings.width / settings.height, 0.05, 1000);
camera.position.set(...settings.eye);
const { scene } = await new GLTFLoader().loadAsync("/www/gltf/" + settings.cell + ".glb");
scene.traverse((node) => {
  if (!node.isMesh) return;
  const { normalMap, normalScale, side } = node.material;
  node.visible = Boolean(normalMap);
  if (normalMap) node.material = new THREE.MeshNormalMaterial({ normalMap, normalScale, side });
});
renderer.render(scene, camera);
return renderer.domElement.toDataURL("image/png");
"""


def test_other_viewers_show_the_same_normals(three: Any, database: Path) -> None:
    """three.js with its own material, which knows nothing but glTF. The camera is not turned, so
    the normals that it shows are those of the world."""
    served = read_served(database)
    view = served.index["viewpoints"][0]
    sight, inside = seen(served, view["fieldOfView"])
    assert view["position"] == pytest.approx(EYE, abs=0.05)
    url, visit = three.run(
        OTHER,
        {"www": database / "www"},
        width=WIDTH,
        height=HEIGHT,
        angle=float(np.degrees(view["fieldOfView"])),
        eye=view["position"],
        cell=served.index["cells"][view["cell"]]["name"],
    )
    assert visit.messages == []
    shown = pixels(base64.b64decode(url.partition(",")[2]))[inside] / 127.5 - 1
    assert np.degrees(angles(shown, normals_of(served, sight, inside.ravel()))).mean() < 0.5


def angles(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    cosine = (one * other).sum(axis=1) / np.linalg.norm(one, axis=1) / np.linalg.norm(other, axis=1)
    return np.arccos(cosine.clip(-1, 1))


def normals_of(served: Served, sight: Sight, chosen: np.ndarray) -> np.ndarray:
    """(n, 3) what the PNG of the map has at chosen pixels, with bilinear filtering."""
    relief = served.surfaces.relief
    assert relief is not None
    face, ray = sight.triangle[chosen], sight.ray[chosen]
    corner = served.surfaces.corner[face]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    far = ((corner[:, 0] - sight.eye) * across).sum(1) / (ray * across).sum(1)
    point = sight.eye + far[:, None] * ray
    areas = [
        (np.cross(corner[:, k - 2] - point, corner[:, k - 1] - point) * across).sum(1)
        for k in range(3)
    ]
    weight = np.stack(areas, axis=1) / (across**2).sum(1)[:, None]
    place = np.einsum("nk,nkx->nx", weight, relief.uv[face])
    (number,) = np.unique(relief.number[face]).tolist()
    image = served.index["textures"][number]["fallback"]
    texels = np.asarray(Image.open(served.folder / image).convert("RGB"))
    return look_up_normals(texels, place * [1, -1] + [0, 1], relief.frame[face])


def test_frames_are_as_gltf_demands(database: Path) -> None:
    """Unit normals and tangents at right angles, the sign of the bitangent, and no normal that
    looks into the surface of its chart."""
    served = read_served(database)
    relief = served.surfaces.relief
    assert relief is not None
    frame = relief.frame[relief.number >= 0]
    axes = frame_axes(frame)
    assert np.abs(np.linalg.norm(axes, axis=1) - 1).max() < 0.005
    assert np.abs(np.einsum("nij,nik->njk", axes, axes) - np.eye(3)).max() < 0.01
    assert set(np.unique(frame[:, 6])) <= {-1, 1}
    for row in served.index["textures"]:
        if "relief" in row:
            image = Image.open(served.folder / row["fallback"]).convert("RGB")
            assert np.asarray(image)[..., 2].min() >= 128


def test_the_validator_finds_no_fault(database: Path, require: Any) -> None:
    if remedy := GLTF_VALIDATOR.remedy():
        require("the glTF validator", remedy)
    for name, said in gltf_validator.validate(database / "www" / "gltf").items():
        assert said.complaints == (), name
