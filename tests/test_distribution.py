"""Wheel and source distribution: built, inspected, installed in an empty environment, and used."""

import email
import os
import subprocess
import sys
import sysconfig
import tarfile
import tomllib
import venv
import zipfile
from email.message import Message
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.tiers import extended

pytestmark = extended

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
NAME = f"sagline-{PROJECT['version']}"
INFO = {"METADATA", "RECORD", "WHEEL", "entry_points.txt", "licenses/LICENSE"}
EXTRA_PACKAGES = (
    *("bokeh", "cma", "dask", "distributed", "fcl", "foxglove_schemas_protobuf", "mcap", "mcap_protobuf"),
    *("pymodbus", "pymoo", "skimage", "snap7", "trimesh", "viser", "zarr", "zstandard"),
)
MADE_FOR_EXTRAS = ("sagline.viewer", "sagline.torch", "sagline.twin.modbus_servers", "sagline.twin.s7_servers")
USED = """
import sys
from importlib.resources import files
import sagline as sl
robots = [sl.load_robot(name) for name in sl.robot_names()]
sl.export_c(robots[0], "robot.c")
for asset in sys.argv[1:]:
    assert files("sagline").joinpath(asset).is_file(), asset
assert sl.backend() == "c"
print(len(robots), sl.__version__, sl.__file__)
"""


BUILT = (  # by tools/build.py, with gcc or clang on x86-64
    *("kernels/compiled/kernels.so", "kernels/compiled/kernels_v3.so"),
    *("files/c/kernels.json", "share/page/kernels.wasm"),
)


class Built(NamedTuple):
    """Paths of the distributions."""

    wheel: Path
    source: Path


