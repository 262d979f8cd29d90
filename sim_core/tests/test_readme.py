# SPDX-License-Identifier: Apache-2.0
"""The examples of the README run as they stand."""

import re
from pathlib import Path


def test_examples_run():
    text = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    examples = re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)
    names: dict[str, object] = {}
    for example in examples:
        exec(example, names)
    assert names["simulator"].time == 0.02
    assert names["result"].lines["cable"].start_tension.min() > 0
