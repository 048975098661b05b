"""The package as it is installed: quick to import, with its command and its types."""

from __future__ import annotations

import re
import subprocess
import sys
import sysconfig
from importlib import metadata
from pathlib import Path

import celaje

ROOT = Path(__file__).parents[2]


def test_import_is_quick() -> None:
    """Below 0.3 s on the clock, the best of several runs, for other programs may get in the way of one."""
    program = "import time; t = time.perf_counter(); import celaje; print(time.perf_counter() - t)"
    assert min(float(_printed_by(program)) for _ in range(7)) < 0.3


def test_import_takes_numpy_only() -> None:
    program = "import sys, celaje; print('xarray' in sys.modules, 'matplotlib' in sys.modules)"
    assert _printed_by(program).split() == ["False", "False"]


def _printed_by(program: str) -> str:
    run = subprocess.run(
        [sys.executable, "-c", program], check=True, capture_output=True, text=True
    )
    return run.stdout


def test_versions_agree() -> None:
    manifest = (ROOT / "Cargo.toml").read_text(encoding="utf-8")
    found = re.search(r'^version = "(.+)"$', manifest, re.MULTILINE)
    assert found is not None
    assert celaje.__version__ == metadata.version("celaje") == found[1]


def test_numpy_is_the_only_hard_dependency() -> None:
    needed = [r for r in metadata.requires("celaje") or [] if "extra ==" not in r]
    assert [re.split(r"[^\w-]", r)[0] for r in needed] == ["numpy"]


def test_the_command_is_a_program_and_no_script() -> None:
    command = Path(sysconfig.get_path("scripts")) / "celaje"
    assert command.is_file()
    assert not command.read_bytes().startswith(b"#!")
    subprocess.run([command, "--help"], check=True, capture_output=True)


def test_types_are_shipped() -> None:
    folder = Path(celaje.__file__).parent
    assert (folder / "py.typed").is_file()
    assert (folder / "_core.pyi").is_file()


def test_every_public_name_is_documented() -> None:
    for name in celaje.__all__:
        item = getattr(celaje, name)
        assert name == "__version__" or item.__doc__, name
        for member, value in vars(item).items() if isinstance(item, type) else []:
            if not member.startswith("_") and callable(value):
                assert value.__doc__, f"{name}.{member}"
