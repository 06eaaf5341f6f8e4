"""`pip install .` outside the checkout: the wheel holds all files and works alone."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from painter.resources import named_scenarios

ROOT = Path(__file__).parents[1]
# Folder in the checkout -> package in the wheel.
PACKAGES = {
    "painter": "painter",
    "perception": "perception",
    "models": "painter_models",
}


def tracked_files() -> list[str]:
    if not (ROOT / ".git").exists():
        pytest.skip("needs a git checkout")
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return [name for name in done.stdout.splitlines() if (ROOT / name).is_file()]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """A wheel built from a copy of the tracked files, so that nothing else gets in."""
    source = tmp_path_factory.mktemp("source")
    for name in tracked_files():
        if name.split("/")[0] in (*PACKAGES, "pyproject.toml", "README.md", "LICENSE"):
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, source / name)
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "wheel", "-qq", "--no-deps"]
    where = ["--no-build-isolation", "-w", str(folder), str(source)]
    subprocess.run([*pip, *where], check=True)
    (path,) = folder.glob("*.whl")
    return path


def test_wheel_holds_exactly_the_tracked_files(wheel):
    expected = set()
    for name in tracked_files():
        top, _, rest = name.partition("/")
        if top in PACKAGES and not rest.startswith("generate/"):
            expected.add(f"{PACKAGES[top]}/{rest}")
    packed = {n for n in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in n}
    assert packed == expected


def test_installed_package_finds_its_models(wheel, tmp_path):
    zipfile.ZipFile(wheel).extractall(tmp_path / "site")
    code = (
        "import painter_models\n"
        "from painter.config import load_scenario\n"
        "from painter.resources import named_scenarios\n"
        "for name in named_scenarios(): load_scenario(name)\n"
        "print(painter_models.__file__, *named_scenarios())"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(tmp_path / "site")},
        capture_output=True,
        text=True,
        check=True,
    )
    file, *names = done.stdout.split()
    assert Path(file) == tmp_path / "site" / "painter_models" / "__init__.py"
    assert names == named_scenarios()


def test_model_package_has_the_projects_version():
    pyproject = (ROOT / "pyproject.toml").read_text()
    package = (ROOT / "models" / "package.xml").read_text()
    version = pyproject.split('version = "')[1].split('"')[0]
    assert f"<version>{version}</version>" in package
