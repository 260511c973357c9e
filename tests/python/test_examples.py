"""The examples, and the session of docs/python.md, run and draw."""

import os
import pathlib
import re
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).parents[2]
DRAWING = os.environ | {"MPLBACKEND": "Agg"}


@pytest.mark.parametrize("example", sorted((ROOT / "examples" / "python").glob("*.py")), ids=lambda p: p.stem)
def test_an_example_draws(example, tmp_path):
    picture = tmp_path / "picture.png"
    subprocess.run([sys.executable, "-B", example, picture], check=True, env=DRAWING | {"MPLCONFIGDIR": str(tmp_path)})
    assert picture.stat().st_size > 10_000


def test_the_session_of_ten_lines(tmp_path):
    session = re.search(r"```python\n(.*?)```", (ROOT / "docs" / "python.md").read_text(), re.DOTALL).group(1)
    assert len([line for line in session.splitlines() if line.strip()]) <= 10
    subprocess.run([sys.executable, "-c", session], check=True, cwd=tmp_path, env=DRAWING | {"MPLCONFIGDIR": str(tmp_path)})
    assert (tmp_path / "dax.svg").stat().st_size > 10_000
