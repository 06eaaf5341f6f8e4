"""Writes every generated file below models/; see the package."""

from pathlib import Path

from painter_models.generate.description import MODELS
from painter_models.generate.looks import LOOKS
from painter_models.generate.mesh import write_gltf
from painter_models.generate.urdf import write_urdf


def generated_files() -> dict[str, str]:
    """Returns the text of every generated file, by its path below models/."""
    files = {}
    for model in MODELS.values():
        files[f"{model.folder}/{model.folder}.urdf"] = write_urdf(model)
        for link in model.links:
            mesh = write_gltf(LOOKS[link.name]())
            files[f"{model.folder}/meshes/{link.name}.gltf"] = mesh
    return files


if __name__ == "__main__":
    root = Path(__file__).resolve().parents[1]
    for path, text in generated_files().items():
        (root / path).parent.mkdir(parents=True, exist_ok=True)
        (root / path).write_text(text)
