"""Every script of the gallery still runs, and every picture is shown with its command."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
GALLERY = DOCS / "gallery"
SCRIPTS = sorted(p for p in GALLERY.glob("*.py") if p.name != "common.py")


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda p: p.stem)
def test_script_makes_its_picture(script: Path, tmp_path: Path) -> None:
    """A script that an interface has left behind fails here, at the size of a stamp."""
    pytest.importorskip("matplotlib")
    done = subprocess.run(
        [sys.executable, str(script), "--quick", "--folder", str(tmp_path)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    names = [p.name for p in tmp_path.iterdir()]
    assert f"{script.stem}.png" in names
    for name in names:
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def test_every_picture_is_on_the_page_with_its_script() -> None:
    """No picture without a caption and command, none shown that does not exist, and all of them small."""
    page = (GALLERY / "README.md").read_text(encoding="utf-8")
    shown = {GALLERY / name for name in re.findall(r"!\[[^\]]+\]\(([^)]+)\)", page)}
    for picture in shown:
        assert picture.resolve().is_file(), picture
    for script in SCRIPTS:
        assert f"python docs/gallery/{script.name}" in page, script.name
    pictures = list((DOCS / "images" / "gallery").glob("*"))
    assert {p.resolve() for p in shown} >= {p.resolve() for p in pictures}
    assert sum(p.stat().st_size for p in pictures) < 6_000_000
    assert max(p.stat().st_size for p in pictures) < 500_000
