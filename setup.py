"""The version of the package is that of the Rust workspace; all else is in pyproject.toml."""

import re
from pathlib import Path

from setuptools import setup

manifest = (Path(__file__).parent / "Cargo.toml").read_text(encoding="utf-8")
found = re.search(r'^version = "(.+)"$', manifest, re.MULTILINE)
if found is None:
    raise SystemExit("error: Cargo.toml states no version")
setup(version=found[1])