def run(*words: str | Path, folder: Path) -> str:
    """Output of a program that runs outside of this source tree."""
    clean = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "PYTHONSAFEPATH")}
    done = subprocess.run([str(word) for word in words], cwd=folder, env=clean, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def build(tree: Path, folder: Path, *targets: str) -> None:
    """Run the build of pyproject.toml; it requires no network if hatchling is installed."""
    where = [path for path in sys.path if path]
    code = f"import sys; sys.path[:] = {where!r}; from hatchling.cli import hatchling; hatchling()"
    chosen = [word for target in targets for word in ("-t", target)]
    run(sys.executable, "-c", code, "build", "-d", folder, *chosen, folder=tree)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Built:
    folder = tmp_path_factory.mktemp("dist")
    build(ROOT, folder, "wheel", "sdist")
    (wheel,) = folder.glob(f"{NAME}-py3-none-*.whl")
    assert not wheel.stem.endswith("any"), "the wheel has no compiled kernels"
    return Built(wheel, folder / f"{NAME}.tar.gz")


@pytest.fixture(scope="module")
def unpacked(built: Built, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("source")
    with tarfile.open(built.source) as archive:
        archive.extractall(folder, filter="data")
    return folder / NAME


def sources(folder: Path) -> set[str]:
    """Files of a folder, except caches such as __pycache__ and .ruff_cache."""
    found = {path.relative_to(folder) for path in folder.rglob("*") if path.is_file()}
    return {path.as_posix() for path in found if not any("cache" in part and part[0] in "_." for part in path.parts)}


def contents(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.soak
def test_distributions_that_are_built_twice_have_the_same_bytes(built: Built, tmp_path: Path) -> None:
    """Built in folders of different names, with other permissions and another order of hashes."""
    found = []
    for name, mask, seed in (("a", 0o022, "1"), ("another folder", 0o077, "2")):
        place = tmp_path / name
        place.mkdir()
        before = os.umask(mask)
        try:
            with tarfile.open(built.source) as archive, pytest.MonkeyPatch.context() as patched:
                archive.extractall(place, filter="data")
                patched.setenv("PYTHONHASHSEED", seed)
                build(place / NAME, place / "dist", "wheel", "sdist")
        finally:
            os.umask(before)
        found.append({file.name: sha256(file.read_bytes()).hexdigest() for file in (place / "dist").iterdir()})
    assert len(found[0]) == 2
    assert found[0] == found[1]


def test_the_wheel_contains_exactly_the_package_its_data_and_examples(built: Built) -> None:
    package = {f"sagline/{name}" for name in sources(ROOT / "src" / "sagline")}
    examples = {f"sagline/examples/{name}" for name in sources(ROOT / "examples")}
    info = {f"{NAME}.dist-info/{name}" for name in INFO}
    assert set(contents(built.wheel)) == package | examples | info
    assert {"sagline/py.typed", "sagline/robot/presets/cogiro.yaml", *(f"sagline/{name}" for name in BUILT)} < package


def test_the_source_distribution_contains_all_files_of_development(unpacked: Path) -> None:
    top = {path.name for path in unpacked.iterdir()}
    folders = {"src", "tests", "docs", "examples", "benchmarks", "tools", "paper", "recipe"}
    files = {"CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md", "LICENSE", "Makefile", "README.md", "mkdocs.yml"}
    files |= {"SECURITY.md", "constraints.txt"}
    assert top == folders | files | {"pyproject.toml", "PKG-INFO", ".gitignore"}
    for folder in sorted(folders):
        made = {f"sagline/{name}" for name in BUILT} if folder == "src" else set()
        assert sources(unpacked / folder) == sources(ROOT / folder) - made, folder


def test_the_wheel_of_the_source_distribution_is_the_same(built: Built, unpacked: Path, tmp_path: Path) -> None:
    build(unpacked, tmp_path, "wheel")
    assert contents(tmp_path / built.wheel.name) == contents(built.wheel)


def metadata(wheel: Path) -> Message:
    return email.message_from_bytes(contents(wheel)[f"{NAME}.dist-info/METADATA"])


def test_metadata_for_an_index(built: Built) -> None:
    told = metadata(built.wheel)
    assert (told["Name"], told["Version"]) == ("sagline", PROJECT["version"])
    assert (told["License-Expression"], told["License-File"]) == ("MIT", "LICENSE")
    assert told["Requires-Python"] == PROJECT["requires-python"]
    assert told["Description-Content-Type"] == "text/markdown"
    assert told["Keywords"].split(",") == sorted(set(PROJECT["keywords"]))
    assert told.get_all("Classifier") == PROJECT["classifiers"]  # hatchling refuses invalid metadata
    assert set(told.get_all("Provides-Extra", [])) == set(PROJECT["optional-dependencies"])
    needed = [line for line in told.get_all("Requires-Dist", []) if "extra ==" not in line]
    assert needed == PROJECT["dependencies"]


def test_the_wheel_works_in_another_environment(built: Built, tmp_path: Path) -> None:
    """Only sagline is installed; its dependencies come from the environment of the tests without its sagline."""
    venv.create(tmp_path / "new", symlinks=True)
    binaries = tmp_path / "new" / "bin"
    offline = ("install", "--no-index", "--no-deps", "--quiet", "--no-compile", "--disable-pip-version-check")
    run(sys.executable, "-m", "pip", "--python", binaries / "python", *offline, built.wheel, folder=tmp_path)
    place = Path(sysconfig.get_path("purelib", vars={"base": str(tmp_path / "new")}))
    (place / "lent.pth").write_text(f"{sysconfig.get_path('purelib')}\n")
    assets = [name for name in sources(ROOT / "src" / "sagline") if not name.endswith(".py")]
    assert {"present/page.css", "article/data/table2.csv", "files/scl/sagline_plc.scl", "py.typed"} < set(assets)
    count, version, file = run(binaries / "python", "-W", "error", "-c", USED, *assets, folder=tmp_path).split()
    assert (int(count), version) == (16, PROJECT["version"])
    assert Path(file).is_relative_to(place)
    listed = run(binaries / "sagline", "robots", folder=tmp_path)
    assert "cogiro" in listed
    run(binaries / "sagline", "examples", "--out", "mine", folder=tmp_path)
    assert (tmp_path / "mine" / "own_robot.yaml").is_file()


def test_only_modules_of_an_extra_require_it() -> None:
    """Every module loads without the packages of all extras, except the viewer, `torch` and the links to PLCs."""
    code = f"""
import importlib, pkgutil, sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {EXTRA_PACKAGES!r}:
            raise ModuleNotFoundError(name=name)
sys.meta_path.insert(0, Hidden())
import sagline
for module in pkgutil.walk_packages(sagline.__path__, "sagline."):
    if not module.name.startswith({MADE_FOR_EXTRAS!r}) and not module.name.endswith("__main__"):
        try:
            importlib.import_module(module.name)
        except ModuleNotFoundError as error:
            print(module.name, "needs", error.name)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == ""


@pytest.mark.soak
def test_the_wheel_works_with_its_requirements_only(built: Built, tmp_path: Path) -> None:
    """From an index, as a user installs it; the kernels are compiled again."""
    venv.create(tmp_path / "new", symlinks=True, with_pip=True)
    binaries = tmp_path / "new" / "bin"
    run(binaries / "python", "-m", "pip", "install", "--quiet", built.wheel, folder=tmp_path)
    run(binaries / "sagline", "examples", "--out", "mine", folder=tmp_path)
    told = run(binaries / "sagline", "track", "cogiro", "mine/own_path.yaml", "--out", "made", folder=tmp_path)
    assert "cogiro" in told
    assert (tmp_path / "made").is_dir()


def test_the_extra_of_the_viewer_contains_the_packages_of_its_region() -> None:
    """README installs this extra only."""
    extras = PROJECT["optional-dependencies"]
    surface = {line for line in extras["workspace"] if line.startswith(("scikit-image", "trimesh"))}
    assert len(surface) == 2
    assert surface <= set(extras["viewer"])
